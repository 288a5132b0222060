"""The confidence rules: the one ordered list of reasons for which a finding is lowered to a hint, or dropped.

Each rule looks at one finding and its context and returns the finding as it stands then, None where it is dropped, and a note
for the reader (empty where the finding itself tells the reason). `apply_rules` applies them in their order, each to all
findings of a log, so that a rule sees the findings as the rules before it left them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import inf, pi

from ferryid.counts import counted
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.claims import Claim, Figures, Key, LogFigures
from ferryid.diagnose.judging.credibility import worsened
from ferryid.diagnose.judging.experiment_design import HULL_FIRST, fitting, manoeuvre
from ferryid.diagnose.judging.finding import UNKNOWN, Finding
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.wording import IS_A_HINT, listed, titled
from ferryid.types import AXES


@dataclass(frozen=True)
class Context:
    """What a rule knows: the finding's own figures, the log's, and all findings as the rules before it left them."""

    own: Figures
    log: LogFigures = field(default_factory=LogFigures)
    beside: tuple[Claim, ...] = ()


Outcome = tuple[Finding | None, str]


@dataclass(frozen=True)
class ConfidenceRule:
    """One rule.

    Attributes
    ----------
    name, about
        Its name, and what it does in one line.
    threshold, unit
        Where it begins to apply; None where a fact decides and no figure.
    judge
        ``judge(finding, context, threshold)`` returns the finding and a note.
    of_name
        True where it doubts which effect it is that acts, not that predictions with it are better.
    """

    name: str
    about: str
    threshold: float | None
    unit: str
    judge: Callable[[Finding, Context, float], Outcome]
    of_name: bool = False

    def __call__(self, finding: Finding, context: Context) -> Outcome:
        """Return the finding as it stands by this rule, None where it is dropped, and a note."""
        return self.judge(finding, context, 0.0 if self.threshold is None else self.threshold)


def rule(threshold: float | None = None, unit: str = "", *, of_name: bool = False) -> Callable[..., ConfidenceRule]:
    """Make a rule of a function, with its name and the first line of its docstring."""

    def made(judge: Callable[[Finding, Context, float], Outcome]) -> ConfidenceRule:
        about = (judge.__doc__ or "").partition("\n")[0]
        return ConfidenceRule(judge.__name__, about, threshold, unit, judge, of_name)

    return made


def lowered(finding: Finding, *unresolved: str, manoeuvre: str | None = None) -> Finding:
    """Return a finding as a hint, with what it cannot be told from, and what to record to tell."""
    return replace(
        finding,
        probability=min(finding.probability, JUDGING.hint_probability),
        unresolved_with=tuple(dict.fromkeys((*finding.unresolved_with, *unresolved))),
        separating_manoeuvre=manoeuvre or finding.separating_manoeuvre,
    )


def title_of(finding: Finding) -> str:
    """Return the title of a finding's effect, with the thruster that it is one of."""
    if finding.effect == UNKNOWN:
        return "The force without a name"
    known = effects().get(finding.effect)
    return titled(known.title if known else finding.effect.replace("_", " ").capitalize(), finding.instance)


def _because(finding: Finding, why: str) -> Outcome:
    return lowered(finding), f"{title_of(finding)}{IS_A_HINT}{why}."


@rule()
def in_baseline(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Drop a sensor error that the simulation has as well: intervals of all parameters overlap, so nothing differs."""
    other = context.log.baseline_sensors.get(finding.effect)
    if context.own.kind != "sensor" or other is None:
        return finding, ""
    alike = all(
        name in other and mine.low <= other[name].high and other[name].low <= mine.high
        for name, mine in finding.parameters.items()
    )
    return (None if alike else finding), ""


@rule()
def nothing_estimated(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Drop a force of which no parameter is known to differ from its neutral value, the hull's coefficients for one."""
    return (None if context.own.kind == "force" and not finding.parameters else finding), ""


@rule()
def law_of_one_log(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower an empirical law that only one log of a campaign shows."""
    others = context.own.other_logs
    if others is None:
        return finding, ""
    holding = others.holding
    shown = f", and {holding or 'none'} {'does' if holding < 2 else 'do'}" if others.able else ""
    sentence = f"Of {counted(others.count, 'other log')} {others.able or 'none'} could show it at this size"
    if not others.count:
        sentence = "No other log could show it"
    return lowered(replace(finding, says=f"{finding.says} {sentence}{shown}.")), ""


@rule(JUDGING.power_in_velocities, "of the power")
def absent_in_velocities(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower a disturbance of whose power the velocities show less, or none: errors of positions look like a force, too.

    They show it by as much evidence as any effect needs. Where that is more than the positions' own, a navigation that smooths
    may hide its power. It is dropped where velocities show less and exclude by as much evidence that there is more of it in
    them than their noise hides: noise of a sensor is no force. A velocity that lags may be one that was smoothed.
    """
    own = context.own
    powerful = own.power_in_velocities >= threshold or own.gain < own.gain_in_velocities < inf
    if powerful and own.gain_in_velocities > INFERENCE.prior_odds:
        return finding, ""
    passed = _passed_by_lag(finding, context.beside)
    if not powerful and own.loss_in_velocities > INFERENCE.prior_odds and passed >= threshold:
        return None, _error_of_pose(finding)
    says = f"{finding.says} The velocities do not show it: it may be an error of the positions."
    return lowered(replace(finding, says=says)), ""


def _passed_by_lag(finding: Finding, beside: Sequence[Claim]) -> float:
    """Return the share of a disturbance's power that a first-order filter passes which lags as the velocity was found to."""
    peak = finding.parameters.get("peak_frequency")
    lags = [-one.finding.parameters["seconds"].value for one in beside if one.finding.effect == "clock_offset"]
    lag_s = max([0.0, *lags])
    return 1.0 if peak is None else 1.0 / (1.0 + (2.0 * pi * peak.value * lag_s) ** 2)


def _error_of_pose(finding: Finding) -> str:
    """Return that a disturbance in a narrow band is an error of the sensor of the pose, as a sentence."""
    turns = finding.axes.get("yaw", 0.0) >= max(finding.axes.values())
    pose, rate = ("heading", "yaw rate excludes") if turns else ("position", "velocity excludes")
    peak = finding.parameters.get("peak_frequency")
    at = "" if peak is None else f" at {peak.value:.2g} Hz"
    return (
        f"In the {pose} something comes and goes{at} that the {rate}, so that it is noise of the {pose}, and no force."
    )


@rule()
def seen_by_one_sensor(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower a disturbance on an axis of which one sensor alone tells: nothing sets its errors apart from a force."""
    if context.own.kind != "disturbance" or context.own.seen_twice:
        return finding, ""
    return _because(
        finding,
        "pose and velocity come from one sensor on the axis on which it is strongest, whose errors look the same",
    )


@rule()
def nothing_beside_another(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower a disturbance of which nothing is left beside another effect that the log shows, too small for a name."""
    other = context.own.explained_by
    if not other:
        return finding, ""
    title = effects()[other].title.lower()
    why = f"beside a {title} that is too small or too doubtful for a name, nothing is left of it"
    return lowered(finding, other), _because(finding, why)[1]


@rule(JUDGING.claimed_share, "of a finding's improvement")
def improves_no_claimed_axis(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower what improves neither force nor free run, by an interval that excludes zero, on an axis that it claims.

    It claims the axes on which this share of its improvement lies. The score adds up what every channel gains, in errors that
    the noise's autoregression weighs: a little on all of them makes a likelihood on none of which anything is seen to improve.
    Only one above `JUDGING.strong_gain` needs no more.
    """
    own = context.own
    if own.score is None or own.score > JUDGING.strong_gain:
        return finding, ""
    claimed = [axis for axis, share in finding.axes.items() if share >= threshold or not any(finding.axes.values())]
    if any(own.force_low[axis] > 0.0 or own.free_run_low[axis] > 0.0 for axis in claimed):
        return finding, ""
    return _because(
        finding,
        "on the axes that it claims, neither the held-out squared force error nor the free run improves by an interval that "
        "excludes zero",
    )


@rule(INFERENCE.span_blocks, "held-out blocks")
def too_brief(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower what acts for less than this: a fit that is judged on one part of it must have seen another."""
    if not _brief(context.own, threshold):
        return finding, ""
    needed = threshold * context.own.block_s
    return _because(
        finding, f"it acts for {context.own.lasts_s:.0f} s, and held-out data judge nothing below {needed:.0f} s"
    )


def _brief(own: Figures, blocks: float) -> bool:
    return own.lasts_s < blocks * own.block_s


@rule()
def place_visited_once(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower what acts in a place that was visited once, as the effect defines it: something else may have come just then."""
    if not context.own.single_visit:
        return finding, ""
    return _because(
        finding, "the vessel was in that place once, or hardly at all, so that something else may have come then"
    )


@rule(of_name=True)
def regime_of_one_span(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower what an actuator lacks in a span in which it works as at no other time: its curve may be off there.

    See `ferryid.diagnose.judging.onset_evidence.regime_of_span`.
    """
    if not context.own.regime:
        return finding, ""
    return _because(
        finding, f"{context.own.regime}, as nowhere else in the log: its thrust curve there may be what is off"
    )


@rule(JUDGING.least_passing, "times what hull and formulas may be off by in a part of the manoeuvres")
def passes_by_little(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower what both begins and ends within the log and is smaller than this; what is too brief has its own rule."""
    if context.own.passes >= threshold or _brief(context.own, INFERENCE.span_blocks):
        return finding, ""
    return _because(finding, "it comes and goes, by less than hull and formulas may be off in a part of the manoeuvres")


@rule()
def worse_on_an_axis(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower what makes an axis worse, over the log or while it acts, and not others better by far more."""
    if context.own.kind != "force":
        return finding, ""
    why = worsened(context.own.removed) or worsened(finding.improvement)
    return _because(finding, why) if why else (finding, "")


@rule(JUDGING.worse_runs, "of position, heading, speed and yaw rate")
def worse_in_free_runs(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower a force with which free runs err more in as many quantities as this, whatever the force errors say.

    Force errors are means over windows; what is wrong on average over a manoeuvre adds up in a free run.
    """
    if context.own.kind != "force" or len(context.own.worse_runs) < threshold:
        return finding, ""
    return _because(finding, f"free runs err more with it, in {listed(context.own.worse_runs)}")


@rule(JUDGING.worsening, "of the held-out squared force error")
def worse_altogether(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower all forces of a log in which, with all of them, every axis is worse by more than this: one is judged beside all."""
    removed = context.log.removed
    if context.own.kind != "force" or not removed or max(removed.values()) >= -threshold:
        return finding, ""
    return _because(finding, "all findings together make the held-out squared force error larger on every axis")


@rule(JUDGING.least_removed, "of the held-out squared force error", of_name=True)
def removes_little(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower what removes less than this on every axis while it acts: hull and formulas may be as much off.

    Not what is many standard errors away from nothing beside a hull model that holds the hull: how much that removes is a
    matter of how often thrusters are in their dead band, say, and not of what it is.
    """
    removed = context.own.removed
    if not finding.sure or not removed or max(removed.values()) >= threshold:
        return finding, ""
    if context.log.hull_known and not context.log.joint and context.own.deviations >= JUDGING.certain_size:
        return finding, ""
    return _because(
        finding,
        f"on no axis does it remove {100.0 * threshold:.0f} % of the held-out squared force error while it acts",
    )


@rule(of_name=True)
def less_than_is_unexplained(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower what explains less, on every axis, than a force without a name that is left: it may stand in for that force."""
    removed, left = context.own.removed, unexplained_shares(context)
    # Of an error of one, r is removed and h (1 - r) the nameless force's: r is more from h / (1 + h) on.
    if not finding.sure or not removed or not left:
        return finding, ""
    if any(share >= left[axis] / (1.0 + left[axis]) for axis, share in removed.items()):
        return finding, ""
    return _because(
        finding, "a force without a name is left that explains more on every axis, and it may stand in for that"
    )


def unexplained_shares(context: Context) -> dict[str, float]:
    """Return the share of the squared error left that is a nameless force's, by axis; empty where there is none.

    It counts as far as it is more than a hint and as slow as those of the library are: no bursts, and not above
    `JUDGING.slow_below_hz`.
    """
    slow = [
        one.finding
        for one in context.beside
        if one.figures.kind in ("law", "unsteady")
        and one.finding.sure
        and (one.finding.law or one.finding.band_hz is None or one.finding.band_hz[0] < JUDGING.slow_below_hz)
    ]
    # What no law describes may be all that is left; and of a law that all logs of a vessel have, there may be more.
    described = not context.log.joint and all(one.law for one in slow)
    return {axis: max(0.0, *(one.improvement[axis] if described else 1.0 for one in slow)) for axis in AXES if slow}


def _one_log_at_most(log: LogFigures) -> bool:
    """Return whether the hull comes from the log itself and one other at most."""
    return log.hull_logs < JUDGING.campaign_logs


@rule(of_name=True)
def hull_from_this_log(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower forces where the hull is known from nothing but the log that shows them.

    A hull that a campaign's other logs speak for is known as far as forces go, and so is what a disturbance shakes, but not by
    one other log: the two may be off from each other in their manoeuvres, and nothing shows in which. What sets in within the
    log is known by that: no hull changes from one moment to the next. What acts all along is, where it stands out against
    every force that the motion decides.
    """
    if context.own.sets_in or context.own.beyond_hull:
        return finding, ""
    guessed = context.own.kind in ("force", "disturbance") and _one_log_at_most(context.log)
    if context.log.hull_known or not guessed:
        return finding, ""
    return lowered(finding, "hull_parameters", manoeuvre=fitting(HULL_FIRST, context.log.circumstances)), ""


@rule()
def about_nothing_sure(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower a disturbance about a mean that is no sure finding, such as gusts about a wind."""
    if context.own.kind != "disturbance":
        return finding, ""
    about = effects()[finding.effect].about
    shown = [one.finding for one in context.beside if one.figures.kind in ("force", "condition")]
    sure = {"", *(one.effect for one in shown if one.sure)}
    if about in sure or not finding.sure:
        return finding, ""
    return _because(finding, f"the {effects()[about].title.lower()} about which it comes and goes is no sure finding")


@rule(JUDGING.least_cycles, "periods")
def few_cycles(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower a disturbance in a narrow band that lasts for fewer of its periods: that is an event, and no oscillation."""
    if context.own.cycles >= threshold:
        return finding, ""
    return _because(
        finding, f"it lasts for {context.own.cycles:.1f} of its periods, which may be one event of any kind"
    )


@rule()
def with_another_force(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower a disturbance that begins and ends with a force that is sure: it is what that force's formula leaves."""
    if context.own.kind != "disturbance" or len(finding.ends) < 2:
        return finding, ""
    for one in context.beside:
        other = one.finding
        if (
            one.figures.kind == "force"
            and other.sure
            and all(_meet(finding, other, end) for end in ("onset", "offset"))
        ):
            return _because(finding, f"it begins and ends with the {title_of(other).lower()}, whose formula may be off")
    return finding, ""


def _meet(one: Finding, other: Finding, end: str) -> bool:
    """Return whether the intervals of when two findings begin, or end, overlap; False where one of them does not."""
    if end not in one.parameters or end not in other.parameters:
        return False
    mine, its = one.parameters[end], other.parameters[end]
    return mine.low <= its.high and its.low <= mine.high


@rule(JUDGING.drowned_share, "of what moves the vessel")
def noise_drowns_an_axis(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower all findings on forces where the velocity's noise, times damping, is more than this on some axis."""
    drowned = context.own.kind not in ("sensor", "condition", "property") and drowned_axes(context.log, threshold)
    return lowered(finding) if drowned else finding, ""


def drowned_axes(log: LogFigures, threshold: float) -> dict[str, float]:
    """Return the axes on which the velocity's noise drowns the motion, with its share.

    Such an axis spoils the findings on the others, too: a mass or a delay that it asks for belongs to all of them.
    """
    return {axis: share for axis, share in log.velocity_noise.items() if share > threshold}


@rule()
def pose_jumps(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower all findings on forces where a position or heading jumps so often that false samples are among those used."""
    judged = context.own.kind not in ("sensor", "condition", "property")
    return (lowered(finding) if context.log.jumping and judged else finding), ""


@rule(JUDGING.reaction_share, "of the held-out squared force error", of_name=True)
def out_of_step_beside_disturbance(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower a delay or lag beside unmeasured disturbances, unless it removes this much on an axis or no controller answers.

    A controller answers every gust or wave some time after it has moved the vessel, so that force and motion seem to be out of
    step. That explains little of what moves the vessel: what removes most of the error is no such thing. Nor is what gains
    more than the forces tell of the disturbances: see `ferryid.diagnose.inference.feedback`.
    """
    # A property of all logs removes over all of them, and is the same in each.
    removed = finding.improvement if context.own.kind == "property" else context.own.removed
    removes = max(removed.values(), default=0.0)
    known = effects().get(finding.effect)
    out_of_step = known is not None and known.out_of_step
    doubtful = context.log.unsteady and out_of_step and not context.own.beyond_feedback
    if not doubtful or removes >= threshold:
        return finding, ""
    here = context.log.circumstances
    no_gusts = context.log.wind_measured or here.setting in effects()["gusts"].absent_in
    unsteady = "waves" if no_gusts else "gusts"
    return lowered(finding, unsteady, manoeuvre=manoeuvre(finding.effect, (unsteady,), here)), ""


@rule()
def not_credible(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower what cannot be true of the vessel as it is: off the hull, heavier than it carries, at the bound of its search."""
    return _because(finding, context.own.doubt) if context.own.doubt else (finding, "")


@rule()
def beside_incredible_hull(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower what was estimated beside a hull that cannot be the vessel's: each may have made up for the other.

    What shakes a hull is what its equation leaves over: in a log of a campaign, it rests on the hull of all logs, unless it
    stands out against every force that the motion decides.
    """
    log, own = context.log, context.own
    of_all = own.kind in ("condition", "property")
    beside_all = own.kind == "disturbance" and not (own.sets_in or own.beyond_hull)
    doubt = log.common_hull_doubt if of_all else log.hull_doubt or (log.common_hull_doubt if beside_all else "")
    return _because(finding, doubt) if doubt and context.own.kind != "sensor" else (finding, "")


@rule(JUDGING.campaign_share, "of the logs")
def absent_in_other_logs(finding: Finding, context: Context, threshold: float) -> Outcome:
    """Lower a lasting property of the vessel that fewer of its logs show; a condition is a log's own, and a fault an event."""
    campaign = context.log.campaign
    # What all logs were weighed for together needs no count of them.
    pooled = context.own.kind == "property"
    if len(campaign) < JUDGING.campaign_logs or pooled or not finding.sure or not lasting(finding):
        return finding, ""
    if sum(finding.key in shown for shown in campaign) >= threshold * len(campaign):
        return finding, ""
    return _because(
        finding, "a property of the vessel would be in all of its logs, and fewer than half of them show it"
    )


@rule()
def not_of_all_logs(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower a lasting property that single logs show, where all logs together were weighed for it and do not confirm it.

    A hull that is known from these logs only may be off in the manoeuvres of some of them; what sets in is a log's own.
    """
    log = context.log
    weighed = context.own.kind == "force" and lasting(finding) and finding.key in log.weighed
    if not weighed or len(log.campaign) < JUDGING.campaign_logs or not finding.sure:
        return finding, ""
    return _because(finding, "a property of the vessel would be in all of its logs, which together do not confirm it")


@rule()
def begins_as_no_event(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Lower a property or a load of the vessel in a part of one log of a campaign, unless it stands out there as an event.

    A hull that is known from the logs alone is known as far as all manoeuvres go on average. In those of a part of one log it
    may be off, and a force that is weaker there is one way of saying so; see `ferryid.diagnose.judging.onset_evidence`.
    """
    log, known = context.log, effects().get(finding.effect)
    begins = finding.onset_s is not None or finding.offset_s is not None
    # A load is what the hull's masses say too; wind and current are each log's own.
    of_hull = known is not None and (known.vessel or (known.changes_hull and not known.of_log))
    of_vessel = context.own.kind == "force" and of_hull
    if log.hull_known or not log.joint or not of_vessel or not begins or context.own.sets_in:
        return finding, ""
    return _because(
        finding,
        "one log shows it, in a part of it, where a hull that is known from the logs alone may be off in some manoeuvres, and "
        "it does not stand out as an event",
    )


def lasting(finding: Finding) -> bool:
    """Return whether a finding is a property of the vessel throughout a log."""
    known = effects().get(finding.effect)
    return known is not None and known.vessel and finding.onset_s is None and finding.offset_s is None


@rule(of_name=True)
def orders_followed_late(finding: Finding, context: Context, _threshold: float) -> Outcome:
    """Leave a delay after orders without feedback unresolved: thrusters that follow late look like a late navigation."""
    if finding.effect != "time_delay" or not context.log.circumstances.followed_unseen:
        return finding, ""
    seconds = finding.parameters["seconds"].value
    if seconds <= 0.0:
        return finding, ""
    lags = f"The motion lags the actuators' orders by {seconds:.2f} s"
    says = f"{lags}: thrusters follow them late, or the navigation's data are late.{finding.says.partition(' s.')[2]}"
    unresolved = tuple(dict.fromkeys((*finding.unresolved_with, "thruster_lag")))
    return replace(finding, says=says, unresolved_with=unresolved), ""


RULES: tuple[ConfidenceRule, ...] = (
    in_baseline,
    nothing_estimated,
    law_of_one_log,
    absent_in_velocities,
    seen_by_one_sensor,
    nothing_beside_another,
    not_credible,
    beside_incredible_hull,
    improves_no_claimed_axis,
    too_brief,
    place_visited_once,
    regime_of_one_span,
    passes_by_little,
    worse_on_an_axis,
    worse_in_free_runs,
    worse_altogether,
    removes_little,
    less_than_is_unexplained,
    hull_from_this_log,
    about_nothing_sure,
    few_cycles,
    with_another_force,
    noise_drowns_an_axis,
    pose_jumps,
    out_of_step_beside_disturbance,
    absent_in_other_logs,
    not_of_all_logs,
    begins_as_no_event,
    orders_followed_late,
)
"""In the order in which they are applied: what a rule reads of other findings has been settled by those before it."""


def apply_rules(
    claims: Sequence[Claim], log: LogFigures, rules: Sequence[ConfidenceRule] = RULES
) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return findings as they stand by all rules, and the notes, in the order of the rules.

    Parameters
    ----------
    claims
        All findings of a log.
    log
        The log's own figures.
    rules
        In their order.
    """
    beside, notes = tuple(claims), list[str]()
    for one in rules:
        judged = [(claim, *one(claim.finding, Context(claim.figures, log, beside))) for claim in beside]
        notes += [note for _, _, note in judged if note]
        beside = tuple(replace(claim, finding=finding) for claim, finding, _ in judged if finding is not None)
    return tuple(one.finding for one in beside), tuple(notes)


def predictive(claims: Sequence[Claim], log: LogFigures) -> frozenset[Key]:
    """Return the forces whose doubts are about their name alone: predictions with them hold on stretches kept from the fit.

    Parameters
    ----------
    claims, log
        As of `apply_rules`.
    """
    # What else may be in its place decides its probability; either predicts.
    named = [
        replace(one, finding=replace(one.finding, probability=1.0)) if one.figures.kind == "force" else one
        for one in claims
    ]
    findings, _ = apply_rules(named, log, [one for one in RULES if not one.of_name])
    forces = {one.finding.key for one in claims if one.figures.kind == "force"}
    return frozenset(one.key for one in findings if one.sure and one.key in forces)


def log_notes(log: LogFigures) -> list[str]:
    """Return what lowers every finding of a log alike, and what to record instead, as sentences."""
    notes = []
    if not log.hull_known and _one_log_at_most(log):
        fitted_to = "this log and one other" if log.joint else "this log"
        notes.append(
            f"The profile has no hull model, or one of unknown spread: damping and added mass were fitted to {fitted_to} "
            "beside the findings, which can stand in for what a hull model would explain. Take them as hints, of probability "
            f"{JUDGING.hint_probability:g} at most, but for what stands out: what sets in within the log, or what no force "
            "of the motion explains."
        )
    if drowned := drowned_axes(log, noise_drowns_an_axis.threshold or 0.0):
        shares = " and ".join(
            f"{100.0 * share:.0f} % of what moves the vessel in {axis}" for axis, share in drowned.items()
        )
        notes.append(
            f"The noise of the velocity, times damping, is {shares}: all that is found of forces is a hint. "
            "Record larger motions, or a velocity with less noise."
        )
    if log.jumping:
        notes.append(
            f"The {listed(log.jumping)} {'jumps' if len(log.jumping) == 1 else 'jump'} farther than the vessel can move, too "
            "often to leave it out: such jumps look like forces, and all that is found of forces is a hint."
        )
    return notes
