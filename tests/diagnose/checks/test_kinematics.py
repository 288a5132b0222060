"""Slopes of positions, from which the check of the kinematics begins."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from ferryid.diagnose.checks import kinematics
from ferryid.diagnose.checks.spans import spans_of
from ferryid.types import Floats


@pytest.mark.parametrize("rows", [5, 9])
def test_slopes_are_those_of_savitzky_and_golay(rows: int) -> None:
    values = np.random.default_rng(8).standard_normal((60, 2)).cumsum(axis=0)
    known = savgol_filter(values, rows, 2, deriv=1, axis=0)
    np.testing.assert_allclose(kinematics._slope(values, rows), known, atol=1e-12)


@pytest.mark.parametrize(
    "p", [kinematics.NEUTRAL, np.array([1.2, 0.3, 0.5, -2.0, 0.13, 0.1, -0.2])], ids=["neutral", "all off"]
)
def test_derivatives_are_those_of_the_residual(p: Floats) -> None:
    t, rng = np.arange(0.0, 200.0, 0.1), np.random.default_rng(5)
    velocity = np.column_stack([1.0 + 0.3 * np.sin(t / 9.0), 0.2 * np.cos(t / 5.0)])
    walk = 0.02 * np.cumsum(rng.standard_normal((len(t), 3)), axis=0)
    problem, both = spans_of(0.0, 0.1, np.ones(len(t), dtype=bool), np.hstack([walk, velocity]))
    data = kinematics._Data(problem, both[:, :3], both[:, 3:], both[:, :2])
    derivatives = data.derivatives(p)
    for k, move in enumerate([1e-5, 1e-5, 1e-3, 1e-3, 1e-2, 1e-3, 1e-3]):
        ends = [data.residual(p + sign * move * np.eye(7)[k]) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(derivatives[:, :, k], (ends[0] - ends[1]) / (2.0 * move), atol=1e-7)
