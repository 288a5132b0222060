"""The water over ground: a current that turns, sets in and slackens."""

from __future__ import annotations

import numpy as np

from ferryid.simulate.plant.current import current_series
from ferryid.simulate.sections import Current


def test_a_current_sets_in_and_slackens() -> None:
    always = Current(north_mps=0.3, east_mps=-0.1, turn_degpmin=60.0)
    steady = current_series(always, 9, 0.5)
    passing = current_series(Current(0.3, -0.1, 60.0, from_s=1.0, until_s=3.0), 9, 0.5)
    runs = np.array([False, False, True, True, True, True, False, False, False])
    np.testing.assert_array_equal(passing[runs], steady[runs])
    assert not passing[~runs].any()
    np.testing.assert_allclose(np.hypot(*steady.T), np.hypot(0.3, 0.1))
