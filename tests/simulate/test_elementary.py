"""Elementary functions against mpmath, at the limits of their ranges, and with and without the compiler."""

from __future__ import annotations

import math
import random
import subprocess
import sys

import mpmath
import numpy as np
import pytest

from ferryid.simulate import elementary

COUNT = 2000


def uniform(low, high, seed=1):
    return [(random.Random(seed + i).uniform(low, high),) for i in range(COUNT)]


def decades(low, high, *, signed=True):
    draw = random.Random(2)
    return [((draw.choice((-1, 1)) if signed else 1) * 10 ** draw.uniform(low, high),) for _ in range(COUNT)]


def beside_multiples_of_a_right_angle():
    with mpmath.workprec(200):
        return [(float(k * mpmath.pi / 2),) for k in [*range(1, 200), *range(200, 636_000, 977)]]


def points():
    draw = random.Random(3)
    made = [(draw.gauss(0, 1), draw.gauss(0, 1)) for _ in range(COUNT)]
    made += [(draw.gauss(0, 1) * 10 ** draw.uniform(-300, 300), draw.gauss(0, 1)) for _ in range(COUNT)]
    made += [(draw.uniform(-0.08, 0.08), draw.choice((-1.0, 1.0))) for _ in range(COUNT)]
    made += [(1.0, draw.uniform(-0.08, 0.08)) for _ in range(COUNT)]
    made += [(draw.gauss(0, 1) * 10 ** draw.uniform(-320, -270), 10 ** draw.uniform(-320, -270)) for _ in range(COUNT)]
    return [*made, (1e308, -1e308), (5e-324, 5e-324), (1.0, 1.0), (-1.0, -1.0), (1e-300, 1e300)]


CASES = {
    "sin": [*uniform(-7, 7), *uniform(-1e6, 1e6), *decades(-300, 6), *beside_multiples_of_a_right_angle()],
    "cos": [*uniform(-7, 7), *uniform(-1e6, 1e6), *decades(-300, 6), *beside_multiples_of_a_right_angle()],
    "exp": [*uniform(-1, 1), *uniform(-707.9, 709.6), *decades(-300, 2)],
    "log": [*uniform(0.5, 2.0), *decades(-323, 308, signed=False), *[(1.0 + x,) for (x,) in decades(-15, -1)]],
    "atan2": points(),
}


@pytest.mark.parametrize("name", CASES)
def test_within_one_unit_in_the_last_place(name):
    found, exact = getattr(elementary, name), getattr(mpmath, name)
    with mpmath.workprec(220):
        for arguments in CASES[name]:
            true = exact(*map(mpmath.mpf, arguments))
            error = abs(mpmath.mpf(found(*arguments)) - true)
            assert error <= math.ulp(float(true)), f"{name}{arguments}: {float(error / math.ulp(float(true))):.3f} ulp"


def test_constants_are_those_of_mpmath():
    with mpmath.workprec(300):
        parts = (elementary.HALF_PI_1, elementary.HALF_PI_2, elementary.HALF_PI_3, elementary.HALF_PI_4)
        assert abs(mpmath.fsum(map(mpmath.mpf, parts)) - mpmath.pi / 2) < mpmath.mpf(2) ** -156
        assert all(math.ldexp(part, 200) % 2 ** (200 + math.frexp(part)[1] - 33) == 0.0 for part in parts[:3])
        assert float(mpmath.pi / 2) == elementary.HALF_PI
        assert float(mpmath.pi / 2 - mpmath.mpf(elementary.HALF_PI)) == elementary.HALF_PI_REST
        assert float(2 / mpmath.pi) == elementary.TWO_OVER_PI
        assert float(1 / mpmath.log(2)) == elementary.ONE_OVER_LN_2
        assert abs(mpmath.mpf(elementary.LN_2_1) + elementary.LN_2_2 - mpmath.log(2)) < mpmath.mpf(2) ** -86
        for k, (high, low) in enumerate(elementary.ARCTANGENTS.tolist()):
            true = mpmath.atan(mpmath.mpf(k) / 64)
            assert (high, low) == (float(true), float(true - mpmath.mpf(float(true))))


def test_hand_worked_values():
    assert (elementary.sin(0.0), elementary.cos(0.0), elementary.exp(0.0), elementary.log(1.0)) == (0.0, 1.0, 1.0, 0.0)
    assert elementary.sin(1e-300) == 1e-300
    assert elementary.sin(-2.0) == -elementary.sin(2.0)
    assert elementary.atan2(0.0, 0.0) == 0.0
    assert elementary.atan2(0.0, 3.0) == 0.0
    assert elementary.atan2(0.0, -3.0) == math.pi
    assert elementary.atan2(2.0, 0.0) == 0.5 * math.pi
    assert elementary.atan2(-2.0, 0.0) == -0.5 * math.pi
    assert elementary.atan2(-1.0, 1.0) == -0.25 * math.pi
    assert elementary.atan2(1.0, -1.0) == 0.75 * math.pi


def test_what_is_no_number_stays_so_and_ends_are_ends():
    for bad in (math.nan, math.inf, -math.inf):
        assert math.isnan(elementary.sin(bad))
        assert math.isnan(elementary.cos(bad))
        assert math.isnan(elementary.atan2(bad, 1.0))
        assert math.isnan(elementary.atan2(1.0, bad))
    assert math.isnan(elementary.exp(math.nan))
    assert math.isnan(elementary.log(math.nan))
    assert math.isnan(elementary.log(-1.0))
    assert elementary.log(0.0) == -math.inf
    assert elementary.log(math.inf) == math.inf
    assert elementary.exp(800.0) == math.inf
    assert elementary.exp(-800.0) == 0.0


def test_arrays_hold_the_same_bits_as_single_numbers():
    draw = np.random.default_rng(4)
    x, y = draw.normal(size=(2, 999))
    sines, cosines = elementary.sines_cosines(9.0 * x)
    assert sines.tolist() == [elementary.sin(9.0 * value) for value in x.tolist()]
    assert cosines.tolist() == [elementary.cos(9.0 * value) for value in x.tolist()]
    assert elementary.directions(y, x).tolist() == list(map(elementary.atan2, y.tolist(), x.tolist()))


def test_interpreted_they_give_the_same_bits(monkeypatch):
    code = (
        "import random, struct, zlib\n"
        "from ferryid.simulate.elementary import atan2, cos, exp, log, sin\n"
        "draw = random.Random(5)\n"
        "x = [draw.gauss(0.0, 20.0) for _ in range(1000)]\n"
        "values = [f(a) for f in (sin, cos, exp) for a in x] + [log(abs(a)) for a in x] + list(map(atan2, x, x[1:]))\n"
        "print(zlib.crc32(struct.pack(f'{len(values)}d', *values)))\n"
    )
    found = []
    for setting in ("0", "1"):
        monkeypatch.setenv("NUMBA_DISABLE_JIT", setting)
        found.append(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
    assert found[0] == found[1]
