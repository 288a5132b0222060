"""Slopes of positions, from which the check of the kinematics begins."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from ferryid.diagnose.checks import kinematics


@pytest.mark.parametrize("rows", [5, 9])
def test_slopes_are_those_of_savitzky_and_golay(rows: int) -> None:
    values = np.random.default_rng(8).standard_normal((60, 2)).cumsum(axis=0)
    known = savgol_filter(values, rows, 2, deriv=1, axis=0)
    np.testing.assert_allclose(kinematics._slope(values, rows), known, atol=1e-12)
