"""Differences between two groups of logs, judged: confirmed by held-out stretches of the logs, estimated only, or none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import exp, isfinite

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.campaign_properties import without_property
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import (
    GROUPS,
    OF_HULL,
    Comparison,
    Contender,
    compare_estimated,
    compare_near,
    differences_of,
    scatter_shows,
    select_differences,
)
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_conditions import judge_conditions
from ferryid.diagnose.judging.campaign_evidence import Gain, held_out_loss
from ferryid.diagnose.judging.credibility import value_doubt
from ferryid.diagnose.judging.experiment_design import manoeuvre
from ferryid.diagnose.judging.finding import Rival
from ferryid.diagnose.judging.group_loads import LoadDifference, load_differences
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import Parameter
from ferryid.effects.wording import listed, parameter_word, weak_evidence
from ferryid.side_by_side import over
from ferryid.vessel.circumstances import ANYWHERE, Circumstances
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Difference:
    """A property of one group relative to the other.

    Attributes
    ----------
    candidate
        The effect, and the group in whose logs it acts.
    estimates
        Its parameters.
    evidence
        Logarithm of the evidence over that of no such difference [nat].
    scatter
        Standard deviation between logs of one group, of the first parameter, in its unit.
    smallest
        By parameter, the distance from neutral that would have been seen with an even chance; None where none would.
    gain, by_group
        Held-out log-likelihood over that of no difference, of all logs and of each group; None where it was not selected.
    rivals
        What was tried in its place, with the evidence over it [nat].
    doubt
        Why it is not confirmed, as the end of a sentence; empty where it is.
    circumstances
        Where the logs were recorded, and what drives the vessel.
    """

    candidate: Candidate
    estimates: Mapping[str, Estimate]
    evidence: float
    scatter: float
    smallest: Mapping[str, float | None]
    gain: Gain | None = None
    by_group: Mapping[str, Gain] | None = None
    rivals: tuple[Rival, ...] = ()
    doubt: str = ""
    circumstances: Circumstances = ANYWHERE

    @property
    def group(self) -> str:
        """The group in whose logs it acts."""
        return self.candidate.group

    @property
    def other(self) -> str:
        """The group that it is relative to."""
        return GROUPS[1 - GROUPS.index(self.group)]

    @property
    def probability(self) -> float:
        """Probability over none, by the evidence and the prior odds; a hint's at most where it is not confirmed."""
        away = min(max(self.evidence - INFERENCE.prior_odds, -700.0), 700.0)
        probability = 1.0 / (1.0 + exp(-away))
        return min(probability, JUDGING.hint_probability) if self.doubt else probability

    @property
    def unresolved_with(self) -> tuple[str, ...]:
        """Effects that explain the same about as well."""
        near = [one.effect for one in self.rivals if one.delta_score > -JUDGING.unresolved_evidence]
        return tuple(dict.fromkeys(near))

    @property
    def separating_manoeuvre(self) -> str | None:
        """What to record to separate it from these."""
        return manoeuvre(self.candidate.effect.id, self.unresolved_with, self.circumstances)

    @property
    def says(self) -> str:
        """The difference as a sentence."""
        parts = [self.said(one) for one in self.candidate.parameters if one.name in self.estimates]
        text = f"{self.title}, {self.group} relative to {self.other}: {', '.join(parts)}."
        return f"{text} It is estimated, not confirmed: {self.doubt}." if self.doubt else text

    @property
    def title(self) -> str:
        """What differs."""
        return self.candidate.title

    def seen_from(self, name: str) -> str:
        """Return the smallest difference of a parameter that would have been seen, with its unit."""
        least, label = self.smallest[name], parameter_word(name)
        if least is None:
            return f"{label} not seen at any size"
        unit = next(each.unit for each in self.candidate.parameters if each.name == name)
        return f"{label} {100.0 * least:.0f} %" if unit == "-" else f"{label} {float(f'{least:.2g}'):g} {unit}"

    def said(self, parameter: Parameter) -> str:
        """Return a parameter with its interval."""
        one = self.estimates[parameter.name]
        name = parameter_word(parameter.name)
        if parameter.unit == "-":
            return f"{name} {one.value:.3g} ({one.low:.3g} to {one.high:.3g})"
        return f"{name} {one.value:+.3g} {one.unit} ({one.low:+.3g} to {one.high:+.3g})"


@dataclass(frozen=True)
class JudgedGroups:
    """What two groups of logs differ in.

    Attributes
    ----------
    differences
        Those that were selected, confirmed ones first.
    compared
        Every other one that was looked for, with its estimate.
    shared
        Properties of all logs that were selected beside them.
    loads
        Wind and current.
    apart
        How many times as much as the noise explains the logs differ about what they share, in standard deviations.
    """

    differences: tuple[Difference, ...]
    compared: tuple[Difference, ...]
    shared: tuple[Candidate, ...]
    loads: tuple[LoadDifference, ...]
    apart: float

    @property
    def sure(self) -> tuple[Difference, ...]:
        """Differences that are confirmed."""
        return tuple(one for one in self.differences if not one.doubt)

    @property
    def verdict(self) -> str:
        """``different`` with a confirmed difference of the vessel, ``perhaps`` with one that is not, ``alike`` else."""
        return "different" if self.sure else "perhaps" if self.differences else "alike"


def judge_groups(campaign: Campaign, progress: Callable[[str], None]) -> JudgedGroups:
    """Judge in what two groups of logs differ: conditions, then differences beside them, then conditions beside these."""
    place = {str(i): i for i in range(len(campaign.members))}
    conditions = judge_conditions(campaign, place, progress)
    made, found = select_differences(conditions.hull.fit, progress)
    if made.campaign.properties:
        before = made.campaign.conditions
        conditions = judge_conditions(replace(campaign, properties=made.campaign.properties), place, progress)
        # An estimate that a search arrived at is nearer to the best one than one that begins at none.
        if conditions.hull.fit.campaign.conditions != before:
            made = conditions.hull.fit
    progress("testing the differences on held-out stretches")
    judged = [judged_difference(made, one, contenders) for one, contenders in found]
    judged.sort(key=lambda one: (bool(one.doubt), -one.evidence))
    taken = {one.candidate.key for one in judged}
    # One that may act in either group is shown once: its estimate has the other sign.
    rest = {one.key: one for one in differences_of(made.campaign) if one.key not in taken}.values()
    compared = over(partial(compare_near, made), rest)
    return JudgedGroups(
        tuple(judged),
        tuple(_difference(made, one, True) for one in compared),
        tuple(one for one in made.campaign.properties if not one.group),
        load_differences(conditions.tests, made.campaign),
        float(np.sqrt(made.disagreement)),
    )


def judged_difference(made: CampaignFit, candidate: Candidate, contenders: Sequence[Contender]) -> Difference:
    """Return what supports a difference of an estimate."""
    without = without_property(made, candidate)
    found = _difference(made, compare_estimated(made, candidate, without), False)
    before, after = held_out_loss(without), held_out_loss(made)
    gains = after.gain(before)
    groups = np.array([made.campaign.members[i].group for i in after.log])
    by_group = {group: Gain.of(gains[groups == group]) for group in GROUPS}
    found = replace(found, gain=Gain.of(gains), by_group=by_group, rivals=_rivals(candidate, contenders))
    profile = made.campaign.members[0].plain.measurements.profile
    found = replace(found, circumstances=Circumstances.of(profile))
    return replace(found, doubt=_doubt(found, made.campaign.hull.known, profile))


def _rivals(candidate: Candidate, contenders: Sequence[Contender]) -> tuple[Rival, ...]:
    rivals = [Rival(one.candidate.effect.id, one.candidate.instance, one.behind) for one in contenders]
    kept = {(one.effect, one.instance): one for one in reversed(rivals) if (one.effect, one.instance) != candidate.key}
    return tuple(sorted(kept.values(), key=lambda one: -one.delta_score))


def _doubt(one: Difference, hull_known: bool, profile: Profile) -> str:
    assert one.gain is not None
    assert one.by_group is not None
    if one.evidence < INFERENCE.prior_odds:
        return f"{weak_evidence(one.evidence, INFERENCE.prior_odds)}, as logs of one group scatter"
    if one.gain.low <= 0.0:
        return "held-out stretches of the logs are not surely predicted better with it"
    for group, gain in one.by_group.items():
        if gain.high < 0.0:
            return f"held-out stretches of group {group} are predicted worse with it"
    values = {name: each.value for name, each in one.estimates.items()}
    if doubt := value_doubt(one.candidate.effect, one.candidate.parameters, values, profile):
        return doubt
    if not _excludes(one):
        return "no interval excludes that there is none"
    if one.candidate.effect.id in OF_HULL and not hull_known:
        return "the damping that it multiplies is known from the same logs only"
    return ""


def _excludes(one: Difference) -> bool:
    neutral = {each.name: each.neutral for each in one.candidate.parameters}
    return any(each.low > neutral[name] or each.high < neutral[name] for name, each in one.estimates.items())


def _difference(made: CampaignFit, one: Comparison, near: bool) -> Difference:
    """Return a comparison for people: parameters that mean something, in their units."""
    candidate = one.candidate
    hidden: set[str] = set()
    for member in made.campaign.members:
        hidden |= candidate.effect.unreported(member.windows.measurements, one.values)
    begun = [each.name for each in candidate.parameters if each.start is not None]
    if near and begun:
        # What has no meaning beside nothing.
        hidden |= {each.name for each in candidate.parameters} - set(begun)
    estimates, smallest = {}, {}
    for each, value, error, least in zip(candidate.parameters, one.values, one.errors, one.smallest, strict=True):
        if each.name not in hidden:
            estimates[each.name] = Estimate.normal(float(value), float(error), each.unit)
            smallest[each.name] = float(least) if isfinite(least) else None
    size = candidate.parameters[0].size
    return Difference(candidate, estimates, one.evidence, one.scatter * size, smallest)


def notes_of(judged: JudgedGroups, campaign: Campaign) -> tuple[str, ...]:
    """Return what a reader must know of the comparison, as sentences."""
    found = []
    if judged.apart > 1.0:
        found.append(
            f"The logs disagree about what they share {judged.apart:.1f} times as much as the noise in them explains."
        )
    if not scatter_shows(campaign):
        found.append(
            "With one log in each group, a difference between the groups cannot be separated from one between any two logs."
        )
    for one in judged.shared:
        found.append(f"{one.title} was estimated beside the differences as a property of both groups.")
    found += _regimes(campaign)
    return tuple(found)


def _regimes(campaign: Campaign) -> list[str]:
    """Return for each axis on which the groups moved unlike, that they did."""
    names = (("surge", "m/s"), ("sway", "m/s"), ("yaw", "deg/s"))
    found = []
    for k, (axis, unit) in enumerate(names):
        rows = {
            group: np.concatenate(
                [
                    one.windows.measurements.nu[one.windows.measurements.usable, k]
                    for one in campaign.members
                    if one.group == group
                ]
            )
            for group in GROUPS
        }
        low, high = np.quantile(rows[GROUPS[0]], [0.025, 0.975])
        share = float(np.mean((rows[GROUPS[1]] >= low) & (rows[GROUPS[1]] <= high)))
        if share < JUDGING.common_regime:
            scale = 180.0 / np.pi if axis == "yaw" else 1.0
            found.append(
                f"Only {100.0 * share:.0f} % of the {axis} velocity of group B lies within that of group A "
                f"({scale * low:.2f} to {scale * high:.2f} {unit}): where the hull model is off, that appears as a difference."
            )
    return found


def smallest_note(judged: JudgedGroups) -> str:
    """Return the smallest differences that would have been seen, as a sentence; empty where none would."""
    parts = []
    for one in judged.compared:
        for name, least in one.smallest.items():
            if least is not None:
                parts.append(f"{one.title}, {one.seen_from(name)}")
    return f"Would have been seen with an even chance, from: {'; '.join(parts)}." if parts else ""


def summary(judged: JudgedGroups) -> str:
    """Return the verdict in a line."""
    sure, hints = judged.sure, len(judged.differences) - len(judged.sure)
    loads = [f"the mean {effects()[one.effect].title.lower()}" for one in judged.loads if one.differs and not one.doubt]
    also = f" They differ in {listed(loads)}." if loads else ""
    if not judged.differences:
        return f"No difference of the vessel found between the groups.{also}"
    parts = [*([f"{counted(len(sure), 'difference')} confirmed"] if sure else [])]
    parts += [f"{counted(hints, 'difference')} estimated, not confirmed"] if hints else []
    return f"{' and '.join(parts)} between the groups.{also}"
