"""Two groups of logs of one vessel: a thruster weak in one is named, and nothing else; alike groups differ in nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference import group_differences as inference
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.campaign_properties import properties_of, with_property
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import Comparison, compare_near, differences_of, in_groups
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.group_differences import (
    Difference,
    JudgedGroups,
    _of_regimes,
    judge_groups,
    smallest_note,
    summary,
)
from ferryid.effects import effects
from ferryid.types import no_progress
from ferryid.vessel import load_profile
from tests.diagnose.inference.test_campaign_properties import weakened

pytestmark = pytest.mark.slow

WEAK = ("thruster_gain", "thruster1")


def groups(factors: Sequence[float], names: Sequence[str]) -> Campaign:
    """Return halves of three logs, in whose groups the first thruster gives these parts of its force."""
    members: list[Member] = []
    for i, factor in enumerate(factors):
        member = weakened(factor).members[i]
        seen, middle = member.windows, len(member.windows.starts) // 2
        for rows in (slice(0, middle), slice(middle, None)):
            count = len(seen.starts[rows])
            cut = replace(seen, starts=seen.starts[rows], runs=((0, count),), measured=seen.measured[rows])
            members.append(replace(member, windows=cut))
    of = [name for name in names for _ in range(2)]
    return in_groups(replace(weakened(1.0), members=tuple(members)), of)


def in_group_b(campaign: Campaign) -> Candidate:
    """Return the loss of force of the first thruster in the second group."""
    (found,) = (one for one in differences_of(campaign) if one.key == WEAK and one.group == "B")
    return found


@cache
def judged(factors: tuple[float, ...], known: bool = True) -> JudgedGroups:
    campaign = groups(factors, ("A", "A", "B"))
    return judge_groups(replace(campaign, hull=replace(campaign.hull, known=known)), no_progress)


@pytest.mark.parametrize("known", [True, False], ids=["hull known", "no hull model"])
def test_a_thruster_that_is_weak_in_one_group_is_named_and_nothing_else(known: bool) -> None:
    found = judged((1.0, 1.0, 0.8), known)
    assert [(one.key, one.group, one.doubt) for one in found.differences] == [(WEAK, "B", "")]
    (one,) = found.sure
    factor = one.estimates["factor"]
    assert factor.low < 0.8 < factor.high
    assert factor.value == pytest.approx(0.8, abs=0.03)
    assert one.probability > 0.99
    assert one.gain is not None
    assert one.gain.low > 0.0
    assert found.verdict == "different"
    assert one.says.startswith("Thruster force (thruster1), B relative to A: factor 0.")
    assert "differ" in summary(found)


def test_a_thruster_that_is_weak_in_the_group_named_first_is_the_same_beside_a_hull_that_is_known() -> None:
    """As a gain of the other group it was one of force beyond the thrust curve, and a lag stood in for it."""
    found = judged((0.7, 0.7, 1.0))
    assert [(one.key, one.group, one.doubt) for one in found.differences] == [(WEAK, "A", "")]
    factor = found.sure[0].estimates["factor"]
    assert factor.low < 0.7 < factor.high
    assert found.sure[0].says.startswith("Thruster force (thruster1), A relative to B: factor 0.7")


def test_groups_that_are_alike_differ_in_nothing_and_show_what_would_have_been_seen() -> None:
    found = judged((1.0, 1.0, 1.0))
    assert found.differences == ()
    assert found.verdict == "alike"
    (gain,) = (one for one in found.compared if one.key == WEAK)
    least = gain.smallest["factor"]
    assert least is not None
    assert 0.0 < least < 0.2
    assert gain.estimates["factor"].low < 1.0 < gain.estimates["factor"].high
    assert "Thruster force (thruster1), factor" in smallest_note(found)


def test_what_both_groups_have_is_no_difference() -> None:
    found = judged((0.8, 0.8, 0.8))
    assert found.differences == ()
    # Whichever thruster it is: with a hull that moves, the other one stronger is the same.
    assert {one.effect.id for one in found.shared} == {"thruster_gain"}


def test_logs_of_one_group_that_scatter_make_no_difference() -> None:
    """One log of A is as weak as that of B: what differs is the log, not the group."""
    found = {}
    for factors in ((1.0, 1.0, 1.0), (1.0, 0.8, 0.8)):
        campaign = groups(factors, ("A", "A", "B"))
        weak = in_group_b(campaign)
        found[factors] = compare_near(estimate_campaign(campaign), weak)
    alike, scattered = found.values()
    assert alike.scatter < 0.01
    assert scattered.scatter > 0.1
    # Half of what the logs differ by is no difference of the groups.
    assert scattered.errors[0] > 0.05
    assert scattered.evidence < INFERENCE.prior_odds


def test_two_logs_that_moved_unlike_beside_a_hull_of_their_own_confirm_no_difference() -> None:
    first, second = weakened(1.0).members[:2]
    seen = second.windows.measurements
    fast = replace(
        second, windows=replace(second.windows, measurements=replace(seen, nu=seen.nu + np.array([3.0, 0.0, 0.0])))
    )

    def doubt(other: Member, known: bool, names: Sequence[str] = "AB") -> str:
        campaign = replace(weakened(1.0), members=(first, *[other] * (len(names) - 1)))
        return _of_regimes(in_groups(replace(campaign, hull=replace(campaign.hull, known=known)), names))

    assert "which moved unlike in surge, and may be off" in doubt(fast, known=False)
    # Whichever of them is named first.
    still = replace(second, windows=replace(second.windows, measurements=replace(seen, nu=0.2 * seen.nu)))
    for pair in ((first, still), (still, first)):
        campaign = replace(weakened(1.0), members=pair)
        campaign = in_groups(replace(campaign, hull=replace(campaign.hull, known=False)), "AB")
        assert "which moved unlike in surge, sway and yaw" in _of_regimes(campaign)
    # A hull that is known is so at either speed, and further logs of a group show by how much it scatters.
    assert doubt(fast, known=True) == ""
    assert doubt(fast, known=False, names="ABB") == ""
    assert doubt(first, known=False) == ""


def test_another_shape_of_a_thrust_curve_is_a_difference_beside_that_of_all_logs_only() -> None:
    campaign = groups((1.0, 1.0, 1.0), "ABB")
    curves = {one.id for one in effects().values() if one.of_thrust_curve}
    assert "astern_asymmetry" in curves
    assert not [one for one in differences_of(campaign) if one.effect.id in curves]
    shared = [one for one in properties_of(campaign) if one.effect.id == "astern_asymmetry"][:1]
    found = [one for one in differences_of(replace(campaign, properties=tuple(shared))) if one.effect.id in curves]
    assert {one.key for one in found} == {one.key for one in shared}


def test_a_difference_acts_in_its_group_alone() -> None:
    campaign = groups((1.0, 1.0, 0.8), ("A", "A", "B"))
    weak = in_group_b(campaign)
    acting = replace(campaign, properties=(weak,))
    common, own = np.zeros(acting.g), np.zeros(acting.l)
    # Four fifths, in usual sizes from none.
    common[len(acting.hull.mean)] = (0.8 - 1.0) / weak.parameters[0].size
    moved = [
        not np.array_equal(acting.gap(i, common, own), acting.gap(i, np.zeros(acting.g), own))
        for i in range(len(acting.members))
    ]
    assert moved == [one.group == "B" for one in acting.members]


def test_the_smallest_difference_seen_shrinks_with_more_logs() -> None:
    every = groups((1.0, 1.0, 1.0), ("A", "A", "B"))
    least = []
    for many in (replace(every, members=every.members[::2]), every):
        made = estimate_campaign(many)
        weak = in_group_b(many)
        least.append(float(compare_near(made, weak).smallest[0]))
    assert least[1] < least[0]


def test_of_differences_that_logs_scatter_in_the_likeliest_over_alike_logs_is_selected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = estimate_campaign(groups((1.0, 1.0, 0.8), ("A", "A", "B")))
    # Each has a scatter of its own, over which the second gains less, though it explains far more.
    figures = {("payload", None): (27.0, 97.0), WEAK: (25.0, 171.0)}

    def weighed(fit: CampaignFit, candidate: Candidate, _: CampaignFit | None = None) -> Comparison:
        evidence, over_alike = figures.get(candidate.key, (-1.0, -1.0)) if candidate.group == "B" else (-1.0, -1.0)
        nothing = np.zeros(len(candidate.parameters))
        # Away from neutral on the side that is possible.
        values = np.array([0.5 * (one.low + one.high) for one in candidate.parameters])
        return Comparison(candidate, values, nothing, evidence, over_alike, 0.0, nothing)

    monkeypatch.setattr(inference, "compare_near", weighed)
    monkeypatch.setattr(inference, "compare_estimated", weighed)
    monkeypatch.setattr(inference, "_estimated", with_property)
    monkeypatch.setattr(inference, "INFERENCE", replace(INFERENCE, most_effects=1))
    _, ((first, contenders),) = inference.select_differences(made, no_progress, 3.0)
    assert first.key == WEAK
    assert [(one.candidate.key, one.behind) for one in contenders] == [(("payload", None), -74.0)]


def test_parameters_and_sizes_are_told_in_words_and_plain_numbers() -> None:
    profile = load_profile("milliampere")
    late = Candidate.of(effects()["time_delay"], None, profile)
    delay = Difference.of(late, {"seconds": Estimate(0.1, -0.2, 0.4, "s")}, 0.0, 0.1, {"seconds": None})
    assert delay.said(late.parameters[0]) == "delay +0.10 s (-0.20 to +0.40)"
    assert delay.seen_from("seconds") == "delay not seen at any size"
    load = Candidate.of(effects()["payload"], None, profile)
    laden = Difference.of(load, {}, 0.0, 0.1, {"mass": 112.0})
    assert laden.seen_from("mass") == "mass 110 kg"
