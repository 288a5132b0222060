"""A plan keeps within its area: as it is sailed, with all of the hull."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.identifiability.trial import sailing
from ferryid.planning import PlanSettings, plan
from ferryid.planning.limits import within
from ferryid.simulate.trial import sail
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from ferryid.vessel.dimensions import dimensions


def test_a_hull_is_within_where_all_of_it_is() -> None:
    size = (5.0, 2.0)
    for pose, inside in (
        ((27.5, 0.0, 0.0), True),
        ((27.6, 0.0, 0.0), False),
        ((0.0, -19.0, np.pi), True),
        ((0.0, -17.6, 0.5 * np.pi), False),
        ((0.0, 17.0, 0.25 * np.pi), True),
    ):
        # The longer side is to the north, whichever was named first.
        assert [within(np.array([pose]), area, size) for area in ((60.0, 40.0), (40.0, 60.0))] == [inside, inside]


@pytest.mark.slow
def test_the_planned_trial_is_sailed_within_the_area() -> None:
    # At more than 2 m/s sideways the vessel overshoots its path by metres.
    profile = load_profile("milliampere-2025")
    made = plan(profile, (), PlanSettings(), IN_MEMORY)
    assert made.track is not None
    truth, _ = sail(made.track.scenario, sailing(profile), 1)
    assert within(truth.eta, made.track.area, dimensions(profile)[:2])
