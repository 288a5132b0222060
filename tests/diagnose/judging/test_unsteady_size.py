"""An unsteady disturbance is told with its size against the rest of the log."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.diagnose.judging.locate import Location
from ferryid.diagnose.judging.unexplained import left_over_size


def location(intervals: tuple[tuple[float, float], ...]) -> Location:
    """Return ten windows of which the middle two have 6 N left over in sway, and the others 2 N."""
    middle_s = np.arange(10.0)
    before = np.zeros((10, 3))
    before[:, 1] = np.where((middle_s >= 4.0) & (middle_s <= 5.0), 6.0, -2.0)
    return Location(
        np.array([0.1, 0.8, 0.1]), np.zeros(3), middle_s, before, before, intervals, None, None, (), (), "time"
    )


@pytest.mark.parametrize(
    ("intervals", "told"),
    [
        (((4.0, 5.0),), "6 N RMS left over then, 2 N at other times"),
        ((), "3.2 N RMS left over"),
        (((0.0, 9.0),), "3.2 N RMS left over"),
    ],
)
def test_the_size_is_that_of_the_axis_that_has_most(intervals: tuple[tuple[float, float], ...], told: str) -> None:
    assert left_over_size(location(intervals)) == told
