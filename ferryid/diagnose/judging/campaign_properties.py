"""Lasting properties of a vessel, judged over its campaign: confirmed by held-out data of the logs, or estimated only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from math import exp, inf

import numpy as np

from ferryid.counts import all_counted, counted, verb
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.campaign_properties import Rivals, TriedProperty, select_properties, without_property
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.feedback import feedback_beside, joined
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.diagnose.inference.group_differences import compare_estimated, scatter_shows
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.campaign_evidence import Gain, held_out_loss
from ferryid.diagnose.judging.credibility import (
    felt,
    harm_alone,
    idle_in_campaign,
    interval_doubt,
    scaled_as_masses,
    unfelt,
    value_doubt,
    worsened,
)
from ferryid.diagnose.judging.experiment_design import manoeuvre
from ferryid.diagnose.judging.finding import Finding, Rival
from ferryid.diagnose.judging.rivals import alike, redundant_shape
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import HELD
from ferryid.effects.wording import weak_evidence
from ferryid.side_by_side import over
from ferryid.signals.feedback import Feedback
from ferryid.types import AXES, Floats
from ferryid.vessel.circumstances import Circumstances


@dataclass(frozen=True)
class OutOfStep:
    """What else could put force and motion out of step in the logs of a campaign.

    Attributes
    ----------
    evidence
        For the delay or lag over none, beside one of each log that scatters between them [nat]; minus infinity of two logs.
    feedback
        What the forces tell of the disturbances, in all logs together.
    """

    evidence: float
    feedback: Feedback


@dataclass(frozen=True)
class PropertyTest:
    """What speaks for a property over all logs.

    Attributes
    ----------
    candidate
        The property.
    estimates
        Its parameters.
    evidence
        Logarithm of the evidence over that of no such property [nat].
    gain
        Held-out log-likelihood over that of no such property.
    holding
        Logs that are predicted better with it on held-out stretches, of all that can show it.
    improvement
        Share of the held-out squared force error of all logs that it removes, shape (3,).
    rivals
        What was tried in its place, with the evidence over it [nat], below zero.
    alike
        Ids of what explains nearly as much by a formula that is alike; see `ferryid.diagnose.judging.rivals.alike`.
    credibility
        Why it cannot be true of the vessel, or would not be felt, as the end of a sentence; empty where neither is so.
    out_of_step
        Of a delay or lag: what else could put force and motion out of step; None of other properties.
    logs
        Size of the campaign; none where all of its logs can show it.
    hull_known
        False where the hull comes from the same logs.
    """

    candidate: Candidate
    estimates: Mapping[str, Estimate]
    evidence: float
    gain: Gain
    holding: tuple[int, int]
    improvement: Floats
    rivals: tuple[Rival, ...]
    alike: tuple[str, ...] = ()
    credibility: str = ""
    out_of_step: OutOfStep | None = None
    logs: int | None = None
    hull_known: bool = True

    @property
    def beyond_feedback(self) -> bool:
        """Whether it is a delay or lag that gains more than a controller's answer to disturbances could."""
        return self.out_of_step is not None and self.gain.low > self.out_of_step.feedback.high

    @property
    def alike_in_logs(self) -> bool:
        """Whether it is a delay or lag that neither a controller nor hull and formulas that are off can have caused.

        Over windows of seconds a short delay averages out, so that it may remove little of their error. Hull and formulas that
        are off cause a delay that scatters between logs; the evidence for this one holds beside such a scatter.
        """
        if self.out_of_step is None or not self.beyond_feedback:
            return False
        known = all(
            not one.low <= parameter.neutral <= one.high
            for parameter in self.candidate.parameters
            if (one := self.estimates.get(parameter.name)) is not None
        )
        return known and self.out_of_step.evidence >= INFERENCE.prior_odds

    @property
    def doubt(self) -> str:
        """Why it is not confirmed, as the end of a sentence; empty where it is."""
        held, logs = self.holding
        if self.evidence < INFERENCE.prior_odds:
            return weak_evidence(self.evidence, INFERENCE.prior_odds)
        if self.gain.low <= 0.0:
            return "held-out stretches of the logs are not surely predicted better with it"
        if held <= JUDGING.campaign_share * logs:
            return f"only {held} of {counted(logs, 'log')} {verb(held, 'is')} predicted better with it on held-out stretches"
        if logs == 1 and not self.hull_known:
            return "one log alone can show it, and the hull comes from the same logs, which may be off in that one"
        if self.credibility:
            return self.credibility
        if harm := worsened(dict(zip(AXES, self.improvement.tolist(), strict=True))):
            return harm
        if self.improvement.max() < JUDGING.least_removed and not self.alike_in_logs:
            return (
                f"on no axis does it remove {100.0 * JUDGING.least_removed:.0f} % of the held-out squared force error"
            )
        return ""

    @property
    def undefended(self) -> str:
        """Why it is no hint either, as the end of a sentence: held-out stretches speak against it. Empty where it is one.

        Short delays average out over windows of seconds: one that a controller cannot have caused is a hint without a share of
        the error.
        """
        if self.confirmed or self.beyond_feedback:
            return ""
        return harm_alone(dict(zip(AXES, self.improvement.tolist(), strict=True)))

    @property
    def confirmed(self) -> bool:
        """True where held-out data confirm it."""
        return self.doubt == ""

    def finding(self, windows: Windows) -> Finding:
        """Return it as a finding on the log of these windows."""
        effect = self.candidate.effect
        says = effect.says({name: one.value for name, one in self.estimates.items()}, self.candidate.instance)
        held, able = self.holding
        logs = able if self.logs is None else self.logs
        says += f" That is estimated from {all_counted(logs, 'log')} together; "
        those = "them" if able == logs else "these"
        says += f"{able} of them can show it, and " if able < logs else ""
        says += f"on held-out stretches {held} of {those} {verb(held, 'is')} predicted better with it."
        if not self.confirmed:
            says += f" It is estimated, not confirmed: {self.doubt}."
        gained = np.maximum(self.improvement, 0.0)
        shares = gained / gained.sum() if gained.any() else np.zeros(3)
        away = min(max(self.evidence - INFERENCE.prior_odds, -700.0), 700.0)
        probability = 1.0 / (1.0 + exp(-away))
        t = windows.measurements.t
        near = [one.effect for one in self.rivals if one.delta_score > -JUDGING.unresolved_evidence]
        unresolved = tuple(dict.fromkeys([*near, *self.alike]))
        return Finding(
            effect=effect.id,
            instance=self.candidate.instance,
            probability=probability if self.confirmed else min(probability, JUDGING.hint_probability),
            parameters=self.estimates,
            axes=dict(zip(AXES, shares.tolist(), strict=True)),
            intervals=((float(t[0]), float(t[-1])),),
            improvement=dict(zip(AXES, self.improvement.tolist(), strict=True)),
            held_out=True,
            rivals=self.rivals,
            unresolved_with=unresolved,
            separating_manoeuvre=manoeuvre(effect.id, unresolved, Circumstances.of(windows.measurements.profile)),
            says=says,
            evidence={"t": windows.middle_s},
        )


def judge_properties(made: CampaignFit, progress: Callable[[str], None]) -> tuple[PropertyTest, ...]:
    """Select lasting properties beside the hull and the conditions of an estimate, and judge each on held-out data."""
    found, rivals = _one_of_two_that_hide(*_one_shape_of_each_curve(*select_properties(made, progress)))
    return tuple(tested(found, one, rivals.get(one.key, ())) for one in found.campaign.properties)


def _one_shape_of_each_curve(made: CampaignFit, rivals: Rivals) -> tuple[CampaignFit, Rivals]:
    """Return an estimate without the weaker of two shapes of a thrust curve that explain the same: it is the other's rival."""
    while shapes := redundant_shape(made.campaign.properties, partial(_evidence_without, made)):
        made, rivals = _without_weaker(made, rivals, *shapes)
    return made, rivals


def _one_of_two_that_hide(made: CampaignFit, rivals: Rivals) -> tuple[CampaignFit, Rivals]:
    """Return an estimate without the weaker of a delay and a lag that hide each other: it is the other's rival.

    Their sum is known, and neither of them: while both are estimated, the interval of each holds none of it, though one alone
    explains nearly what both do. Evidence for both says little there: it does not know by how much the logs disagree.
    """
    properties = made.campaign.properties
    for places in combinations(range(len(properties)), 2):
        one, other = (properties[place] for place in places)
        if not alike(one, other, 1.0) or not all(_holds_none(made, each) for each in (one, other)):
            continue
        none = _evidence_without(made, set(places))
        alone = {place: _evidence_without(made, set(places) - {place}) - none for place in places}
        weaker, stronger = sorted(places, key=lambda place: alone[place])
        if made.evidence > none and alone[stronger] >= JUDGING.alike_shapes * (made.evidence - none):
            # Each of a delay and a lag is one of a kind: no other pair is left.
            return _without_weaker(made, rivals, weaker, stronger, alone[weaker] / alone[stronger])
    return made, rivals


def _holds_none(made: CampaignFit, candidate: Candidate) -> bool:
    return bool(interval_doubt(candidate.parameters, _estimates(made, candidate), _covariance(made, candidate)))


def _without_weaker(
    made: CampaignFit, rivals: Rivals, weaker_place: int, stronger_place: int, share: float
) -> tuple[CampaignFit, Rivals]:
    """Return an estimate without the weaker of two properties, given by their places, which is the other's rival."""
    weaker, stronger = (made.campaign.properties[place] for place in (weaker_place, stronger_place))
    odds = _evidence_without(made, {stronger_place}) - _evidence_without(made, {weaker_place})
    others = [one for one in rivals.get(stronger.key, ()) if one.candidate.key != weaker.key]
    rivals = {**rivals, stronger.key: (*others, TriedProperty(weaker, odds, share))}
    return without_property(made, weaker), rivals


def _evidence_without(made: CampaignFit, left_out: Set[int]) -> float:
    """Return the evidence of an estimate without the properties at some places."""
    for candidate in [made.campaign.properties[place] for place in left_out]:
        made = without_property(made, candidate)
    return made.evidence


def tested(made: CampaignFit, candidate: Candidate, rivals: Sequence[TriedProperty]) -> PropertyTest:
    """Return what speaks for one of the properties of an estimate, beside what was tried in its place."""
    without = without_property(made, candidate)
    before, after = held_out_loss(without), held_out_loss(made)
    gains = after.gain(before)
    seen = [member.windows.measurements for member in made.campaign.members]
    effect = candidate.effect
    # A log that does not show the actuator in the range concerned is predicted neither better nor worse.
    able = [i for i, one in enumerate(seen) if not effect.cannot_be_of(one, candidate.instance)]
    by_log = [float(gains[after.log == i].sum()) for i in able]
    masses = [mass_of(member.plain.hull) for member in made.campaign.members]
    squares = [
        np.sum([np.sum((one @ M.T) ** 2, axis=0) for one, M in zip(loss.errors, masses, strict=True)], axis=0)
        for loss in (before, after)
    ]
    estimates = _estimates(made, candidate)
    evidence = made.evidence - without.evidence
    others = [one for one in rivals if one.candidate.key not in {each.key for each in made.campaign.properties}]
    others.sort(key=lambda one: -one.odds)
    return PropertyTest(
        candidate,
        estimates,
        evidence,
        Gain.of(gains),
        (sum(one > 0.0 for one in by_log), len(by_log)),
        np.asarray(1.0 - squares[1] / np.where(squares[0] > 0.0, squares[0], np.inf)),
        tuple(Rival(one.candidate.effect.id, one.candidate.instance, min(one.odds, 0.0)) for one in others),
        tuple(one.candidate.effect.id for one in others if alike(one.candidate, candidate, one.share)),
        _credibility(made, candidate, estimates),
        _out_of_step(made, candidate, without) if effect.out_of_step else None,
        logs=len(seen),
        hull_known=made.campaign.hull.known,
    )


def _out_of_step(made: CampaignFit, candidate: Candidate, without: CampaignFit) -> OutOfStep:
    evidence = compare_estimated(made, candidate, without).evidence if scatter_shows(made.campaign) else -inf
    members = enumerate(made.campaign.members)
    return OutOfStep(
        evidence, joined(over(lambda one: feedback_beside(one[1].windows, made.whole_force_model(one[0])), members))
    )


def _credibility(made: CampaignFit, candidate: Candidate, estimates: Mapping[str, Estimate]) -> str:
    """Return why a property cannot be true of the vessel, or would be felt in no log, as the end of a sentence."""
    profile = made.campaign.members[0].plain.measurements.profile
    values = {name: one.value for name, one in estimates.items()}
    if doubt := idle_in_campaign(made):
        return doubt
    if doubt := value_doubt(candidate.effect, candidate.parameters, values, profile):
        return doubt
    if doubt := interval_doubt(candidate.parameters, estimates, _covariance(made, candidate)):
        return doubt
    if candidate.effect.scales and not made.campaign.hull.known:
        scaled = {one.instance for one in made.campaign.properties if one.effect.scales}
        if doubt := scaled_as_masses(scaled, profile):
            return doubt
    without = made.common.copy()
    without[property_rows(made.campaign, candidate)] = 0.0
    return unfelt(felt(made, without, made.own).max(axis=0))


def _estimates(made: CampaignFit, candidate: Candidate) -> dict[str, Estimate]:
    """Return the parameters of a property that mean something."""
    value, error = _estimate(made, candidate)
    seen = [member.windows.measurements for member in made.campaign.members]
    unreported = frozenset.intersection(*(candidate.effect.unreported(one, value) for one in seen))
    return {
        one.name: Estimate.normal(float(at), float(e), one.unit, one.low, one.high)
        for one, at, e in zip(candidate.parameters, value, error, strict=True)
        if one.name not in unreported and one.size > HELD
    }


def _covariance(made: CampaignFit, candidate: Candidate) -> Floats:
    """Return the covariance of a property's parameters up to the errors that are reported, shape (p, p)."""
    rows, size = property_rows(made.campaign, candidate), np.array([one.size for one in candidate.parameters])
    return np.asarray(made.normal.common_covariance[rows, rows] * np.outer(size, size))


def _estimate(made: CampaignFit, candidate: Candidate) -> tuple[Floats, Floats]:
    """Return the parameters of a property and their reported standard deviations, as of `Fit.reported_errors`."""
    campaign = made.campaign
    place, rows = campaign.properties.index(candidate), property_rows(campaign, candidate)
    size = np.array([one.size for one in candidate.parameters])
    error = size * np.sqrt(np.diag(made.normal.common_covariance)[rows] * max(1.0, made.disagreement))
    value = campaign.values(made.common, made.own[0])[1][place]
    away = value - np.array([one.neutral for one in candidate.parameters])
    sized = np.array([one.unit == candidate.parameters[0].unit for one in candidate.parameters])
    effect = candidate.effect
    beyond = np.where(sized, np.hypot(effect.formula_error * away, 0.5 * effect.negligible), 0.0)
    return value, np.asarray(np.hypot(INFERENCE.posterior_factor * error, beyond))


def property_rows(campaign: Campaign, candidate: Candidate) -> slice:
    """Return where the parameters of a property stand in the vector of all logs."""
    place = campaign.properties.index(candidate)
    first = len(campaign.hull.mean) + len(campaign.shared)
    first += sum(len(one.parameters) for one in campaign.properties[:place])
    return slice(first, first + len(candidate.parameters))
