"""Several logs, estimated together: the hull is the true one, a log has no part in its own belief, every log has its wind."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference import campaign_estimation
from ferryid.diagnose.inference.campaign import CommonHull, _conditions_of_logs
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import INDUCED, Campaign, HullPrior
from ferryid.diagnose.inference.estimation import Candidate, estimation_problem, fit
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging import campaign_conditions
from ferryid.diagnose.judging.campaign_conditions import ConditionTest, PlaceboTest, judge_conditions, note
from ferryid.diagnose.judging.campaign_evidence import (
    EXCHANGED,
    MIRRORED,
    SHIFTED,
    Gain,
    imitated_share,
    placebos,
    without_conditions,
)
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, hull_of
from ferryid.types import Floats, no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force
from tests.diagnose.judging.test_held_out import sailed

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
WIND, CURRENT = (Candidate(effects()[name], None, effects()[name].parameters_of(FERRY)) for name in ("wind", "current"))
WINDS = ((-2.0, 1.5), (1.5, 2.5), (2.5, -1.0))
CALM = ((0.0, 0.0),) * 3
SPREAD = 0.3 * np.abs(hull_of(FERRY))


@cache
def campaign(
    winds: tuple[tuple[float, float], ...] = WINDS,
    factor: float = 1.0,
    conditions: tuple[str, ...] = ("wind",),
    current: tuple[float, float] = (0.0, 0.0),
) -> Campaign:
    """Return logs in some winds; the last was of a vessel whose forces are a factor larger than thought."""
    members = []
    wrong = hull_of(FERRY) * np.where(np.arange(len(SPREAD)) % 2, 1.15, 0.85)
    for number, wind in enumerate(winds):
        # Each log begins elsewhere in the same forces, so that they are three.
        measurements = sailed(300.0 + 60.0 * number, np.array(wind), current=current)
        rows = slice(300 * number, None)
        measurements = replace(
            measurements,
            t=measurements.t[rows],
            eta=measurements.eta[rows],
            nu_raw=measurements.nu_raw[rows],
            nu=measurements.nu[rows],
            parts=measurements.parts[rows] * (factor if number == 2 else 1.0),
            angles=measurements.angles[rows],
            usable=measurements.usable[rows],
        )
        seen = windows(measurements, *window_lengths(FERRY))
        thin = seen.measurements
        still = wind_force(FERRY.wind, np.zeros((len(thin.t), 2)), thin.psi, thin.nu)  # type: ignore[arg-type]
        chosen = tuple(one for one in (WIND, CURRENT) if one.effect.id in conditions)
        members.append(Member(seen, ForceModel(thin, wrong, thin.parts, thin.angles, still), chosen))
    none = np.zeros(len(INDUCED))
    return Campaign(tuple(members), HullPrior(np.append(wrong, none), np.append(SPREAD, none)))


@cache
def fitted() -> CampaignFit:
    return estimate_campaign(campaign())


def test_every_log_keeps_its_own_wind_beside_the_common_hull() -> None:
    for i, wind in enumerate(WINDS):
        value, covariance = fitted().condition(i, 0)
        assert np.abs(value - wind).max() < 0.35
        assert (np.abs(value - wind) < 3.0 * np.sqrt(np.diag(covariance))).all()


@pytest.mark.parametrize("turned", [0.0, 0.1], ids=["kept responses", "moved one by one"])
def test_slopes_by_the_hull_are_those_of_the_gaps_drag_of_drift_included(turned: float) -> None:
    made = campaign()
    drag = replace(made.hull, spread=np.append(SPREAD, [30.0, 60.0]))
    first = replace(made.members[0], plain=replace(made.members[0].plain, turned=turned))
    made = replace(made, hull=drag, members=(first, *made.members[1:]))
    common, own = 0.1 * np.ones(made.g), np.zeros(made.l)
    slopes = made.hull_slopes(common, np.zeros((3, made.l)))[0]
    for k in made.hull.free.tolist():
        ends = [made.gap(0, common + side * 1e-4 * np.eye(made.g)[k], own) for side in (1.0, -1.0)]
        by_ends = (ends[0] - ends[1]) / 2e-4
        np.testing.assert_allclose(slopes[:, :, k], by_ends, rtol=0.0, atol=0.02 * np.abs(by_ends).max())


def test_a_condition_that_is_rare_needs_more_evidence() -> None:
    made = fitted()
    rare = tuple(replace(one, conditions=(replace(WIND, log_alternatives=3.0),)) for one in made.campaign.members)
    less = replace(made, campaign=replace(made.campaign, members=rare))
    assert made.evidence - less.evidence == pytest.approx(3.0)


def test_the_common_hull_is_nearer_the_true_one_than_it_was_thought() -> None:
    mean, covariance = fitted().belief()
    known = np.sqrt(np.diag(covariance))[: len(SPREAD)] < 0.3 * SPREAD
    assert known[:5].sum() >= 3
    before = np.abs(fitted().campaign.hull.mean[: len(SPREAD)] - hull_of(FERRY))
    after = np.abs(mean[: len(SPREAD)] - hull_of(FERRY))
    assert after[known].sum() < 0.35 * before[known].sum()


def test_a_log_has_no_part_in_what_the_others_say() -> None:
    alone = replace(campaign(), members=campaign().members[:2])
    mean, covariance = fitted().belief(without=2)
    expected, own = estimate_campaign(alone).belief()
    error = np.sqrt(np.diag(own))[: len(SPREAD)]
    assert (np.abs(mean - expected)[: len(SPREAD)] <= error).all()
    told = error > 0.0
    assert np.sqrt(np.diag(covariance))[: len(SPREAD)][told] == pytest.approx(error[told], rel=0.5)
    # The log itself would have told more.
    assert np.linalg.norm(mean - fitted().belief()[0]) > np.linalg.norm(mean - expected)


def test_logs_of_one_hull_agree_and_of_another_do_not() -> None:
    assert fitted().disagreement < 2.0
    assert estimate_campaign(campaign(factor=1.4)).disagreement > 2.0 * fitted().disagreement


def test_a_belief_from_others_brings_the_wind_out_of_one_log() -> None:
    bare = CommonHull(estimate_campaign(campaign()), {"a": 0, "b": 1, "c": 2})
    first = campaign().members[0]
    mean, covariance = bare.fit.belief(without=0)
    plain = replace(first.plain, hull=mean[: len(SPREAD)])
    spread = np.sqrt(np.diag(covariance))[: len(SPREAD)]
    made = fit(estimation_problem(first.windows, plain, spread), [WIND])
    assert made.values[0][:2] == pytest.approx(WINDS[0], abs=0.35)


def test_one_log_more_changes_nothing_where_it_says_nothing() -> None:
    """A log of a few seconds joins without a word about the hull, and takes after the others in its wind."""
    first = campaign().members[0]
    few = replace(first.windows, starts=first.windows.starts[:3], runs=((0, 3),), measured=first.windows.measured[:3])
    more = replace(campaign(), members=(*campaign().members, replace(first, windows=few)))
    made = estimate_campaign(more)
    known = np.sqrt(np.diag(fitted().belief()[1]))
    moved = np.abs(made.belief()[0] - fitted().belief()[0])
    assert (moved <= 0.5 * known).all()
    value, covariance = made.condition(3, 0)
    assert (np.abs(value - WINDS[0]) < 3.0 * np.sqrt(np.diag(covariance))).all()


def test_what_a_placebo_imitates_of_a_wind_that_blew_is_what_it_explains() -> None:
    made = fitted()
    none = estimate_campaign(without_conditions(campaign()), noise=made.noise)
    assert imitated_share(made, none, none, [0, 1]) == pytest.approx(0.0, abs=1e-9)
    assert imitated_share(made, none, made, [0, 1]) == pytest.approx(1.0)
    for placebo in placebos(campaign(), "wind").values():
        other = estimate_campaign(placebo, noise=made.noise)
        share = (other.evidence - none.evidence) / (made.evidence - none.evidence)
        assert imitated_share(made, none, other, [0, 1]) == pytest.approx(share, abs=0.1)


@pytest.mark.parametrize(
    ("share", "imitated", "own"),
    [(0.5, 0.0, True), (0.55, 0.0, False), (0.6, 0.5, True), (0.65, 0.5, False), (0.76, 0.85, False)],
)
def test_a_placebo_may_have_half_or_little_more_than_it_imitates(share: float, imitated: float, own: bool) -> None:
    assert PlaceboTest(Gain(1.0, 0.5, 1.5), 99.0, share, imitated).own is own


def test_a_placebo_is_beaten_where_held_out_data_surely_speak_against_it() -> None:
    assert PlaceboTest(Gain(30.0, 0.1, 60.0), 99.0, 0.0).beaten
    assert not PlaceboTest(Gain(30.0, -25.0, 79.0), 99.0, 0.0).beaten


def test_winds_are_confirmed_over_all_logs_and_a_current_is_not() -> None:
    judged = judge_conditions(campaign(conditions=("wind", "current")), {"a": 0, "b": 1, "c": 2}, no_progress)
    confirmed = [one.effect for one in judged.tests if one.confirmed]
    assert confirmed == ["wind"]
    (wind,) = (one for one in judged.tests if one.confirmed)
    assert wind.gain.low > 0.0
    assert all(one.beaten and one.gain.low > 0.0 for one in wind.placebos.values())
    for path, true in zip("abc", WINDS, strict=True):
        (claim,) = judged.claims(path)
        north, east = (claim.finding.parameters[name] for name in ("north", "east"))
        assert north.low < true[0] < north.high
        assert east.low < true[1] < east.high
        assert claim.finding.probability > 0.9
    assert judged.claims("d") == ()
    assert ": confirmed." in note(wind, {"a": 0, "b": 1, "c": 2})


def test_a_wind_that_a_current_hides_is_confirmed_beside_it() -> None:
    stream = (0.35, -0.25)
    made = campaign(conditions=("wind", "current"), current=stream)
    judged = judge_conditions(made, {"a": 0, "b": 1, "c": 2}, no_progress)
    assert [(one.effect, one.beside) for one in judged.tests if one.confirmed] == [
        ("current", ("wind",)),
        ("wind", ("current",)),
    ]
    # Each log has both as they were: the wind that it would have without a current is another.
    for path, wind in zip("abc", WINDS, strict=True):
        found = {claim.finding.effect: claim.finding.parameters for claim in judged.claims(path)}
        # Neither is an explanation in the other's place.
        assert not any(claim.finding.rivals for claim in judged.claims(path))
        for name, true in (("wind", wind), ("current", stream)):
            assert [found[name][one].value for one in ("north", "east")] == pytest.approx(true, abs=0.05)
    assert "estimated with one hull for all 3 beside a current: confirmed." in note(
        judged.tests[1], {"a": 0, "b": 1, "c": 2}
    )


def test_a_log_that_settled_on_a_wind_from_the_other_side_is_brought_back(monkeypatch: pytest.MonkeyPatch) -> None:
    made = campaign(conditions=("wind", "current"), current=(0.35, -0.25))
    monkeypatch.setattr(campaign_estimation, "SEARCHES", 0)
    settled = estimate_campaign(made)
    monkeypatch.undo()
    found = estimate_campaign(made)
    away = [[np.linalg.norm(one.condition(i, 1)[0] - WINDS[i]) for i in range(3)] for one in (settled, found)]
    assert max(away[0]) > 3.0
    assert max(away[1]) < 0.05


def test_two_conditions_that_are_confirmed_alike_are_hints(monkeypatch: pytest.MonkeyPatch) -> None:
    (wind,) = judge_conditions(campaign(), {"a": 0, "b": 1, "c": 2}, no_progress).tests
    assert wind.confirmed
    behind = {"wind": 0.0}

    def tested(made: Campaign, name: str, *_: object) -> ConditionTest:
        return replace(wind, effect=name, fit=replace(wind.fit, campaign=made), evidence=wind.evidence - behind[name])

    both = campaign(conditions=("wind", "current"))
    monkeypatch.setattr(campaign_conditions, "_tested", tested)
    monkeypatch.setattr(campaign_conditions, "_against_others", lambda one, *_: one)
    # Neither is seen beside the other.
    monkeypatch.setattr(campaign_conditions, "_beside", lambda *_: None)
    behind["current"] = 1.0
    judged = judge_conditions(both, {"a": 0, "b": 1, "c": 2}, no_progress)
    assert [(one.effect, one.unresolved) for one in judged.tests] == [("wind", ("current",)), ("current", ("wind",))]
    assert judged.hull.fit.campaign.conditions == ()
    (claim,) = judged.claims("a")
    assert not claim.finding.sure
    assert claim.finding.unresolved_with == ("current",)
    assert "a current explains about as much" in claim.finding.says
    behind["current"] = 30.0
    judged = judge_conditions(both, {"a": 0, "b": 1, "c": 2}, no_progress)
    assert [(one.effect, one.confirmed) for one in judged.tests] == [("wind", True)]


def test_what_holds_beside_a_condition_that_does_not_hold_beside_it_stays_open(monkeypatch: pytest.MonkeyPatch) -> None:
    (wind,) = judge_conditions(campaign(), {"a": 0, "b": 1, "c": 2}, no_progress).tests
    both = campaign(conditions=("wind", "current"))
    together, stream = estimate_campaign(both), estimate_campaign(campaign(conditions=("current",)))

    def tested(logs: Campaign, name: str, *_: object, **_given: object) -> ConditionTest:
        alone = len(logs.conditions) == 1
        found = replace(wind, effect=name, fit={"wind": wind.fit, "current": stream}[name] if alone else together)
        # A current is confirmed alone, a wind beside it, and the current not beside the wind.
        confirmed = alone if name == "current" else not alone
        return found if confirmed else replace(found, evidence=wind.evidence - 5.0, placebos={})

    monkeypatch.setattr(campaign_conditions, "_tested", tested)
    monkeypatch.setattr(campaign_conditions, "_against_others", lambda one, *_: one)
    judged = judge_conditions(both, {"a": 0, "b": 1, "c": 2}, no_progress)
    assert [(one.effect, one.confirmed, one.beside) for one in judged.tests] == [
        ("current", True, ()),
        ("wind", False, ()),
    ]
    assert [one.effect.id for one in judged.hull.fit.campaign.conditions] == ["current"]
    (claim,) = judged.claims("a")
    # Conditions are weighed against each other by what each explains by itself.
    assert [(one.effect, one.delta_score) for one in claim.finding.rivals] == [("wind", pytest.approx(-5.0))]


def test_references_that_measured_what_a_log_did_not_have_no_conditions() -> None:
    first, second, third = campaign(conditions=("wind", "current")).members
    measured = replace(second, conditions=(CURRENT,))
    kept = _conditions_of_logs([first, measured, third], [False, True, True])
    assert [one.conditions for one in kept] == [first.conditions, (), third.conditions]
    # A log of the campaign keeps what it has.
    assert _conditions_of_logs([first, measured], [False, False]) == [first, measured]
    # References that miss nothing of what logs may have keep theirs.
    assert _conditions_of_logs([measured, third], [False, True]) == [measured, third]


def test_like_headings_make_no_placebo() -> None:
    made = campaign()
    first = made.members[0]
    assert set(placebos(made, "wind")) == {MIRRORED, EXCHANGED, SHIFTED}
    assert set(placebos(made, "wind", (MIRRORED, EXCHANGED))) == {MIRRORED, EXCHANGED}
    # Twice the same manoeuvre: the other log's heading is its own.
    assert set(placebos(replace(made, members=(first, first)), "wind")) == {MIRRORED, SHIFTED}
    eta = first.windows.measurements.eta.copy()
    eta[:, 2] = 0.1
    straight = replace(first, windows=replace(first.windows, measurements=replace(first.windows.measurements, eta=eta)))
    assert placebos(replace(made, members=(straight, straight)), "wind") == {}
    # Two circles the same way round: the other's heading is the log's own, but for an angle; one the other way round is not.
    turning = (0.2 * t for t in (first.windows.measurements.t,) * 2)
    circles = [_headed(first, psi + at) for psi, at in zip(turning, (0.0, 2.0), strict=True)]
    assert set(placebos(replace(made, members=tuple(circles)), "wind", (MIRRORED, EXCHANGED))) == {MIRRORED}
    # Nor is that of a log that turns a whole number of times another half of the log later.
    t = first.windows.measurements.t
    whole = _headed(first, 2.0 * np.pi * 3.0 * t / (t[-1] + t[1] - t[0]))
    assert set(placebos(replace(made, members=(whole, whole)), "wind")) == {MIRRORED}
    other = _headed(first, -0.2 * first.windows.measurements.t)
    turned = placebos(replace(made, members=(circles[0], other)), "wind", (MIRRORED, EXCHANGED))
    assert set(turned) == {MIRRORED, EXCHANGED}


def _headed(member: Member, psi: Floats) -> Member:
    seen = member.windows.measurements
    turned = replace(seen, eta=np.column_stack([seen.eta[:, :2], psi]))
    return replace(member, windows=replace(member.windows, measurements=turned))


def test_without_a_placebo_nothing_is_confirmed_and_nothing_estimated() -> None:
    (wind, *_) = judge_conditions(campaign(), {str(i): i for i in range(3)}, no_progress).tests
    assert wind.confirmed
    bare = replace(wind, placebos={})
    assert bare.doubt == "all logs were on like headings, on which a force of the hull looks the same"
    assert not bare.estimated


def test_a_wind_that_is_estimated_only_has_a_course_and_the_wider_error_of_its_mean() -> None:
    (wind, *_) = judge_conditions(campaign(), {str(i): i for i in range(3)}, no_progress).tests
    hint = replace(wind, gain=Gain(1.0, -1.0, 3.0))
    assert hint.estimated
    assert not hint.confirmed
    assert len(hint.courses) == 3
    steady, course = hint.fit.condition(0, hint.place)[1], hint.courses[0].covariance
    assert (np.diag(course) > np.diag(steady)).all()
    assert (np.diag(hint.condition(0)[1]) >= np.diag(course)).all()
    # What the evidence does not speak for has none.
    assert replace(hint, evidence=1.0).courses == ()


def test_in_calm_logs_nothing_is_confirmed_and_nothing_estimated() -> None:
    judged = judge_conditions(campaign(CALM, conditions=("wind", "current")), {"a": 0, "b": 1, "c": 2}, no_progress)
    assert not any(one.estimated for one in judged.tests)
    assert [judged.claims(path) for path in "abc"] == [(), (), ()]
    assert judged.hull.fit.campaign.conditions == ()


def test_without_conditions_no_log_has_any_of_its_own() -> None:
    bare = without_conditions(campaign())
    assert bare.own == []
    assert estimate_campaign(bare, noise=fitted().noise).evidence < fitted().evidence


@pytest.mark.parametrize(
    ("variances", "told"), [(9.0, "3.0 times as much as the noise"), (0.8, "by no more than the noise")]
)
def test_how_far_logs_disagree_is_said_as_people_think_of_it(variances: float, told: str) -> None:
    hull = cast(CampaignFit, SimpleNamespace(disagreement=variances))
    says = CommonHull(hull, {"a": 0, "b": 1, "c": 2}).says("a")
    assert says.startswith("The hull is that of 2 other logs of the vessel")
    assert told in says
    assert "variance" not in says


def test_conditions_that_hide_each_other_are_confirmed_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither holds by itself, and each does beside the other; where one does not there, none is confirmed."""
    both = campaign(conditions=("wind", "current"))
    fit = estimate_campaign(both)
    held = PlaceboTest(Gain(30.0, 10.0, 60.0), 99.0, 0.0)
    worse = Gain(3.0, -1.0, 7.0)

    def judged(fails: str = "", placebos: dict[str, PlaceboTest] | None = None) -> list[tuple[str, bool, bool]]:
        def tested(one: Campaign, name: str, *_: object, **__: object) -> ConditionTest:
            alone = len(one.conditions) == 1
            gain = worse if alone or name == fails else Gain(30.0, 10.0, 60.0)
            loss = cast(tuple[object, object], (None, None))
            against = {"a": held} if placebos is None else placebos
            return ConditionTest(name, fit, fit, loss, 50.0, gain, against)  # type: ignore[arg-type]

        monkeypatch.setattr(campaign_conditions, "_tested", tested)
        monkeypatch.setattr(campaign_conditions, "_improvement", lambda _: np.zeros(3))
        monkeypatch.setattr(campaign_conditions, "unfelt", lambda _: "")
        found = judge_conditions(both, {"a": 0, "b": 1, "c": 2}, no_progress)
        return [(one.effect, one.confirmed, one.alone is not None) for one in found.tests]

    assert sorted(judged()) == [("current", True, True), ("wind", True, True)]
    assert all(not confirmed for _, confirmed, _ in judged(fails="wind"))
    # Without a placebo by itself it is not tried.
    assert all(not confirmed for _, confirmed, _ in judged(placebos={}))


def test_the_heading_at_other_times_needs_to_do_worse_on_the_whole_only() -> None:
    gain = Gain(30.0, -25.0, 79.0)
    assert PlaceboTest(gain, 99.0, 0.0, surely=False).beaten
    assert not PlaceboTest(Gain(-1.0, -25.0, 20.0), 99.0, 0.0, surely=False).beaten
    assert not PlaceboTest(gain, 0.1, 0.0, surely=False).beaten
