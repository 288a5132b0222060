"""The confidence rules, one by one: what each lowers or drops, what it leaves alone, and on which side of its threshold."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan, nextafter

import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.claims import Claim, Figures, Kind, LogFigures, OtherLogs
from ferryid.diagnose.judging.confidence_rules import (
    RULES,
    ConfidenceRule,
    Context,
    about_nothing_sure,
    absent_in_other_logs,
    absent_in_velocities,
    apply_rules,
    begins_as_no_event,
    beside_incredible_hull,
    few_cycles,
    hull_from_this_log,
    improves_no_claimed_axis,
    in_baseline,
    law_of_one_log,
    less_than_is_unexplained,
    log_notes,
    noise_drowns_an_axis,
    not_of_all_logs,
    nothing_beside_another,
    nothing_estimated,
    orders_followed_late,
    out_of_step_beside_disturbance,
    passes_by_little,
    place_visited_once,
    pose_jumps,
    predictive,
    regime_of_one_span,
    removes_little,
    seen_by_one_sensor,
    too_brief,
    unexplained_shares,
    with_another_force,
    worse_altogether,
    worse_in_free_runs,
    worse_on_an_axis,
)
from ferryid.diagnose.judging.finding import UNKNOWN, Finding, LawTerm
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.vessel.circumstances import Circumstances
from tests.diagnose.judging.findings import found


def stands(rule: ConfidenceRule, finding: Finding, context: Context) -> bool:
    """Return whether a finding is sure by a rule; with a note, which names it, only where it is not."""
    judged, note = rule(finding, context)
    assert judged is not None
    if judged.sure:
        assert (judged, note) == (finding, "")
    else:
        assert judged.probability == JUDGING.hint_probability
    return judged.sure


def on(kind: Kind, **figures: object) -> Context:
    return Context(Figures(kind, **figures))  # type: ignore[arg-type]


def test_every_rule_has_a_name_a_line_and_its_unit() -> None:
    names = [one.name for one in RULES]
    assert len(names) == len(set(names)) == 29
    for one in RULES:
        assert one.about.endswith((".", ":", ",")) or one.about, one.name
        assert (one.threshold is None) == (one.unit == ""), one.name


def test_a_sensor_error_that_the_simulation_has_as_well_is_no_difference() -> None:
    offset = replace(found("clock_offset"), parameters={"seconds": Estimate(0.3, 0.25, 0.35, "s")})
    for low, high, dropped in ((0.3, 0.4, True), (0.36, 0.4, False)):
        log = LogFigures(baseline_sensors={"clock_offset": {"seconds": Estimate(high, low, high, "s")}})
        assert (in_baseline(offset, Context(Figures("sensor"), log))[0] is None) == dropped
    other = LogFigures(baseline_sensors={"lever_arm": offset.parameters})
    assert in_baseline(offset, Context(Figures("sensor"), other)) == (offset, "")


def test_a_force_without_a_parameter_that_is_known_is_dropped() -> None:
    bare = replace(found("hull_parameters"), parameters={})
    assert nothing_estimated(bare, on("force")) == (None, "")
    assert nothing_estimated(found("wind"), on("force"))[0] is not None
    # What has no name has no parameters.
    assert nothing_estimated(replace(bare, effect=UNKNOWN), on("law"))[0] is not None


def test_a_law_that_one_log_of_a_campaign_shows_is_a_hint() -> None:
    law = replace(found(UNKNOWN), parameters={})
    assert law_of_one_log(law, on("law")) == (law, "")
    for others, told in (
        (OtherLogs(0, 0, 0), "No other log could show it."),
        (OtherLogs(2, 2, 0), "Of 2 other logs 2 could show it at this size, and none does."),
        (OtherLogs(2, 2, 1), "Of 2 other logs 2 could show it at this size, and 1 does."),
        (OtherLogs(1, 0, 0), "Of 1 other log none could show it at this size."),
    ):
        judged, note = law_of_one_log(law, on("law", other_logs=others))
        assert judged is not None
        assert (judged.probability, judged.says, note) == (JUDGING.hint_probability, f"It is there. {told}", "")


def test_a_disturbance_that_the_velocities_lack_is_a_hint() -> None:
    least = 0.3
    assert stands(absent_in_velocities, found("waves"), on("disturbance", power_in_velocities=least))
    judged, _ = absent_in_velocities(found("waves"), on("disturbance", power_in_velocities=nextafter(least, 0.0)))
    assert judged is not None
    assert not judged.sure
    assert judged.says == "It is there. The velocities do not show it: it may be an error of the positions."
    odds = INFERENCE.prior_odds
    assert stands(absent_in_velocities, found("waves"), on("disturbance", gain_in_velocities=nextafter(odds, inf)))
    judged, _ = absent_in_velocities(found("waves"), on("disturbance", gain_in_velocities=odds))
    assert judged is not None
    assert not judged.sure


def test_a_disturbance_that_the_velocities_exclude_is_noise_of_the_pose() -> None:
    odds, weak = INFERENCE.prior_odds, nextafter(0.3, 0.0)
    turning = replace(
        found("waves"),
        parameters={"peak_frequency": Estimate(0.4, 0.3, 0.5, "Hz")},
        axes={"surge": 0.0, "sway": 0.2, "yaw": 0.8},
    )
    excluded = on("disturbance", power_in_velocities=weak, loss_in_velocities=nextafter(odds, inf))
    assert absent_in_velocities(turning, excluded) == (
        None,
        "In the heading something comes and goes at 0.4 Hz that the yaw rate excludes, so that it is noise of the heading, "
        "and no force.",
    )
    shoved = replace(turning, parameters={}, axes={"surge": 0.9, "sway": 0.1, "yaw": 0.0})
    assert absent_in_velocities(shoved, excluded)[1].startswith(
        "In the position something comes and goes that the velocity"
    )
    # A velocity that lags by so much may have lost it in its filter; one that is early has not.
    for seconds, hint in ((-0.8, True), (-0.1, False), (0.8, False)):
        late = replace(found("clock_offset"), parameters={"seconds": Estimate(seconds, seconds, seconds, "s")})
        beside = replace(excluded, beside=(Claim(late, Figures("sensor")),))
        assert (absent_in_velocities(turning, beside)[0] is not None) == hint
    # A velocity in whose noise it would not be seen, or that shows as much, excludes nothing.
    for power, loss in ((weak, odds), (0.3, nextafter(odds, inf))):
        judged, _ = absent_in_velocities(
            turning,
            on("disturbance", power_in_velocities=power, gain_in_velocities=0.0, loss_in_velocities=loss),
        )
        assert judged is not None
        assert not judged.sure


def test_a_disturbance_for_which_velocities_speak_more_than_positions_is_in_both() -> None:
    weak = nextafter(0.3, 0.0)
    shown = on("disturbance", power_in_velocities=weak, gain=1600.0, gain_in_velocities=2400.0)
    assert stands(absent_in_velocities, found("waves"), shown)
    for gain, in_velocities in ((2400.0, 2400.0), (2400.0, 1600.0), (1600.0, inf)):
        # Where velocities were not asked, their power decides.
        unlike = on("disturbance", power_in_velocities=weak, gain=gain, gain_in_velocities=in_velocities)
        assert not stands(absent_in_velocities, found("waves"), unlike)


def test_a_disturbance_of_which_nothing_is_left_beside_another_effect_is_a_hint() -> None:
    assert stands(nothing_beside_another, found("gusts"), on("disturbance"))
    judged, note = nothing_beside_another(found("gusts"), on("disturbance", explained_by="time_delay"))
    assert judged is not None
    assert (judged.sure, judged.unresolved_with[-1]) == (False, "time_delay")
    assert note.startswith("Gusts is a hint: beside a time delay that is too small")


def test_a_disturbance_that_one_sensor_shows_is_a_hint() -> None:
    assert stands(seen_by_one_sensor, found("waves"), on("disturbance"))
    assert not stands(seen_by_one_sensor, found("waves"), on("disturbance", seen_twice=False))
    # A steady force moves the vessel farther than a sensor errs.
    assert stands(seen_by_one_sensor, found("wind"), on("force", seen_twice=False))


@pytest.mark.parametrize(
    ("sway", "force", "run", "score", "sure"),
    [
        (0.5, 0.1, -0.1, 20.0, True),
        (0.5, -0.1, 0.1, 20.0, True),
        (0.4, 0.1, -0.1, 20.0, True),
        (0.5, -0.1, -inf, 20.0, False),
        (0.3, 0.1, 0.1, 20.0, False),
        (0.3, 0.1, 0.1, JUDGING.strong_gain, False),
        (0.3, 0.1, 0.1, nextafter(JUDGING.strong_gain, inf), True),
    ],
)
def test_only_an_axis_that_is_claimed_shows_an_improvement(
    sway: float, force: float, run: float, score: float, sure: bool
) -> None:
    one = replace(found("wind"), axes={"surge": 0.0, "sway": sway, "yaw": 1.0 - sway})
    low = {"surge": 0.5, "sway": force, "yaw": -0.1}
    figures = Figures("force", score, low, {"surge": 0.5, "sway": run, "yaw": -0.1})
    assert stands(improves_no_claimed_axis, one, Context(figures)) == sure


def test_what_nothing_was_held_out_for_is_not_asked_to_improve() -> None:
    assert stands(improves_no_claimed_axis, found("wind"), on("force"))


def test_what_acts_for_less_than_two_blocks_is_a_hint() -> None:
    assert stands(too_brief, found("wind"), on("force", lasts_s=80.0, block_s=40.0))
    assert not stands(too_brief, found("wind"), on("force", lasts_s=79.0, block_s=40.0))
    assert stands(too_brief, found("wind"), on("force", block_s=40.0))
    assert too_brief(found("wind"), on("force", lasts_s=30.0, block_s=40.0))[1] == (
        "Steady wind is a hint: it acts for 30 s, and held-out data judge nothing below 80 s."
    )


def test_what_acts_in_a_place_that_was_visited_once_is_a_hint() -> None:
    assert stands(place_visited_once, found("mooring"), on("force"))
    assert not stands(place_visited_once, found("mooring"), on("force", single_visit=True))


def test_what_an_actuator_lacks_in_a_regime_of_one_span_is_a_hint() -> None:
    weak = replace(found("thruster_gain"), instance="left")
    assert stands(regime_of_one_span, weak, on("force"))
    assert regime_of_one_span(weak, on("force", regime="in its span left pushes astern at 2 m/s ahead"))[1] == (
        "Thruster force (left) is a hint: in its span left pushes astern at 2 m/s ahead, as nowhere else in the log: its "
        "thrust curve there may be what is off."
    )


def test_what_comes_and_goes_by_little_is_a_hint() -> None:
    assert stands(passes_by_little, found("wind"), on("force", passes=1.0))
    assert not stands(passes_by_little, found("wind"), on("force", passes=0.99))
    # What is too brief as well has one reason.
    assert stands(passes_by_little, found("wind"), on("force", passes=0.5, lasts_s=30.0, block_s=40.0))


def test_what_makes_an_axis_worse_is_a_hint_and_the_axis_is_named() -> None:
    for removed, improvement, sure in (
        ({"surge": 0.1, "yaw": -0.2}, {"surge": 0.1, "yaw": -0.2}, True),
        ({"surge": 0.3, "yaw": -0.25}, {"surge": 0.3, "yaw": -0.1}, False),
        # Over the whole log, too, as its own figures say it.
        ({"surge": 0.3, "yaw": 0.1}, {"surge": 0.3, "yaw": -0.25}, False),
        # A quarter of one axis's error is two halvings, twice as much as one doubling of another's, and no more is outweighed.
        ({"surge": 0.74, "yaw": -1.0}, {"surge": 0.74, "yaw": -1.0}, False),
        ({"surge": 0.76, "yaw": -1.0}, {"surge": 0.76, "yaw": -1.0}, True),
        ({"surge": 0.99, "sway": 0.99, "yaw": -1.01}, {"surge": 0.99, "sway": 0.99, "yaw": -1.01}, False),
        # Of an axis without an error, and of one that was not judged, nothing is known.
        ({"surge": 1.0, "yaw": -0.25}, {"surge": 1.0, "yaw": -0.25}, False),
        ({"surge": nan, "sway": 0.5, "yaw": 0.0}, {"surge": nan, "sway": 0.5, "yaw": 0.0}, True),
        ({"surge": 0.996, "sway": 0.99, "yaw": -0.84}, {"surge": 0.99, "sway": 0.99, "yaw": -0.03}, True),
    ):
        assert stands(worse_on_an_axis, found("wind", **improvement), on("force", removed=removed)) == sure
    _, note = worse_on_an_axis(found("wind"), on("force", removed={"surge": 0.6, "yaw": -3.33}))
    assert note == "Steady wind is a hint: it makes the held-out squared force error in yaw 333 % larger."
    assert stands(worse_on_an_axis, found(UNKNOWN, yaw=-0.5), on("law"))


def test_a_force_with_which_free_runs_err_more_is_a_hint() -> None:
    every = ("position", "heading", "speed", "yaw rate")
    for count in range(5):
        context = on("force", worse_runs=every[:count])
        assert stands(worse_in_free_runs, found("wind"), context) == (count < 2)
    _, note = worse_in_free_runs(found("wind"), on("force", worse_runs=every[:3]))
    assert note == "Steady wind is a hint: free runs err more with it, in position, heading and speed."
    assert stands(worse_in_free_runs, found(UNKNOWN), on("law", worse_runs=every))


def test_where_all_findings_together_make_every_axis_worse_none_of_them_is_sure() -> None:
    """Figures of a catamaran's log, in which a load was named beside thrusters of a tenth of their force, and one axis less."""
    worse = {"surge": -9.7, "sway": -21.0, "yaw": -15.4}
    for removed, sure in ((worse, False), (worse | {"yaw": -0.2}, True), (worse | {"yaw": -0.21}, False), ({}, True)):
        context = replace(on("force"), log=LogFigures(removed=removed))
        assert stands(worse_altogether, found("payload", surge=0.8), context) == sure
    # A sensor's error is seen by other means.
    assert stands(worse_altogether, found("clock_offset"), replace(on("sensor"), log=LogFigures(removed=worse)))


def test_what_removes_hardly_anything_of_the_error_is_a_hint() -> None:
    assert stands(removes_little, found("wind"), on("force", removed={"surge": -0.2, "sway": 0.1}))
    assert not stands(removes_little, found("wind"), on("force", removed={"surge": -0.2, "sway": 0.09}))
    # Gusts are states of the filter, and remove nothing of the error.
    assert stands(removes_little, found("gusts"), on("disturbance"))
    assert removes_little(found("thruster_gain"), on("force", removed={"yaw": 0.01}))[1] == (
        "Thruster force (thruster1) is a hint: on no axis does it remove 10 % of the held-out squared force error while it "
        "acts."
    )


def test_how_little_is_removed_does_not_matter_of_a_certain_size_beside_a_hull_model() -> None:
    """A dead band of sixteen standard errors removed 9 % of the error in yaw, as thrusters were seldom in it."""
    certain = replace(on("force", removed={"yaw": 0.09}), log=LogFigures(hull_known=True))
    for deviations, sure in ((6.9, False), (7.0, True)):
        context = replace(certain, own=replace(certain.own, deviations=deviations))
        assert stands(removes_little, found("dead_band"), context) == sure
        # What the hull is known from may have made the size.
        for log in (LogFigures(hull_known=False), LogFigures(hull_known=True, joint=True)):
            assert not stands(removes_little, found("dead_band"), replace(context, log=log))


def term() -> LawTerm:
    return LawTerm("sway", "v", Estimate(1.0, 0.5, 1.5, "kg/s"), "")


def beside(kind: Kind, left: Finding, removed: dict[str, float], *, joint: bool = False) -> Context:
    return Context(Figures("force", removed=removed), LogFigures(joint=joint), (Claim(left, Figures(kind)),))


def test_what_explains_less_than_is_left_without_a_name_is_a_hint() -> None:
    nameless, law = found(UNKNOWN), replace(found(UNKNOWN, surge=-0.1, sway=0.0, yaw=0.2), law=(term(),))
    # Of an error of one, 0.5 is removed and all of the rest nameless: as much.
    for removed, sure in (({"sway": 0.5}, True), ({"sway": 0.49}, False)):
        assert stands(less_than_is_unexplained, found("wind"), beside("unsteady", nameless, removed)) == sure
    # A law holds what it removes, and is no stand-in where it does not act.
    for removed, sure in (({"sway": 0.0, "yaw": 0.17}, True), ({"yaw": 0.16}, False), ({"surge": 0.0}, True)):
        assert stands(less_than_is_unexplained, found("wind"), beside("law", law, removed)) == sure
    # In a campaign there may be more than its law.
    assert not stands(less_than_is_unexplained, found("wind"), beside("law", law, {"yaw": 0.17}, joint=True))


def test_bursts_hints_and_what_is_fast_stand_in_for_nothing() -> None:
    nameless = found(UNKNOWN)
    for kind, left in (
        ("bursts", nameless),
        ("unsteady", replace(nameless, probability=JUDGING.hint_probability)),
        ("unsteady", replace(nameless, band_hz=(0.2, 0.4))),
    ):
        assert unexplained_shares(beside(kind, left, {})) == {}  # type: ignore[arg-type]
    slow = beside("unsteady", replace(nameless, band_hz=(0.1, 0.4)), {})
    assert unexplained_shares(slow) == {"surge": 1.0, "sway": 1.0, "yaw": 1.0}


@pytest.mark.parametrize(
    ("kind", "known", "joint", "sure"),
    [
        ("force", True, False, True),
        ("force", False, False, False),
        ("force", False, True, True),
        ("disturbance", False, False, False),
        ("disturbance", False, True, True),
        ("disturbance", True, True, True),
        ("sensor", False, False, True),
    ],
)
def test_a_force_is_a_hint_where_only_the_log_itself_tells_of_the_hull(
    kind: Kind, known: bool, joint: bool, sure: bool
) -> None:
    figures = LogFigures(hull_known=known, joint=joint, hull_logs=3 if joint else 1)
    assert stands(hull_from_this_log, found("wind"), Context(Figures(kind), figures)) == sure
    assert stands(hull_from_this_log, found("wind"), Context(Figures(kind, sets_in=True), figures))
    assert stands(hull_from_this_log, found("wind"), Context(Figures(kind, beyond_hull=True), figures))
    judged, _ = hull_from_this_log(found("wind", 0.2), Context(Figures("force"), LogFigures(hull_known=False)))
    assert judged is not None
    assert judged.probability == 0.2
    assert judged.unresolved_with == ("current", "hull_parameters")
    assert judged.separating_manoeuvre == "a log in calm air and still water, to fit a hull model first"
    tank = LogFigures(hull_known=False, circumstances=Circumstances("tank"))
    judged, _ = hull_from_this_log(found("payload", 0.2), Context(Figures("force"), tank))
    assert judged is not None
    assert judged.separating_manoeuvre == "further logs with the water at rest, to fit a hull model first"
    assert bool(log_notes(figures)) == (not known and not joint)


def test_gusts_about_a_wind_that_is_not_sure_are_a_hint() -> None:
    def context(*beside: Finding) -> Context:
        return Context(Figures("disturbance"), beside=tuple(Claim(one, Figures("force")) for one in beside))

    assert stands(about_nothing_sure, found("gusts"), context(found("wind")))
    assert not stands(about_nothing_sure, found("gusts"), context(found("wind", 0.4)))
    assert not stands(about_nothing_sure, found("gusts"), context())
    assert stands(about_nothing_sure, found("waves"), context())
    assert "steady wind" in about_nothing_sure(found("gusts"), context())[1]


@pytest.mark.parametrize("kind", ["force", "disturbance", "law", "unsteady", "bursts", "sensor"])
def test_where_noise_drowns_an_axis_all_but_sensor_errors_are_hints(kind: Kind) -> None:
    for share, drowned in ((0.15, False), (nextafter(0.15, 1.0), True)):
        figures = LogFigures(velocity_noise={"surge": 0.0, "sway": share})
        sure = stands(noise_drowns_an_axis, found("wind"), Context(Figures(kind), figures))
        assert sure == (not drowned or kind == "sensor")
        assert bool(log_notes(figures)) == drowned


@pytest.mark.parametrize("kind", ["force", "unsteady", "sensor", "condition", "property"])
def test_where_a_pose_jumps_too_often_forces_are_hints(kind: Kind) -> None:
    figures = LogFigures(jumping=("position",))
    assert stands(pose_jumps, found("payload"), Context(Figures(kind), LogFigures()))
    assert stands(pose_jumps, found("payload"), Context(Figures(kind), figures)) == (kind not in ("force", "unsteady"))
    (note,) = log_notes(figures)
    assert note.startswith("The position jumps farther than the vessel can move, too often")


@pytest.mark.parametrize(("effect", "sure"), [("thruster_lag", False), ("time_delay", False), ("payload", True)])
def test_what_a_controllers_answer_looks_like_is_a_hint_beside_gusts(effect: str, sure: bool) -> None:
    def context(yaw: float | None, *, unsteady: bool = True, beyond: bool = False) -> Context:
        removed = {} if yaw is None else {"surge": 0.1, "yaw": yaw}
        return Context(Figures("force", removed=removed, beyond_feedback=beyond), LogFigures(unsteady=unsteady))

    for little in (0.49, None):
        assert stands(out_of_step_beside_disturbance, found(effect), context(little)) == sure
    judged, _ = out_of_step_beside_disturbance(found(effect), context(0.3))
    assert judged is not None
    assert ("gusts" in judged.unresolved_with) != sure
    for setting, wind, beside, how in (
        ("tank", False, "waves", "the water at rest"),
        ("sea", False, "gusts", "calm day"),
        ("", True, "waves", "still water"),
    ):
        where = Circumstances(setting)
        there = replace(context(0.3), log=LogFigures(unsteady=True, wind_measured=wind, circumstances=where))
        lower, _ = out_of_step_beside_disturbance(found(effect), there)
        assert lower is not None
        assert (beside in lower.unresolved_with and how in str(lower.separating_manoeuvre)) != sure
    assert stands(out_of_step_beside_disturbance, found(effect), context(0.5))
    assert stands(out_of_step_beside_disturbance, found(effect), context(0.3, unsteady=False))
    # No controller's answer gains more than the forces tell of the disturbances.
    assert stands(out_of_step_beside_disturbance, found(effect), context(0.3, beyond=True))


@pytest.mark.parametrize(("share", "sure"), [(0.3, False), (0.6, True)])
def test_a_lag_of_all_logs_removes_over_all_of_them(share: float, sure: bool) -> None:
    lag = replace(found("thruster_lag"), improvement={"yaw": share})
    assert stands(out_of_step_beside_disturbance, lag, Context(Figures("property"), LogFigures(unsteady=True))) == sure


@pytest.mark.parametrize(
    ("showing", "logs", "sure"), [(1, 4, False), (2, 4, True), (1, 3, False), (1, 2, True), (1, 1, True)]
)
def test_a_property_of_the_vessel_that_few_logs_show_is_a_hint(showing: int, logs: int, sure: bool) -> None:
    loss = found("thrust_inflow_loss")
    shown = (frozenset({loss.key}),) * showing + (frozenset[tuple[str, str | None]](),) * (logs - showing)
    context = Context(Figures("force"), LogFigures(campaign=shown))
    assert stands(absent_in_other_logs, loss, context) == sure
    # A condition is a log's own, and what begins in a log is an event of it.
    assert stands(absent_in_other_logs, found("wind"), context)
    assert stands(absent_in_other_logs, replace(found("thruster_gain"), onset_s=30.0), context)


@pytest.mark.parametrize(("logs", "weighed", "sure"), [(3, True, False), (2, True, True), (3, False, True)])
def test_what_all_logs_do_not_confirm_is_no_property_of_one(logs: int, weighed: bool, sure: bool) -> None:
    loss = replace(found("thruster_gain"), instance="aft")
    keys = frozenset({loss.key}) if weighed else frozenset({("thruster_gain", "fore")})
    figures = LogFigures(campaign=(frozenset({loss.key}),) * logs, weighed=keys)
    assert stands(not_of_all_logs, loss, Context(Figures("force"), figures)) == sure
    # What all logs say is said with them, what sets in is an event of this log, and a wind is its own.
    assert stands(not_of_all_logs, loss, Context(Figures("property"), figures))
    assert stands(not_of_all_logs, replace(loss, onset_s=30.0), Context(Figures("force"), figures))
    assert stands(not_of_all_logs, found("wind"), Context(Figures("force"), figures))


@pytest.mark.parametrize(("logs", "known", "sure"), [(2, False, False), (3, False, True), (2, True, True)])
def test_a_force_beside_the_hull_of_one_other_log_is_a_hint(logs: int, known: bool, sure: bool) -> None:
    # However many of them are diagnosed: the hull may come from references.
    figures = LogFigures(hull_known=known, joint=True, hull_logs=logs, campaign=(frozenset[tuple[str, str | None]](),))
    assert stands(hull_from_this_log, found("payload"), Context(Figures("force"), figures)) == sure
    # What sets in stands out against any hull, and what all logs share is judged with them.
    assert stands(hull_from_this_log, found("payload"), Context(Figures("force", sets_in=True), figures))
    assert stands(hull_from_this_log, found("payload"), Context(Figures("property"), figures))
    notes = log_notes(figures)
    assert (not notes) == sure
    assert sure or "fitted to this log and one other beside the findings" in notes[0]


@pytest.mark.parametrize("kind", ["disturbance", "condition", "property"])
def test_what_stands_beside_a_hull_of_all_logs_that_cannot_be_is_a_hint(kind: Kind) -> None:
    figures = LogFigures(hull_known=False, joint=True, hull_logs=3, common_hull_doubt="no such hull")
    assert not stands(beside_incredible_hull, found("waves"), Context(Figures(kind), figures))
    assert stands(
        beside_incredible_hull, found("waves"), Context(Figures(kind), replace(figures, common_hull_doubt=""))
    )
    # What sets in within the log, a force of the log and sensors do not rest on that hull.
    assert stands(beside_incredible_hull, found("waves"), Context(Figures("disturbance", sets_in=True), figures))
    assert stands(beside_incredible_hull, found("waves"), Context(Figures("force"), figures))
    assert stands(beside_incredible_hull, found("waves"), Context(Figures("disturbance", beyond_hull=True), figures))
    assert stands(beside_incredible_hull, found("waves"), Context(Figures("sensor"), figures))


def test_a_delay_after_orders_alone_may_be_that_of_thrusters() -> None:
    def late(seconds: float, *, unseen: bool) -> Finding:
        estimate = {"seconds": Estimate(seconds, seconds - 0.03, seconds + 0.03, "s")}
        one = replace(found("time_delay"), parameters=estimate, says="The data lag by 0.19 s. All logs show it.")
        figures = LogFigures(circumstances=Circumstances(followed_unseen=unseen))
        made, note = orders_followed_late(one, Context(Figures("property"), figures))
        assert made is not None
        assert (made.probability, note) == (one.probability, "")
        return made

    unresolved = late(0.19, unseen=True)
    assert unresolved.unresolved_with == ("current", "thruster_lag")
    assert unresolved.says == (
        "The motion lags the actuators' orders by 0.19 s: thrusters follow them late, or the navigation's data are late. All "
        "logs show it."
    )
    # Feedback is of what acted, and nothing moves before it is pushed.
    for other in (late(0.19, unseen=False), late(-0.19, unseen=True)):
        assert other.unresolved_with == ("current",)
        assert other.says == "The data lag by 0.19 s. All logs show it."


def test_a_weak_thruster_in_a_part_of_one_log_is_no_event_where_the_logs_bring_the_hull() -> None:
    weak = replace(found("thruster_gain"), onset_s=6.0)
    joint = LogFigures(hull_known=False, joint=True)
    assert not stands(begins_as_no_event, weak, Context(Figures("force"), joint))
    assert not stands(begins_as_no_event, replace(weak, onset_s=None, offset_s=78.0), Context(Figures("force"), joint))
    assert stands(begins_as_no_event, weak, Context(Figures("force", sets_in=True), joint))
    # Nor is that asked of what all logs share, of conditions, beside a hull that is known, or of one log: it has its own rule.
    assert stands(begins_as_no_event, replace(weak, onset_s=None), Context(Figures("force"), joint))
    assert stands(begins_as_no_event, replace(found("wind"), onset_s=6.0), Context(Figures("force"), joint))
    # A load is masses of the hull, which may be off there.
    loaded = replace(found("payload"), onset_s=248.0, offset_s=424.0)
    assert not stands(begins_as_no_event, loaded, Context(Figures("force"), joint))
    assert stands(begins_as_no_event, loaded, Context(Figures("force", sets_in=True), joint))
    assert stands(begins_as_no_event, weak, Context(Figures("force"), replace(joint, hull_known=True)))
    assert stands(begins_as_no_event, weak, Context(Figures("force"), replace(joint, joint=False)))


def test_a_rule_sees_the_findings_as_those_before_it_left_them() -> None:
    wind, gusts = (
        Claim(found("wind"), Figures("force", removed={"sway": 0.6})),
        Claim(found("gusts"), Figures("disturbance")),
    )
    assert [one.sure for one in apply_rules([gusts, wind], LogFigures())[0]] == [True, True]
    faint = replace(wind, figures=Figures("force", removed={"sway": 0.05}))
    findings, notes = apply_rules([gusts, faint], LogFigures())
    assert [(one.effect, one.sure) for one in findings] == [("gusts", False), ("wind", False)]
    assert [note.partition(" is a hint")[0] for note in notes] == ["Steady wind", "Gusts"]


def test_no_rule_raises_a_probability_and_dropped_findings_are_gone() -> None:
    for probability in (0.0, 0.3, JUDGING.hint_probability, 0.7, 1.0):
        claims = [
            Claim(found("wind", probability), Figures("force", single_visit=True)),
            Claim(replace(found("hull_parameters", probability), parameters={}), Figures("force")),
        ]
        (only,), _ = apply_rules(claims, LogFigures(hull_known=False, velocity_noise={"yaw": 1.0}))
        assert only.effect == "wind"
        assert only.probability == min(probability, JUDGING.hint_probability)


def test_a_hint_for_its_name_alone_predicts() -> None:
    delay, lag, load = (found(one) for one in ("time_delay", "thruster_lag", "payload"))
    claims = [
        Claim(delay, Figures("force", score=50.0)),
        # Not likelier than another in its place: either predicts.
        Claim(replace(lag, probability=0.2), Figures("force", score=50.0)),
        Claim(load, Figures("force", score=50.0, doubt="it weighs more than the vessel")),
        Claim(found("yaw_rate_scale"), Figures("sensor")),
        Claim(found("gusts"), Figures("disturbance")),
    ]
    log = LogFigures(unsteady=True)
    findings, _ = apply_rules(claims, log)
    assert not any(one.sure for one in findings if one.effect in ("time_delay", "thruster_lag", "payload"))
    assert predictive(claims, log) == {("time_delay", None), ("thruster_lag", None)}


def test_a_hint_of_an_axis_that_gets_worse_does_not_predict() -> None:
    worse = Claim(replace(found("time_delay"), improvement={"yaw": -0.5}), Figures("force", score=50.0))
    assert not predictive([worse], LogFigures(unsteady=True))


def test_what_lasts_for_a_few_of_its_periods_is_an_event() -> None:
    assert stands(few_cycles, found("waves"), on("disturbance", cycles=JUDGING.least_cycles))
    assert stands(few_cycles, found("gusts"), on("disturbance"))
    lowered, note = few_cycles(found("waves"), on("disturbance", cycles=2.34))
    assert lowered is not None
    assert not lowered.sure
    assert note == "Waves is a hint: it lasts for 2.3 of its periods, which may be one event of any kind."


def between(effect: str, onset: tuple[float, float], offset: tuple[float, float]) -> Finding:
    ends = {
        name: Estimate(0.5 * (low + high), low, high, "s")
        for name, (low, high) in (("onset", onset), ("offset", offset))
    }
    return replace(found(effect), parameters=ends, onset_s=ends["onset"].value, offset_s=ends["offset"].value)


def test_a_disturbance_that_begins_and_ends_with_a_force_is_what_that_leaves() -> None:
    push = between("external_push", (353.3, 354.1), (531.1, 531.8))

    def judged(waves: Finding, other: Finding) -> bool:
        context = Context(Figures("disturbance"), beside=(Claim(other, Figures("force")),))
        return stands(with_another_force, waves, context)

    same = between("waves", (330.0, 355.0), (528.0, 552.0))
    assert not judged(same, push)
    assert judged(same, replace(push, probability=0.4))
    assert judged(between("waves", (330.0, 355.0), (540.0, 552.0)), push)
    assert judged(found("waves"), push)
    assert stands(with_another_force, push, Context(Figures("force"), beside=(Claim(push, Figures("force")),)))
