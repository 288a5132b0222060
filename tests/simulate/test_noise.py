"""Statistics of the noise: what was asked for is what comes out."""

from __future__ import annotations

import zlib
from math import exp, sqrt

import mpmath
import numpy as np
import pytest
from scipy import stats

from ferryid.simulate.noise import generator, gusts, interpolated, measurement_noise, sample_times, smooth_noise

N = 200_000


def test_smooth_noise_has_both_standard_deviations_of_table_5_2():
    step_s = 0.05
    x = smooth_noise(generator(1, "u"), N, step_s, 0.05, 0.01)
    assert x.std() == pytest.approx(0.05, rel=0.08)
    assert (np.diff(x) / step_s).std() == pytest.approx(0.01, rel=0.05)
    # Autocorrelation of a critically damped process: (1 + w tau) exp(-w tau), here w = 0.2 rad/s.
    for lag_s in (2.0, 5.0, 10.0):
        k = round(lag_s / step_s)
        found = np.mean(x[k:] * x[:-k]) / x.var()
        assert found == pytest.approx((1.0 + 0.2 * lag_s) * exp(-0.2 * lag_s), abs=0.06)


def test_noise_is_stationary_from_its_first_sample():
    first = [smooth_noise(generator(seed, "u"), 3, 0.05, 0.05, 0.01) for seed in range(1500)]
    assert np.std([x[0] for x in first]) == pytest.approx(0.05, rel=0.08)
    assert np.std([(x[1] - x[0]) / 0.05 for x in first]) == pytest.approx(0.01, rel=0.08)


def test_white_share():
    white = measurement_noise(generator(2, "w"), generator(2, "x"), N, 0.05, 0.02, 0.05, 1.0)
    assert white.std() == pytest.approx(0.02, rel=0.02)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.01
    mixed = measurement_noise(generator(2, "w"), generator(2, "x"), N, 0.05, 0.02, 0.02, 0.1)
    assert mixed.std() == pytest.approx(0.02, rel=0.08)


def test_noise_that_hardly_moves_stays_a_constant():
    x = smooth_noise(generator(1, "u"), 100, 0.05, 0.05, 1e-9)
    assert np.ptp(x) < 1e-8
    assert x[0] != 0.0


def test_noise_that_does_not_move_at_all_is_the_limit():
    """A constant within a trial, of the standard deviation asked for between trials."""
    for seed in (1, 2):
        still = smooth_noise(generator(seed, "u"), 100, 0.05, 0.05, 0.0)
        assert np.ptp(still) == 0.0
        np.testing.assert_allclose(still, smooth_noise(generator(seed, "u"), 100, 0.05, 0.05, 1e-9), atol=1e-8)
    assert np.std([smooth_noise(generator(seed, "u"), 1, 0.05, 0.05, 0.0)[0] for seed in range(1500)]) == pytest.approx(
        0.05, rel=0.08
    )


def test_more_noise_begins_like_less():
    for make in (
        lambda n: measurement_noise(generator(4, "w"), generator(4, "x"), n, 0.05, 0.02, 0.05, 0.5),
        lambda n: generator(4, "x").normal_columns(n, 3),
        lambda n: generator(4, "x").standard_exponential(n),
    ):
        np.testing.assert_array_equal(make(501)[:100], make(100))
    columns = generator(4, "x").normal_columns(N // 10, 3)
    assert np.abs(np.corrcoef(columns.T) - np.eye(3)).max() < 0.03


def test_gusts_forget_with_their_time_constant():
    x = gusts(generator(3, "gust"), N, 0.1, 0.8, 5.0)
    assert x.std() == pytest.approx(0.8, rel=0.06)
    assert np.corrcoef(x[50:], x[:-50])[0, 1] == pytest.approx(exp(-1.0), abs=0.04)


def test_nothing_asked_nothing_added():
    assert not smooth_noise(generator(1, "u"), 10, 0.05, 0.0, 0.0).any()
    assert not gusts(generator(1, "u"), 10, 0.05, 0.0, 5.0).any()


def test_channels_do_not_share_a_random_stream():
    a, b, again = (generator(7, name).standard_normal(500) for name in ("u", "v", "u"))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.2
    assert (a == again).all()
    assert (generator(8, "u").standard_normal(500) != a).all()


def test_random_numbers_are_those_of_their_distributions():
    random = generator(11, "any")
    uniform, normal, waits = random.random(N), random.standard_normal(N + 1), random.standard_exponential(N)
    assert len(normal) == N + 1
    # Kolmogorov-Smirnov: 1.95 / sqrt(n) is passed by chance once in a thousand times.
    for values, distribution in ((uniform, "uniform"), (normal, "norm"), (waits, "expon")):
        assert stats.kstest(values, distribution).statistic < 1.95 / sqrt(N)
    # Box and Muller's pairs have nothing to do with each other, nor have their squares.
    one, other = normal[:N:2], normal[1:N:2]
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.015
    assert abs(np.corrcoef(one**2, other**2)[0, 1]) < 0.015
    assert len(random.bytes(13)) == 13


def test_random_numbers_are_these_for_good():
    """Bits of PCG64 as NumPy promises them, and numbers made of them with mpmath."""
    raw = np.random.PCG64([5, zlib.crc32(b"any")]).random_raw(2).tolist()
    one, other = (mpmath.mpf(2 * (bits >> 12) + 1) / 2**53 for bits in raw)
    radius, angle = mpmath.sqrt(-2 * mpmath.log(one)), 2 * mpmath.pi * other
    found = generator(5, "any").standard_normal(2)
    np.testing.assert_allclose(
        found, [float(radius * mpmath.cos(angle)), float(radius * mpmath.sin(angle))], rtol=1e-14
    )
    assert generator(5, "any").random(1)[0] == float(one)


def test_interpolation_is_that_of_numpy():
    random = np.random.default_rng(1)
    grid, values = np.sort(random.uniform(0.0, 10.0, 50)), random.normal(size=(50, 3))
    t = np.sort(np.concatenate((random.uniform(-2.0, 12.0, 400), grid)))
    expected = np.column_stack([np.interp(t, grid, column) for column in values.T])
    np.testing.assert_allclose(interpolated(t, grid, values), expected, atol=1e-12)
    np.testing.assert_array_equal(interpolated(t, grid[:1], values[:1]), np.repeat(values[:1], len(t), axis=0))


def test_sample_times_end_before_the_end():
    np.testing.assert_allclose(sample_times(1.0, 4.0, 0.1), [0.1, 0.35, 0.6, 0.85])
    np.testing.assert_allclose(sample_times(1.0, 4.0, 0.0), [0.0, 0.25, 0.5, 0.75])
    assert len(sample_times(1.0, 4.0, 2.0)) == 0
