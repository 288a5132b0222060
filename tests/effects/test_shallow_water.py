"""Shallow water: sides beyond which nobody went are neither told nor of any matter."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from ferryid.effects import effects, shallow_water
from ferryid.effects.force_model import ForceModel, Measurements, acceleration, hull_of
from ferryid.effects.linear_evidence import log_evidence_gains
from ferryid.effects.shallow_water import EDGE_M, HEAVIER, SIDES
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
EFFECT = effects()["shallow_water"]
N = 2000
FACTOR = 1.8
OUTWARD = dict(zip(SIDES, (-1.0, 1.0, -1.0, 1.0), strict=True))


def sailed() -> ForceModel:
    """Return the force model of a vessel that goes over waters from 0 to 100 m north and 0 to 40 m east."""
    rng = np.random.default_rng(3)
    eta = np.column_stack([rng.uniform(0.0, 100.0, N), rng.uniform(0.0, 40.0, N), rng.uniform(-3.0, 3.0, N)])
    nu = rng.normal(size=(N, 3)) * [1.0, 0.5, 0.2]
    rest = np.zeros((N, 2, 3))
    measurements = Measurements(FERRY, 0.2 * np.arange(N), eta, nu, nu, rest, np.zeros((N, 2)), np.ones(N, dtype=bool))
    return ForceModel(measurements, hull_of(FERRY), rest, measurements.angles, np.zeros((N, 3)))


def values(**sides: float) -> np.ndarray:
    return np.array([FACTOR, *(sides[name] for name in SIDES), HEAVIER.start or 0.0])


PLACES = [
    ({"south": -EDGE_M, "north": 60.0, "west": 10.0, "east": 42.5}, {"south", "east"}),
    ({"south": 30.0, "north": 60.0, "west": 10.0, "east": 30.0}, set()),
    ({"south": -500.0, "north": 500.0, "west": -500.0, "east": 500.0}, set(SIDES)),
    ({"south": 50.0, "north": 130.0, "west": -20.0, "east": 20.0}, {"north", "west"}),
]


@pytest.mark.parametrize(("sides", "wanted"), PLACES)
def test_sides_beyond_which_nobody_went_are_untold(sides: dict[str, float], wanted: set[str]) -> None:
    force_model = sailed()
    assert EFFECT.unreported(force_model.measurements, values(**sides)) == wanted | {HEAVIER.name}
    here = acceleration(EFFECT.apply(force_model, values(**sides), None))
    for name in SIDES:
        # Whatever the log could tell of a side would be told by a change of the forces there.
        farther = values(**{**sides, name: sides[name] + 7.0 * OUTWARD[name]})
        same = np.array_equal(acceleration(EFFECT.apply(force_model, farther, None)), here)
        assert same == (name in wanted), name


def test_a_share_of_two_per_cent_of_what_was_measured_makes_a_side_told() -> None:
    measurements = sailed().measurements
    east = np.sort(measurements.eta[:, 1])
    for beyond, wanted in ((N // 50 - 1, {"east"}), (N // 50, set())):
        # Half-way between two rows, so many of them beyond.
        side = float(0.5 * (east[-beyond - 1] + east[-beyond]))
        p = values(south=30.0, north=60.0, west=10.0, east=side)
        assert EFFECT.unreported(measurements, p) == wanted | {HEAVIER.name}
    # Where nothing was measured nobody is known to have been.
    blind = replace(measurements, usable=measurements.eta[:, 0] < 60.0)
    assert EFFECT.unreported(blind, values(south=30.0, north=60.0, west=10.0, east=30.0)) == {"north", HEAVIER.name}
    assert EFFECT.unreported(measurements, values(south=30.0, north=60.0, west=10.0, east=30.0)) == {HEAVIER.name}


def test_a_place_that_was_visited_once_is_a_time_as_well() -> None:
    force_model = sailed()
    t = force_model.measurements.t
    there = np.column_stack([np.full(N, 50.0), np.full(N, 20.0), np.zeros(N)])
    p = values(south=40.0, north=60.0, west=10.0, east=30.0)
    for times, wanted in (
        ([(100.0, 160.0)], True),
        ([(60.0, 100.0), (200.0, 240.0)], False),
        ([(60.0, 65.0), (200.0, 205.0)], True),
    ):
        inside = np.any([(t >= first) & (t < last) for first, last in times], axis=0)
        eta = np.where(inside[:, None], there, there + np.array([0.0, 50.0, 0.0]))
        assert EFFECT.single_visit(replace(force_model.measurements, eta=eta), p) == wanted, times


@pytest.mark.parametrize(("visits", "wanted"), [(1, True), (3, True), (4, False), (6, False)])
def test_a_strip_that_is_crossed_often_needs_no_share_of_the_log(visits: int, wanted: bool) -> None:
    force_model, p = sailed(), values(south=0.0, north=10.0, west=0.0, east=10.0)
    measurements = force_model.measurements
    there = np.zeros(len(measurements.t), dtype=np.bool_)
    # Four per cent of the log in all.
    length = int(0.04 * len(there) / visits)
    for first in np.linspace(0.1, 0.9, visits) * len(there):
        there[int(first) : int(first) + length] = True
    eta = np.where(there[:, None], [5.0, 5.0, 0.0], [5.0, 50.0, 0.0])
    assert EFFECT.single_visit(replace(measurements, eta=eta), p) == wanted


@pytest.mark.slow
def test_a_place_is_chosen_in_little_memory() -> None:
    force_model = sailed()
    p = values(south=30.0, north=60.0, west=10.0, east=30.0)
    measured = acceleration(EFFECT.apply(force_model, p, None))

    def residual(of: ForceModel) -> np.ndarray:
        return (10.0 * (acceleration(of) - measured)).ravel()

    choose, hull = shallow_water.choose, hull_of(FERRY)
    chosen = choose(force_model, hull, residual)
    assert chosen.parameters[1].neutral == pytest.approx(30.0, abs=15.0)
    tracemalloc.start()
    choose(force_model, hull, residual)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # All rectangles at once need 200 MB.
    assert peak < 160e6


def test_the_evidence_of_sums_is_that_of_each_column_by_itself() -> None:
    rng = np.random.default_rng(5)
    J, e, columns = rng.normal(size=(200, 4)), rng.normal(size=200), rng.normal(size=(200, 6))
    sums, size, spread = rng.integers(0, 2, (6, 9)).astype(float), 0.4, 0.3
    found = log_evidence_gains(J, e, columns, sums, size, spread)
    # The hull and a parameter of this size are integrated out of a normal density.
    rest = spread**2 * J @ J.T + np.eye(200)
    for k, column in enumerate((columns @ sums).T):
        whole = rest + size**2 * np.outer(column, column)
        apart = [-0.5 * (e @ np.linalg.solve(one, e) + np.linalg.slogdet(one)[1]) for one in (whole, rest)]
        assert found[k] == pytest.approx(apart[0] - apart[1], abs=1e-9)


@pytest.mark.parametrize(
    ("told", "where"),
    [
        (SIDES, "from 12 to 34 m north and from -18 to 4 m east,"),
        (("north", "west", "east"), "up to 34 m north and from -18 to 4 m east,"),
        (("south", "west", "east"), "from 12 m north on and from -18 to 4 m east,"),
        (("south", "north", "east"), "from 12 to 34 m north and up to 4 m east,"),
        (("south", "west"), "from 12 m north on and from -18 m east on,"),
        (("south", "north"), "from 12 to 34 m north,"),
        (("west",), "from -18 m east on,"),
        ((), "in some of these waters,"),
    ],
)
def test_the_sentence_tells_the_sides_that_are_known(told: tuple[str, ...], where: str) -> None:
    sides = {"south": 12.4, "north": 33.6, "west": -18.2, "east": 4.1}
    says = EFFECT.says({"factor": 1.6, **{name: sides[name] for name in told}}, None)
    assert says == f"Damping is 1.60 times as large {where} as over shallow ground."
