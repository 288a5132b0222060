"""Lasting properties over a campaign: a weak thruster is the vessel's, whatever the bags, and a sound vessel has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.inference import campaign_estimation
from ferryid.diagnose.inference import campaign_properties as selection
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.campaign_properties import (
    ScoredProperty,
    Start,
    TriedProperty,
    properties_of,
    select_properties,
    start_of,
    with_property,
)
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging import campaign as judging
from ferryid.diagnose.judging.campaign import judge_campaign
from ferryid.diagnose.judging.campaign_properties import OutOfStep, PropertyTest, judge_properties
from ferryid.effects import effects
from ferryid.effects.actuator_force import force_limits
from ferryid.effects.effect import HELD
from ferryid.effects.ventilation import drawn
from ferryid.recursive_filter import lagged
from ferryid.signals.feedback import Feedback
from ferryid.types import Floats, no_progress
from tests.diagnose.inference.test_campaign_estimation import CALM, FERRY, campaign

pytestmark = pytest.mark.slow

END = force_limits(FERRY.actuators[0])[0]
"""The largest force of the first thruster [N]."""
BAG_WINDOWS = 7
"""Of eight seconds every two: a bag of twenty seconds."""


def bags(whole: Campaign) -> Campaign:
    """Return a campaign cut into bags of twenty seconds, with as much between two of them."""
    members: list[Member] = []
    for member in whole.members:
        seen = member.windows
        for first in range(0, len(seen.starts) - BAG_WINDOWS, 2 * (BAG_WINDOWS + 3)):
            rows = slice(first, first + BAG_WINDOWS)
            cut = Windows(
                seen.measurements,
                seen.starts[rows],
                ((0, BAG_WINDOWS),),
                seen.weight,
                seen.measured[rows],
                seen.channels,
            )
            members.append(replace(member, windows=cut))
    return replace(whole, members=tuple(members))


@cache
def weakened(factor: float) -> Campaign:
    """Return calm logs whose first thruster gave less than is believed of it, and its part of the force changes."""
    whole = campaign(CALM, conditions=())

    def believed(member: Member) -> Member:
        force = member.plain.parts.sum(axis=1)
        share = (0.5 + 0.4 * np.sin(member.windows.measurements.t / 13.0))[:, None]
        parts = np.stack([share * force / factor, (1.0 - share) * force], axis=1)
        return replace(member, plain=replace(member.plain, parts=parts))

    return replace(whole, members=tuple(believed(member) for member in whole.members))


@pytest.mark.parametrize("cut", [False, True], ids=["three logs", "bags of twenty seconds"])
def test_a_weak_thruster_is_found_over_all_logs(cut: bool) -> None:
    whole = bags(weakened(0.8)) if cut else weakened(0.8)
    places = {str(i): i for i in range(len(whole.members))}
    judged = judge_campaign(whole, places, no_progress)
    assert [one.candidate.key for one in judged.properties if one.confirmed] == [("thruster_gain", "thruster1")]
    (found,) = (one for one in judged.properties if one.confirmed)
    factor = found.estimates["factor"]
    assert factor.value == pytest.approx(0.8, abs=0.03)
    assert factor.low < 0.8 < factor.high
    assert found.gain.low > 0.0
    said = {claim.finding.says for path in places for claim in judged.claims(path)}
    assert len(said) == 1
    assert f"from all {len(places)} logs together" in said.pop()


def test_a_sound_vessel_has_no_property() -> None:
    made, _ = select_properties(estimate_campaign(weakened(1.0)), no_progress)
    assert made.campaign.properties == ()


@pytest.mark.parametrize("conditions", [(), ("wind",)])
def test_a_search_begins_with_what_was_found_of_a_property(
    conditions: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    gain = Candidate.of(effects()["thruster_gain"], "thruster1", FERRY)
    begun = replace(gain, parameters=tuple(replace(one, start=0.7) for one in gain.parameters))
    whole = replace(campaign(CALM, conditions=conditions), properties=(begun,))
    monkeypatch.setattr(campaign_estimation, "ROUNDS", 0)
    monkeypatch.setattr(campaign_estimation, "SEARCHES", 0)
    made = estimate_campaign(whole)
    ((factor,),) = whole.values(made.common, made.own[0])[1]
    assert factor == pytest.approx(0.7)


def test_what_the_evidence_does_not_speak_for_beside_conditions_is_no_hint(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = weakened(0.8)
    places = {str(i): i for i in range(len(whole.members))}
    tested = judging.tested
    monkeypatch.setattr(judging, "tested", lambda *given: replace(tested(*given), evidence=1.0))
    judged = judge_campaign(whole, places, no_progress)
    assert judged.properties == ()
    assert judged.claims("0") == ()
    # Nor does it act unseen in the hull that the logs are compared with.
    assert judged.hull.fit.campaign.properties == ()
    assert judged.force_models("0") is None


def test_what_was_tried_in_a_propertys_place_is_compared_in_its_own_round(monkeypatch: pytest.MonkeyPatch) -> None:
    made = estimate_campaign(weakened(0.8))
    gains = iter([{("thruster_gain", "thruster1"): 50.0, ("thruster_lag", None): 48.0}, {}])
    monkeypatch.setattr(selection, "WEIGHED", 99)
    monkeypatch.setattr(selection, "start_of", lambda made, one: Start(one, with_property(made, one), 99.0))

    def estimated(made: CampaignFit, start: Start) -> ScoredProperty:
        return ScoredProperty(start.candidate, start.begun, gain.get(start.candidate.key, 0.0))

    def left(campaign: Campaign) -> list[Candidate]:
        nonlocal gain
        gain = next(gains)
        return properties_of(campaign)

    gain: dict[tuple[str, str | None], float] = {}
    monkeypatch.setattr(selection, "_estimated", estimated)
    # What is begun and not estimated acts by nothing.
    monkeypatch.setattr(ScoredProperty, "negligible", False)
    monkeypatch.setattr(selection, "properties_of", left)
    _, rivals = select_properties(made, no_progress)
    assert list(rivals) == [("thruster_gain", "thruster1")]
    (first, *_) = sorted(rivals["thruster_gain", "thruster1"], key=lambda one: -one.odds)
    assert (first.candidate.key, first.odds, first.share) == (("thruster_lag", None), -2.0, pytest.approx(0.96))


def test_a_promise_of_what_is_impossible_hides_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    made = estimate_campaign(weakened(0.8))
    # A lag below zero would explain much, and is none.
    promised = {("thruster_lag", None): 200.0, ("thruster_gain", "thruster1"): 45.0}
    kept = {("thruster_gain", "thruster1"): 45.0}

    def start(made: CampaignFit, one: Candidate) -> Start:
        taken = made.campaign.properties
        return Start(one, with_property(made, one), -1.0 if taken else promised.get(one.key, -1.0))

    def estimated(made: CampaignFit, start: Start) -> ScoredProperty:
        return ScoredProperty(start.candidate, start.begun, kept.get(start.candidate.key, 0.0))

    monkeypatch.setattr(selection, "start_of", start)
    monkeypatch.setattr(selection, "_estimated", estimated)
    found, _ = select_properties(made, no_progress)
    assert [one.key for one in found.campaign.properties] == [("thruster_gain", "thruster1")]


def test_a_guessed_hulls_volume_does_not_decide_between_two_thrusters() -> None:
    made = estimate_campaign(weakened(0.8))
    gain, other = (Candidate.of(effects()["thruster_gain"], one, FERRY) for one in ("thruster1", "thruster2"))
    lag = Candidate.of(effects()["thruster_lag"], None, FERRY)
    for known in (True, False):
        fit = replace(made, campaign=replace(made.campaign, hull=replace(made.campaign.hull, known=known)))
        worse = replace(fit, common=fit.common + 0.1)
        less = 0.5 * (worse.cost - fit.cost)
        first, second = ScoredProperty(gain, fit, 50.0), ScoredProperty(other, worse, 55.0)
        # The evidence, as far as it is no guess; else what is left and asked of the hull.
        assert first.over(second) == pytest.approx(-5.0 if known else less)
        assert second.over(first) == pytest.approx(5.0 if known else -less)
        assert less > 0.1
        # Effects with other parameters are weighed by the evidence.
        assert first.over(ScoredProperty(lag, worse, 55.0)) == -5.0


def test_a_factor_on_the_only_actuator_is_one_on_a_guessed_hull() -> None:
    made, _ = select_properties(estimate_campaign(weakened(0.8)), no_progress)
    (gain,) = made.campaign.properties

    def doubt(*, known: bool, actuators: int) -> str:
        profile = replace(FERRY, actuators=FERRY.actuators[:actuators])
        members = tuple(
            replace(one, plain=replace(one.plain, measurements=replace(one.plain.measurements, profile=profile)))
            for one in made.campaign.members
        )
        campaign = replace(made.campaign, members=members, hull=replace(made.campaign.hull, known=known))
        return judging.tested(replace(made, campaign=campaign), gain, ()).doubt

    assert "hull model" in doubt(known=False, actuators=1)
    assert "hull model" not in doubt(known=True, actuators=1)
    assert "hull model" not in doubt(known=False, actuators=2)


def test_scores_rank_as_fits_do() -> None:
    made = estimate_campaign(weakened(0.8))
    scores = {one.key: start_of(made, one).gain for one in properties_of(made.campaign)}
    assert max(scores, key=lambda key: scores[key]) == ("thruster_gain", "thruster1")
    assert scores["thruster_gain", "thruster1"] > 20.0
    assert scores["thruster_lag", None] < 0.5 * scores["thruster_gain", "thruster1"]


@cache
def limited(limit: float) -> Campaign:
    """Return calm logs whose first thruster gave no more than a force [N], and the second what is missing."""
    return given(lambda order, step_s: np.minimum(order, limit))


def given(by: Callable[[Floats, float], Floats]) -> Campaign:
    """Return calm logs whose first thruster gave a force by its order [N] and the time between rows, the second the rest."""
    whole = campaign(CALM, conditions=())

    def believed(member: Member) -> Member:
        plain = member.plain
        force, t = plain.parts.sum(axis=1), member.windows.measurements.t
        order = (0.5 + 0.5 * np.sin(t / 13.0)) * force_limits(FERRY.actuators[0])[0]
        angle, (x, y) = plain.angles[:, 0], FERRY.actuators[0].position_m
        ahead = np.column_stack([np.cos(angle), np.sin(angle), x * np.sin(angle) - y * np.cos(angle)])
        gave = by(order, member.windows.measurements.step_s)[:, None] * ahead
        parts = np.stack([order[:, None] * ahead, force - gave], axis=1)
        seen = replace(member.windows.measurements, parts=parts)
        plain = replace(plain, parts=parts, measurements=seen)
        return replace(member, plain=plain, windows=replace(member.windows, measurements=seen))

    return replace(whole, members=tuple(believed(member) for member in whole.members))


@pytest.mark.parametrize("share", [0.85, 0.6, 0.35])
def test_a_limit_of_a_thrusters_force_is_found_from_where_forces_depend_on_it(share: float) -> None:
    found, rivals = select_properties(estimate_campaign(limited(share * END)), no_progress)
    ((limit, _),) = found.campaign.values(found.common, found.own[0])[1]
    assert [one.key for one in found.campaign.properties] == [("thrust_saturation", "thruster1")]
    assert limit == pytest.approx(share * END, rel=0.03)
    # What only takes off a share of a large force is not as good.
    assert all(one.odds < -5.0 for one in rivals["thrust_saturation", "thruster1"])


def test_shapes_of_a_thrust_curve_that_explain_nearly_as_much_are_unresolved() -> None:
    made, _ = select_properties(estimate_campaign(limited(0.6 * END)), no_progress)
    (found,) = made.campaign.properties
    windows = made.campaign.members[0].windows

    def unresolved(effect: str, instance: str | None, share: float) -> tuple[str, ...]:
        other = Candidate.of(effects()[effect], instance, FERRY)
        return judging.tested(made, found, [TriedProperty(other, -50.0, share)]).finding(windows).unresolved_with

    assert unresolved("ventilation", "thruster1", 0.91) == ("ventilation",)
    assert unresolved("ventilation", "thruster1", 0.89) == ()
    assert unresolved("ventilation", "thruster2", 0.99) == ()
    # A factor is no shape of the curve.
    assert unresolved("thruster_gain", "thruster1", 0.99) == ()


@cache
def aired() -> Campaign:
    """Return calm logs whose first thruster lost half of its force to air above half load, a few seconds late."""
    return given(lambda order, step_s: order * (1.0 - 0.5 * lagged(drawn(100.0 * order / END, 50.0), 4.0, step_s)))


def test_what_adds_nothing_beside_another_leaves_and_is_its_rival() -> None:
    made = estimate_campaign(aired())
    limit, air = (Candidate.of(effects()[one], "thruster1", FERRY) for one in ("thrust_saturation", "ventilation"))

    def estimated(begun: CampaignFit) -> CampaignFit:
        return estimate_campaign(begun.campaign, noise=made.noise, begin=begun)

    def beside_nothing(one: Candidate, other: Candidate) -> CampaignFit:
        """Return the estimate of one beside another that has come to do nothing."""
        return estimated(with_property(estimated(with_property(made, one)), other, share=0.0))

    stays, rivals = selection._without_displaced(beside_nothing(air, limit), {}, ())
    assert stays.campaign.properties == (air,)
    (tried,) = rivals[air.key]
    # Where it stood it did nothing; in the other's place it explains a part of what that does.
    assert tried.candidate == limit
    assert tried.odds < 0.0
    assert 0.2 < tried.share < 1.0
    # What is likelier in the other's place takes it.
    swapped, rivals = selection._without_displaced(beside_nothing(limit, air), {}, ())
    assert swapped.campaign.properties == (air,)
    (left,) = rivals[air.key]
    assert left.candidate == limit
    assert (left.odds, left.share) == pytest.approx((tried.odds, tried.share), rel=0.1)
    assert [one.odds for one in rivals[limit.key]] == [-left.odds]
    # What the selection began with is judged elsewhere.
    both = beside_nothing(air, limit)
    assert selection._without_displaced(both, {}, (limit, air))[0] is both


def test_air_that_gathers_in_time_is_no_limit() -> None:
    found, rivals = select_properties(estimate_campaign(aired()), no_progress)
    assert [one.key for one in found.campaign.properties] == [("ventilation", "thruster1")]
    factor, threshold, memory = found.campaign.values(found.common, found.own[0])[1][0]
    assert (factor, threshold, memory) == pytest.approx((0.5, 50.0, 4.0), rel=0.1)
    limits = [one for one in rivals["ventilation", "thruster1"] if one.candidate.effect.id == "thrust_saturation"]
    assert all(one.odds < -20.0 for one in limits)


def test_what_a_start_promises_is_what_the_estimate_keeps() -> None:
    made = estimate_campaign(limited(0.6 * END))
    made = estimate_campaign(made.campaign, noise=made.noise, begin=made)
    start = start_of(made, Candidate.of(effects()["thrust_saturation"], "thruster1", FERRY))
    kept = estimate_campaign(start.begun.campaign, noise=made.noise, begin=start.begun)
    assert start.gain == pytest.approx(kept.evidence - made.evidence, rel=0.3)


def test_errors_of_the_navigation_that_a_hull_takes_after_need_a_known_one() -> None:
    known = campaign()
    guessed = replace(known, hull=replace(known.hull, known=False))

    def free(whole: Campaign) -> dict[str, set[str]]:
        return {
            one.effect.id: {each.name for each in one.parameters if each.size > HELD}
            for one in properties_of(whole)
            if one.effect.of_sensor
        }

    assert free(known) == {"lever_arm": {"x", "y"}, "heading_bias": {"angle"}}
    assert free(guessed) == {"lever_arm": {"y"}, "heading_bias": {"angle"}}
    assert np.isfinite(start_of(estimate_campaign(known), properties_of(known)[0]).gain)


def test_what_one_log_shows_of_one_actuator_is_weighed_of_that_actuator() -> None:
    whole = campaign(CALM, conditions=())

    def turning(member: Member, *, astern: bool) -> Member:
        seen = member.windows.measurements
        push = 200.0 * np.sin(seen.t / 9.0)
        parts, angles = np.zeros_like(seen.parts), np.zeros_like(seen.angles)
        parts[:, 0, 0] = push if astern else np.abs(push)
        windows = replace(member.windows, measurements=replace(seen, parts=parts, angles=angles))
        return replace(member, windows=windows)

    def asymmetries(*astern: bool) -> list[str | None]:
        members = tuple(turning(one, astern=way) for one, way in zip(whole.members, astern, strict=True))
        every = properties_of(replace(whole, members=members))
        return [one.instance for one in every if one.effect.id == "astern_asymmetry"]

    assert asymmetries(False, False, False) == []
    assert asymmetries(False, True, False) == ["thruster1"]


def test_a_load_may_be_aboard_in_all_logs_where_the_hull_is_known() -> None:
    whole = campaign(CALM, conditions=())
    for known in (True, False):
        members = replace(whole, hull=replace(whole.hull, known=known))
        assert ("payload" in {one.effect.id for one in properties_of(members)}) == known


@cache
def late(seconds: float) -> PropertyTest:
    """Return what speaks for a delay in calm logs whose navigation comes so much later than the forces that are recorded."""
    whole = campaign(CALM, conditions=())

    def recorded(member: Member) -> Member:
        t, parts = member.windows.measurements.t, member.plain.parts
        flat = parts.reshape(len(t), -1)
        early = np.column_stack([np.interp(t + seconds, t, one) for one in flat.T]).reshape(parts.shape)
        return replace(member, plain=replace(member.plain, parts=early))

    begun = replace(whole, members=tuple(recorded(member) for member in whole.members))
    found = judge_properties(estimate_campaign(begun), no_progress)
    (delay,) = (one for one in found if one.candidate.effect.id == "time_delay")
    return delay


def test_a_delay_that_all_logs_share_and_no_controller_makes_needs_no_share_of_the_error() -> None:
    delay = late(0.4)
    assert delay.estimates["seconds"].value == pytest.approx(0.4, abs=0.05)
    assert delay.out_of_step is not None
    assert delay.out_of_step.evidence > INFERENCE.prior_odds
    # Forces that change by the clock tell nothing of the noise.
    assert delay.out_of_step.feedback == Feedback(0.0, 0.0)
    assert delay.beyond_feedback
    small = replace(delay, improvement=np.array([0.0, 0.0, 0.04]))
    assert small.confirmed
    most, scattered = delay.gain.low, delay.out_of_step.evidence
    assert scattered > INFERENCE.prior_odds
    for other in (
        OutOfStep(scattered, Feedback(most, 1.0)),
        OutOfStep(0.9 * INFERENCE.prior_odds, delay.out_of_step.feedback),
        None,
    ):
        doubtful = replace(small, out_of_step=other)
        assert "on no axis does it remove 10 %" in doubtful.doubt
    about_none = replace(delay.estimates["seconds"], low=-0.01)
    assert not replace(small, estimates={"seconds": about_none}).confirmed
    # What removes enough needs none of this to be confirmed, and is beside disturbances what it is here.
    assert replace(delay, out_of_step=None, improvement=np.array([0.0, 0.0, 0.2])).confirmed


def test_only_what_a_controllers_answer_looks_like_is_weighed_against_it() -> None:
    made, _ = select_properties(estimate_campaign(weakened(0.8)), no_progress)
    (gain,) = made.campaign.properties
    assert judging.tested(made, gain, ()).out_of_step is None


def test_two_logs_show_no_scatter_between_logs() -> None:
    whole = campaign(CALM, conditions=())
    lag = Candidate.of(effects()["time_delay"], None, FERRY)
    made = estimate_campaign(replace(whole, members=whole.members[:2], properties=(lag,)))
    found = judging.tested(made, lag, ()).out_of_step
    assert found is not None
    assert found.evidence == -np.inf


def test_what_all_logs_say_of_a_delay_tells_whether_a_controller_could_have_made_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = campaign(CALM, conditions=())
    for feedback, beyond in ((Feedback(0.0, 0.0), True), (Feedback(0.0, np.inf), False)):
        weighed = replace(late(0.4), out_of_step=OutOfStep(0.0, feedback))
        monkeypatch.setattr(judging, "judge_properties", lambda *_, found=weighed: (found,))
        monkeypatch.setattr(judging, "tested", lambda *_, found=weighed: found)
        judged = judge_campaign(whole, {"0": 0, "1": 1, "2": 2}, no_progress)
        assert [claim.figures.beyond_feedback for claim in judged.claims("1")] == [beyond]


def test_a_property_that_nothing_defends_is_told_and_no_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = campaign(CALM, conditions=())
    place = {"0": 0, "1": 1, "2": 2}
    for improvement, dropped in ((np.array([0.0, 0.0, 0.4]), False), (np.array([0.0, 0.0, -0.3]), True)):
        weighed = replace(late(0.4), out_of_step=None, improvement=improvement, evidence=0.5 * INFERENCE.prior_odds)
        monkeypatch.setattr(judging, "judge_properties", lambda *_, found=weighed: (found,))
        judged = judge_campaign(whole, place, no_progress)
        assert (not judged.claims("1")) == dropped
        told = [one for one in judged.notes if one.startswith("Time delay was considered, but dropped: it makes")]
        assert bool(told) == dropped
