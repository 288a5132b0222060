"""Between which inertias the truth lies where damping balances the force within the windows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.identify.inertia.span import inertia_spans
from ferryid.regression import CrossProducts, Rows

Floats = NDArray[np.float64]
TERMS = ("r_dot", "r")
MASK = np.array([[False, False, True], [False, False, True]])
BASE = np.diag([1.0, 1.0, 2.0])
INERTIA, DAMPING = 6.0, 12.0
STEP_S, ROWS = 0.1, 20
"""A boat that answers within half a second, in windows of two."""


def windows(unmodelled: float, seed: int = 0) -> tuple[Floats, Floats, Floats]:
    """Return moment, yaw rate and yaw acceleration in windows, of a boat on which another moment acts for seconds."""
    rng = np.random.default_rng(seed)
    moment, other = (np.repeat(rng.standard_normal(800), rows) for rows in (10, 10))
    moment, other = 5.0 * moment, unmodelled * np.roll(other, 4)
    r = np.zeros(len(moment) + 1)
    for k in range(len(moment)):
        settled = (moment[k] + other[k]) / DAMPING
        r[k + 1] = settled + (r[k] - settled) * np.exp(-STEP_S * DAMPING / INERTIA)
    rate = (r[1:] - r[:-1]) / STEP_S
    mean = (moment - INERTIA * rate + other) / DAMPING
    return tuple(one.reshape(-1, ROWS).mean(axis=1) for one in (moment, mean, rate))


def span(moment: Floats, r: Floats, rate: Floats, mask: NDArray[np.bool_] = MASK) -> Floats:
    target = np.zeros((len(moment), 3))
    target[:, 2] = moment - BASE[2, 2] * rate
    sums = CrossProducts.of(Rows.of(np.column_stack([moment, r]), target))
    return inertia_spans(sums, TERMS, mask, BASE)


def test_without_anything_else_both_ends_are_the_inertia() -> None:
    found = span(*windows(0.0))
    assert found[2] == pytest.approx([INERTIA, INERTIA], rel=1e-6)
    assert np.isnan(found[:2]).all()


@pytest.mark.parametrize("seed", range(4))
def test_what_acts_beside_the_force_makes_the_inertia_too_large_and_too_small(seed: int) -> None:
    low, high = span(*windows(3.0, seed))[2]
    assert 0.2 * INERTIA < low < INERTIA
    assert 1.2 * INERTIA < high < 5.0 * INERTIA


def test_ends_are_those_of_two_regressions() -> None:
    moment, r, rate = windows(3.0)
    one = np.ones(len(r))
    forwards = np.linalg.lstsq(np.column_stack([moment, r, one]), rate, rcond=None)[0]
    backwards = np.linalg.lstsq(np.column_stack([rate, r, one]), moment, rcond=None)[0]
    assert span(moment, r, rate)[2] == pytest.approx([backwards[0], 1.0 / forwards[0]], rel=1e-6)


def test_nothing_is_known_where_the_moment_goes_against_the_acceleration_or_the_axis_is_held() -> None:
    moment, r, rate = windows(0.0)
    assert np.isnan(span(-moment, r, rate)).all()
    assert np.isnan(span(moment, r, rate, MASK & [[False], [True]])).all()
