"""Conditions of single logs, judged over the campaign: confirmed by held-out data, or estimated only.

A condition such as a wind is confirmed where logs that have one of their own are predicted better on stretches that were held
out, by an interval that excludes zero, where the evidence speaks for it as it must for any effect, and where both speak for it
against the same condition on headings that the vessel did not have. A condition and its placebo have as many parameters each,
so that the difference of their evidence is the logarithm of their odds; it is divided as variances are widened elsewhere. What
a placebo explains as well may be a hull that is guessed from the same logs, and must then be the smaller part, or hardly more
than it imitates of a condition that acts: on few headings, as in logs of a minute, that may be half. What is not confirmed
may still be estimated: it is reported as such.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp
from typing import Any

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.diagnose.data.course import Course
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign import CommonHull
from ferryid.diagnose.inference.campaign_course import estimate_courses
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, bare_campaign, estimate_campaign
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_errors import LogErrors
from ferryid.diagnose.judging.campaign_evidence import (
    EXCHANGED,
    MIRRORED,
    SHIFTED,
    Gain,
    HeldOutLoss,
    held_out_loss,
    imitated_share,
    placebos,
    with_conditions,
    without_conditions,
)
from ferryid.diagnose.judging.claims import Claim, Figures
from ferryid.diagnose.judging.credibility import felt, interval_doubt, unfelt, value_doubt, worsened
from ferryid.diagnose.judging.experiment_design import manoeuvre
from ferryid.diagnose.judging.figure_data import axis_of_errors, error_columns
from ferryid.diagnose.judging.finding import Finding, Rival
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import Parameter
from ferryid.effects.wording import listed, weak_evidence
from ferryid.files import name_of_log
from ferryid.types import AXES, Floats
from ferryid.vessel.circumstances import Circumstances


@dataclass(frozen=True)
class PlaceboTest:
    """A condition against the same one where it cannot be true.

    Attributes
    ----------
    gain
        Held-out log-likelihood over the placebo.
    evidence
        Logarithm of the evidence over the placebo [nat].
    share
        Of the condition's evidence over none, what the placebo has too: where a hull that is guessed from the same logs is off,
        both gain by that. A hull that is known leaves no such part, and it is zero.
    imitated
        What the share would be if the condition were what acts: see `imitated_share`.
    surely
        Whether held-out stretches must favour the condition by an interval that excludes zero, and not only on the whole.
    """

    gain: Gain
    evidence: float
    share: float
    imitated: float = 0.0
    surely: bool = True

    @property
    def own(self) -> bool:
        """True where most of what the condition explains is its own, or all but a little of what a placebo cannot imitate."""
        most = JUDGING.placebo_part
        if self.imitated <= JUDGING.placebo_imitated:
            most = max(most, self.imitated + JUDGING.placebo_excess * (1.0 - self.imitated))
        return self.share <= most

    @property
    def beaten(self) -> bool:
        """True where evidence and held-out data surely speak for the condition, and most of what it explains is its own."""
        odds = self.evidence / INFERENCE.posterior_factor**2
        least = self.gain.low if self.surely else self.gain.total
        return least > 0.0 and odds >= JUDGING.placebo_evidence and self.own


@dataclass(frozen=True)
class ConditionTest:
    """What speaks for a condition over all logs.

    Attributes
    ----------
    effect
        Its id.
    fit, none
        The logs with it and without, under one noise; both with the conditions beside which it is tested.
    loss
        Of held-out blocks, without it and with it.
    evidence
        Logarithm of the evidence over that of no such condition [nat].
    gain
        Held-out log-likelihood over that of no such condition.
    placebos
        Conditions that cannot be true, by the headings that they stand on.
    unresolved
        Other conditions that held-out data confirm as well in its place, and that are hardly less likely.
    outdone
        Other conditions that cannot be true, as they stand on headings that the vessel did not have, and have more evidence.
    alone
        Its evidence over none without the conditions beside which it is tested [nat]; None where there are none.
    """

    effect: str
    fit: CampaignFit
    none: CampaignFit
    loss: tuple[HeldOutLoss, HeldOutLoss]
    evidence: float
    gain: Gain
    placebos: Mapping[str, PlaceboTest]
    unresolved: tuple[str, ...] = ()
    outdone: tuple[str, ...] = ()
    alone: float | None = None

    @property
    def evidence_alone(self) -> float:
        """Evidence over none of it by itself, by which conditions are weighed against each other [nat]."""
        return self.evidence if self.alone is None else self.alone

    @property
    def place(self) -> int:
        """Which of the conditions of `fit` it is."""
        return [one.effect.id for one in self.fit.campaign.conditions].index(self.effect)

    @property
    def rows(self) -> list[int]:
        """Which parameters of a log's own conditions are its."""
        return [j for j, (of, _) in enumerate(self.fit.campaign.own) if of == self.place]

    @property
    def parameters(self) -> list[Parameter]:
        """What every log has of it."""
        return [self.fit.campaign.own[j][1] for j in self.rows]

    @property
    def beside(self) -> tuple[str, ...]:
        """Other conditions that `fit` and `none` have."""
        return tuple(one.effect.id for one in self.fit.campaign.conditions if one.effect.id != self.effect)

    @cached_property
    def courses(self) -> tuple[Course, ...]:
        """Of a flow that is confirmed or estimated and changes within logs, its course in each; empty of others."""
        turbulence = effects()[self.effect].turbulence
        if turbulence is None or not (self.confirmed or self.estimated):
            return ()
        return estimate_courses(self.fit, self.place, turbulence)

    def condition(self, i: int) -> tuple[Floats, Floats]:
        """Return what a log has of it, of a flow with a course its mean, and the covariance, shapes (q,) and (q, q).

        The covariance has in it what hull or instruments may be off anyway, as of any effect.
        """
        if self.courses:
            value, covariance = self.courses[i].mean, self.courses[i].covariance
        else:
            value, covariance = self.fit.condition(i, self.place)
        beyond = 0.5 * effects()[self.effect].negligible
        return value, np.asarray(covariance + beyond**2 * np.eye(len(value)))

    @property
    def confirmed(self) -> bool:
        """True where held-out data confirm it."""
        return self.doubt == ""

    @property
    def estimated(self) -> bool:
        """True where the evidence speaks for it, against placebos too, confirmed or not."""
        against = all(one.own for one in self.placebos.values())
        return self.evidence >= INFERENCE.prior_odds and against and bool(self.placebos) and not self.outdone

    @property
    def doubt(self) -> str:
        """Why it is not confirmed, as the end of a sentence; empty where it is."""
        if self.evidence < INFERENCE.prior_odds:
            return weak_evidence(self.evidence, INFERENCE.prior_odds)
        if self.gain.low <= 0.0:
            return "held-out stretches of the logs are not surely predicted better with it"
        if not self.placebos:
            return "all logs were on like headings, on which a force of the hull looks the same"
        for place, placebo in self.placebos.items():
            if not placebo.beaten:
                return f"one on {place}, which cannot be true, explains about as much"
        if self.outdone:
            return f"a {listed(self.outdone, 'or')}, which cannot be true, explains more"
        if self.unresolved:
            return f"a {listed([effects()[one].title.lower() for one in self.unresolved])} explains about as much"
        improvement = dict(zip(AXES, _improvement(self).tolist(), strict=True))
        return worsened(improvement) or unfelt(self.felt.max(axis=0))

    @cached_property
    def felt(self) -> Floats:
        """How much of the measured acceleration of each log it is, by axis, shape (logs, 3)."""
        campaign = self.fit.campaign
        common, own = self.fit.common.copy(), self.fit.own.copy()
        common[campaign.means][self.rows], own[:, self.rows] = 0.0, 0.0
        return felt(self.fit, common, own)

    def seen(self, i: int) -> float:
        """Return the posterior of what a log has of it outside the contour through none at all."""
        value, covariance = self.condition(i)
        away = value - np.array([one.neutral for one in self.parameters])
        return 1.0 - exp(-0.5 * float(away @ np.linalg.solve(covariance, away)))

    def value_doubt(self, i: int) -> str:
        """Return why what a log has of it is not credible, or not felt, as the end of a sentence; empty where it is."""
        value, covariance = self.condition(i)
        estimates = estimates_of(self.parameters, value, covariance)
        values = {name: one.value for name, one in estimates.items()}
        profile = self.fit.campaign.members[i].plain.measurements.profile
        return (
            value_doubt(effects()[self.effect], self.parameters, values, profile)
            or interval_doubt(self.parameters, estimates, covariance)
            or unfelt(self.felt[i])
        )

    @property
    def probability(self) -> float:
        """Probability over none, by the evidence and the prior odds; a hint's at most where it is not confirmed."""
        away = min(max(self.evidence - INFERENCE.prior_odds, -700.0), 700.0)
        probability = 1.0 / (1.0 + exp(-away))
        return probability if self.confirmed else min(probability, JUDGING.hint_probability)


@dataclass(frozen=True)
class JudgedConditions:
    """The conditions of a campaign.

    Attributes
    ----------
    hull
        The common hull, and of each log the conditions that are confirmed.
    tests
        Every condition that was tested, the likeliest first.
    """

    hull: CommonHull
    tests: tuple[ConditionTest, ...]

    def claims(self, path: str) -> tuple[Claim, ...]:
        """Return the conditions of a log as findings: what is confirmed, else the likeliest that is estimated."""
        i = self.hull.place.get(path)
        if i is None:
            return ()
        shown = [one for one in self.tests if one.confirmed] or [one for one in self.tests[:1] if one.estimated]
        found = [(one, _finding(one, i, self.tests)) for one in shown]
        return tuple(
            Claim(said, Figures("condition", doubt=one.value_doubt(i))) for one, said in found if said is not None
        )


def judge_conditions(
    campaign: Campaign, place: Mapping[str, int], progress: Callable[[str], None], bare: CampaignFit | None = None
) -> JudgedConditions:
    """Judge every condition that the logs may have, and return the hull with those that are confirmed.

    `bare` is the estimate of the hull alone, from which every search begins; it is made where None.
    """
    bare = estimate_campaign(bare_campaign(campaign)) if bare is None else bare
    names = sorted({one.effect.id for one in campaign.conditions})
    tests = []
    for name in names:
        progress(f"estimating one hull and a {effects()[name].title.lower()} of every log")
        tests.append(_tested(with_conditions(campaign, frozenset([name])), name, progress, bare))
    tests = [_against_others(one, campaign, progress, bare) if one.confirmed or one.estimated else one for one in tests]
    tests.sort(key=lambda one: -one.evidence)
    confirmed = [one for one in tests if one.confirmed]
    if not confirmed:
        pair = _hidden_by_each_other(campaign, tests, progress, bare)
        if pair:
            return JudgedConditions(CommonHull(pair[0].fit, place), pair)
        progress("estimating one hull for all logs")
        return JudgedConditions(CommonHull(estimate_campaign(without_conditions(campaign)), place), tuple(tests))
    best = confirmed[0]
    kept, fit, beside = [best], best.fit, dict[str, ConditionTest]()
    for other in [one for one in tests if one is not best]:
        both = with_conditions(campaign, frozenset(one.effect for one in (*kept, other)))
        if other.confirmed:
            # It must be seen beside the first, which it may have stood in for.
            made = _beside(fit, both, bare)
        else:
            # The first may have hidden it: what a condition leaves to explain looks like another one turned round.
            progress(f"estimating a {effects()[other.effect].title.lower()} of every log beside what is confirmed")
            seen = _against_others(_tested(both, other.effect, progress, bare), campaign, progress, bare)
            made, beside[other.effect] = (seen.fit if seen.confirmed else None), replace(seen, alone=other.evidence)
        if made is not None:
            kept, fit = [*kept, other], made
    if len(kept) > 1:
        # What is told of each is what it is beside the others, and each must hold there.
        done = {one.effect: one for one in beside.values() if one.fit is fit}
        together = {
            one.effect: done[one.effect]
            if one.effect in done
            else replace(_tested(fit.campaign, one.effect, progress, bare, made=fit), alone=one.evidence)
            for one in kept
        }
        if all(one.confirmed for one in together.values()):
            left = [one for one in tests if one.effect in together or not one.confirmed]
            told = tuple(together.get(one.effect, beside.get(one.effect, one)) for one in left)
            return JudgedConditions(CommonHull(fit, place), told)
    near = [one for one in confirmed[1:] if best.evidence - one.evidence < JUDGING.unresolved_evidence]
    if near:
        # Either is confirmed and not both: which of them acts is not known, and the hull is better without a wrong one.
        names = [best.effect, *(one.effect for one in near)]
        open_ = {name: tuple(other for other in names if other != name) for name in names}
        tests = [replace(one, unresolved=open_.get(one.effect, ())) for one in tests]
        return JudgedConditions(CommonHull(estimate_campaign(without_conditions(campaign)), place), tuple(tests))
    left = [one for one in tests if one is best or not one.confirmed]
    # What holds beside the best, which does not hold beside it, is as open as it is by itself.
    seen_beside = {effect: one for effect, one in beside.items() if not one.confirmed}
    return JudgedConditions(CommonHull(best.fit, place), tuple(seen_beside.get(one.effect, one) for one in left))


def _hidden_by_each_other(
    campaign: Campaign, tests: Sequence[ConditionTest], progress: Callable[[str], None], bare: CampaignFit
) -> tuple[ConditionTest, ...]:
    """Return the tests of conditions beside each other where all hold there, though none does by itself; else none.

    What one leaves to explain may make an axis worse with the other alone, while the evidence speaks for either.
    """
    likely = [one for one in tests if one.evidence >= INFERENCE.prior_odds and one.placebos]
    if len(likely) < 2:
        return ()
    progress("estimating conditions beside each other that do not hold by themselves")
    fit = estimate_campaign(with_conditions(campaign, frozenset(one.effect for one in likely)), bare=bare)
    found = []
    for one in likely:
        test = _tested(fit.campaign, one.effect, progress, bare, made=fit)
        if not test.confirmed:
            return ()
        found.append(replace(test, alone=one.evidence))
    return tuple(found)


def _beside(fit: CampaignFit, both: Campaign, bare: CampaignFit) -> CampaignFit | None:
    """Return the logs with one more condition than a fit has; None where that is not seen beside what it has."""
    made = estimate_campaign(both, bare=bare)
    alone = estimate_campaign(fit.campaign, noise=made.noise, bare=bare)
    gain = Gain.of(held_out_loss(made).gain(held_out_loss(alone)))
    return made if made.evidence - alone.evidence >= INFERENCE.prior_odds and gain.low > 0.0 else None


def _tested(
    campaign: Campaign,
    effect: str,
    progress: Callable[[str], None],
    bare: CampaignFit,
    *,
    made: CampaignFit | None = None,
) -> ConditionTest:
    """Test a condition beside the others that the logs of a campaign have; `made` is the estimate with it, if there is one."""
    made = estimate_campaign(campaign, bare=bare) if made is None else made
    others = frozenset(one.effect.id for one in campaign.conditions) - {effect}
    none = estimate_campaign(with_conditions(campaign, others), noise=made.noise, bare=bare)
    evidence = made.evidence - none.evidence
    loss = held_out_loss(none), held_out_loss(made)
    test = ConditionTest(effect, made, none, loss, evidence, Gain.of(loss[1].gain(loss[0])), {})
    # What the evidence does not speak for needs no placebo to fall.
    if evidence < INFERENCE.prior_odds:
        return test
    progress("estimating the same on headings that the vessel did not have")
    return replace(test, placebos=_against_placebos(test, bare))


def _against_placebos(test: ConditionTest, bare: CampaignFit) -> dict[str, PlaceboTest]:
    """Return how a condition does against the same one on headings that the vessel did not have, by what these are."""
    made, none = test.fit, test.none
    gains = test.loss[1].gain(test.loss[0])
    against: dict[str, PlaceboTest] = {}
    for name, placebo in placebos(made.campaign, test.effect).items():
        other = estimate_campaign(placebo, noise=made.noise, bare=bare)
        over = gains - held_out_loss(other).gain(test.loss[0])
        share, like = 0.0, 0.0
        if not made.campaign.hull.known:
            share = (other.evidence - none.evidence) / test.evidence
            like = imitated_share(made, none, other, test.rows)
        # Of three placebos that all must do worse beyond chance, one would too often not.
        surely = name != SHIFTED
        against[name] = PlaceboTest(Gain.of(over), made.evidence - other.evidence, share, like, surely)
    return against


def _against_others(
    test: ConditionTest, campaign: Campaign, progress: Callable[[str], None], bare: CampaignFit
) -> ConditionTest:
    """Return a test with the other conditions that explain more where they cannot be true.

    What a condition leaves to explain, a force that no condition is, may look like another one turned round.
    """
    outdone = []
    for name in sorted({one.effect.id for one in campaign.conditions} - {test.effect, *test.beside}):
        title = effects()[name].title.lower()
        progress(f"estimating a {title} on headings that the vessel did not have")
        instead = with_conditions(campaign, frozenset([name, *test.beside]))
        for where, placebo in placebos(instead, name, (MIRRORED, EXCHANGED)).items():
            if estimate_campaign(placebo, noise=test.fit.noise, bare=bare).evidence > test.fit.evidence:
                outdone.append(f"{title} on {where}")
    return replace(test, outdone=tuple(outdone))


def _finding(test: ConditionTest, i: int, tests: tuple[ConditionTest, ...]) -> Finding | None:
    """Return what a log has of a condition; None where the log cannot distinguish it from none."""
    fit = test.fit
    if not any(one.effect.id == test.effect for one in fit.campaign.members[i].conditions):
        return None
    value, covariance = test.condition(i)
    parameters = test.parameters
    seen = test.seen(i)
    if seen <= JUDGING.hint_probability:
        return None
    estimates = estimates_of(parameters, value, covariance)
    errors = LogErrors.of(fit, test.loss, i)
    improvement = errors.removed
    gained = np.maximum(improvement, 0.0)
    shares = gained / gained.sum() if gained.any() else np.zeros(3)
    effect = effects()[test.effect]
    says = effect.says({name: one.value for name, one in estimates.items()}, None)
    if not test.confirmed:
        says = f"{says} It is estimated from all logs together, not confirmed: {test.doubt}."
    t = errors.windows.measurements.t
    return Finding(
        effect=test.effect,
        instance=None,
        probability=min(seen, test.probability),
        parameters=estimates,
        axes=dict(zip(AXES, shares.tolist(), strict=True)),
        intervals=((float(t[0]), float(t[-1])),),
        improvement=dict(zip(AXES, improvement.tolist(), strict=True)),
        mse=errors.mse,
        held_out=True,
        rivals=tuple(
            Rival(one.effect, None, one.evidence_alone - test.evidence_alone)
            for one in tests
            if one.effect not in (test.effect, *test.beside)
        ),
        unresolved_with=test.unresolved,
        separating_manoeuvre=manoeuvre(
            test.effect, test.unresolved, Circumstances.of(errors.windows.measurements.profile)
        ),
        says=says,
        course=test.courses[i] if test.courses else None,
        **_figure(test, i, errors, shares, value),
    )


def estimates_of(parameters: Sequence[Parameter], value: Floats, covariance: Floats) -> dict[str, Estimate]:
    """Return what a log has of a condition by name, with its 95 % intervals."""
    error = np.sqrt(np.diag(covariance))
    return {
        one.name: Estimate.normal(float(at), float(e), one.unit)
        for one, at, e in zip(parameters, value, error, strict=True)
    }


def _figure(test: ConditionTest, i: int, errors: LogErrors, shares: Floats, value: Floats) -> dict[str, Any]:
    """Return the columns of the figure of a log's condition: held-out errors against what gives it away."""
    condition = test.fit.campaign.conditions[test.place]
    axis = axis_of_errors(errors.before, errors.after, shares)
    regressor = condition.effect.regressor
    known = None if regressor is None else regressor(test.none.force_model(i), value, None, AXES[axis])
    return error_columns(errors.windows, (errors.before, errors.after), axis, known)


def _improvement(test: ConditionTest) -> Floats:
    """Return the share of the held-out squared force error of all logs that a condition removes, by axis, shape (3,)."""
    every = [LogErrors.of(test.fit, test.loss, i) for i in range(len(test.fit.campaign.members))]
    before, after = (
        np.sum([np.sum(one**2, axis=0) for one in errors], axis=0)
        for errors in ([one.before for one in every], [one.after for one in every])
    )
    return np.asarray(1.0 - after / np.where(before > 0.0, before, np.inf))


def note(test: ConditionTest, place: Mapping[str, int]) -> str:
    """Return what was tested, in sentences; `place` is which of the logs of the fit each path is."""
    logs = len(place)
    title, found = effects()[test.effect].title, _confirmed_in(test) if test.confirmed else "not confirmed"
    have = len(_logs_with(test))
    whose = "each log" if have == logs else f"{have} of {counted(logs, 'log')}"
    others = [f"a {effects()[one].title.lower()}" for one in test.beside]
    beside = f" beside {listed(others)}" if others else ""
    told = (
        f"{title} of {whose}, estimated with one hull for all {logs}{beside}: {found}. "
        f"Over none, evidence {test.evidence:+.0f} nat, likelihood of held-out stretches {_range(test.gain)}"
    )
    for where, one in test.placebos.items():
        told += f"; over one on {where}, evidence {one.evidence:+.0f} nat, held out {_range(one.gain)}"
    return f"{told}.{_where_worse(test, place)}"


def _confirmed_in(test: ConditionTest) -> str:
    """Return in how many logs a condition that is confirmed over all of them is a finding, and in how many a hint, and why."""
    seen = [i for i in _logs_with(test) if test.seen(i) > JUDGING.hint_probability]
    doubts = [doubt for i in seen if (doubt := test.value_doubt(i))]
    sure = len(seen) - len(doubts)
    if sure and not doubts:
        return "confirmed"
    hints = f"a hint in {counted(len(doubts), 'log')}, as {listed(list(dict.fromkeys(doubts)), 'or')}" if doubts else ""
    if sure:
        return f"confirmed in {counted(sure, 'log')}, {hints}"
    alone = hints or "no log distinguishes it from none"
    return f"held-out stretches of all logs together are predicted better with it, but it is confirmed in none: {alone}"


def _logs_with(test: ConditionTest) -> list[int]:
    """Return the logs of the fit that may have a condition."""
    members = test.fit.campaign.members
    return [i for i, one in enumerate(members) if any(each.effect.id == test.effect for each in one.conditions)]


def _where_worse(test: ConditionTest, place: Mapping[str, int]) -> str:
    """Return where held-out stretches are predicted worse with a condition, if they surely are."""
    if test.gain.high >= 0.0:
        return ""
    loss = test.loss[1]
    gains = loss.gain(test.loss[0])
    worst = min(place, key=lambda path: float(gains[loss.log == place[path]].sum()))
    lost = float(gains[loss.log == place[worst]].sum())
    return f" Those stretches are predicted worse with it, most in {name_of_log(worst)} ({lost:+.0f} nat)."


def _range(gain: Gain) -> str:
    return f"{gain.total:+.0f} nat ({gain.low:+.0f} to {gain.high:+.0f})"
