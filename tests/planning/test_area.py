"""A plan keeps within its area: as it is sailed, with all of the hull."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identifiability.trial import sailing
from ferryid.models import blank_model
from ferryid.planning import Plan, PlanSettings, plan
from ferryid.planning.limits import room_of, within
from ferryid.planning.plan import Expected
from ferryid.planning.result import as_text, warning
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


def test_the_room_of_a_path_is_that_of_the_hull() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 20.0, 0.5 * np.pi]])
    # East from 1 m to port of the start to the bow, north from the stern at the start to the bow.
    assert room_of(poses, (5.0, 2.0)) == pytest.approx((23.5, 15.0))


VESSEL = load_profile("milliampere")


@pytest.mark.parametrize(
    ("terms", "why"),
    [
        (("u",), "it was learned as a correction of the profile's hull"),
        ((), "its findings leave the profile's hull"),
    ],
)
def test_a_model_without_a_hull_says_why_it_has_none(terms: tuple[str, ...], why: str) -> None:
    model = replace(blank_model(VESSEL, "ferry"), version=1, terms=terms)
    with pytest.raises(
        FerryIdError, match=rf"ferry@1 has no hull of its own to plan with: {why}. Fix: leave --model out"
    ):
        plan(VESSEL, (), PlanSettings(model=model), IN_MEMORY)


@pytest.mark.parametrize(
    ("planned", "area", "told"),
    [
        (94.0, (15.0, 15.0), ""),
        (96.0, (15.0, 15.0), "hardly better than a zigzag, which takes 36 x 20 m and does not fit into 15 x 15 m"),
        (100.0, (40.0, 15.0), "no better than a zigzag, which takes 36 x 20 m and does not fit into 40 x 15 m"),
        (100.0, (40.0, 25.0), "no better than a zigzag, which takes 36 x 20 m: record that, or give more --minutes."),
        (100.0, None, "no better than a zigzag, which takes 36 x 20 m: record that, or give more --minutes."),
    ],
)
def test_a_plan_that_is_no_better_says_why(planned: float, area: tuple[float, float] | None, told: str) -> None:
    hull = (Expected("m11", "kg", 2000.0, 300.0, 100.0, planned),)
    made = Plan(VESSEL, (), None, 60.0, hull, (), "a zigzag", 4, area=area, usual_area=(36.0, 20.0))
    assert told in warning(made)
    assert bool(told) == bool(warning(made)) == ("This plan is" in as_text(made))
