"""A log of another vessel in a campaign, references of another vessel, and logs of one vessel in different winds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.judging import campaign_split
from ferryid.diagnose.judging.campaign_evidence import Gain
from ferryid.diagnose.judging.campaign_split import Split, find_split
from tests.diagnose.inference.test_campaign_estimation import CALM, WINDS, campaign
from tests.diagnose.judging.test_group_differences import groups

pytestmark = pytest.mark.slow

NONE = np.zeros(3, dtype=np.bool_)


def heavy(member: Member, factor: float) -> Member:
    """Return a log as of a vessel on which forces of all actuators are a factor larger."""
    plain = replace(member.plain, parts=factor * member.plain.parts)
    measured = replace(member.windows.measurements, parts=factor * member.windows.measurements.parts)
    return replace(member, windows=replace(member.windows, measurements=measured), plain=plain)


@pytest.mark.parametrize("winds", [WINDS, CALM])
def test_logs_of_one_vessel_stay_together_in_whatever_wind(winds: tuple[tuple[float, float], ...]) -> None:
    assert find_split(campaign(winds), NONE) is None


def test_a_log_of_another_vessel_is_found() -> None:
    split = find_split(campaign(factor=2.0), NONE)
    assert split is not None
    assert split.inside.tolist() == [False, False, True]
    assert split.gain.low > 30.0
    assert split.ratio > 2.5


def test_references_of_another_vessel_are_found() -> None:
    members = campaign().members
    other = tuple(heavy(one, 2.0) for one in members[1:])
    split = find_split(Campaign((*members[:2], *other), campaign().hull), np.array([False, False, True, True]))
    assert split is not None
    assert split.inside.tolist() in ([False, False, True, True], [True, True, False, False])


@pytest.mark.parametrize(("gain", "ratio", "found"), [(676.0, 6.5, True), (676.0, 1.5, False), (50.0, 6.5, False)])
def test_a_hull_that_a_wind_hides_is_judged_beside_the_wind(
    gain: float, ratio: float, found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any wind two hulls are far likelier, and leave nearly as much of the force error, which is the wind's."""
    inside = np.array([False, True, True])
    told = iter(
        [Split(inside, Gain(392.0, 322.0, 460.0), 1.7), Split(inside, Gain(gain, 0.8 * gain, 1.2 * gain), ratio)]
    )
    monkeypatch.setattr(campaign_split, "_judged", lambda made, ways: [next(told)])
    split = find_split(campaign(), NONE)
    assert (split is not None) == found
    if split is not None:
        assert (split.gain.total, split.ratio) == (gain, ratio)


def test_a_thruster_that_weakened_between_logs_is_no_other_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = groups((1.0, 1.0, 0.4), ("", "", ""))
    whole = replace(whole, order=tuple(range(len(whole.members))))
    none = np.zeros(len(whole.members), dtype=np.bool_)
    assert find_split(whole, none) is None
    # Unless the change is found, they are told apart as two vessels.
    monkeypatch.setattr(campaign_split, "find_change", lambda made: None)
    split = find_split(whole, none)
    assert split is not None
    assert split.inside.tolist() == [False] * 4 + [True] * 2
