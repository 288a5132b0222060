"""Differences between two groups of logs, judged: confirmed by held-out stretches of the logs, estimated only, or none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite

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
from ferryid.diagnose.judging.difference import Difference
from ferryid.diagnose.judging.finding import Rival
from ferryid.diagnose.judging.group_loads import LoadDifference, load_differences
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import Effect
from ferryid.effects.wording import ALL_THRUSTERS, listed, uncapitalised, weak_evidence
from ferryid.side_by_side import over
from ferryid.vessel.circumstances import Circumstances
from ferryid.vessel.profile import Profile


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
    made, found = select_differences(conditions.hull.fit, progress, JUDGING.unresolved_evidence)
    if made.campaign.properties:
        before = made.campaign.conditions
        conditions = judge_conditions(replace(campaign, properties=made.campaign.properties), place, progress)
        # An estimate that a search arrived at is nearer to the best one than one that begins at none.
        if conditions.hull.fit.campaign.conditions != before:
            made = conditions.hull.fit
    progress("testing the differences on held-out stretches")
    judged = [judged_difference(made, one, contenders) for one, contenders in found]
    judged.sort(key=lambda one: (bool(one.doubt), -one.evidence))
    taken = {one.key for one in judged}
    # One that may act in either group is shown once: its estimate has the other sign.
    rest = {one.key: one for one in differences_of(made.campaign) if one.key not in taken}.values()
    compared = over(partial(compare_near, made), rest)
    return JudgedGroups(
        tuple(judged),
        tuple(_difference(made, one, near=True) for one in compared),
        tuple(one for one in made.campaign.properties if not one.group),
        load_differences(conditions.tests, made.campaign),
        float(np.sqrt(made.disagreement)),
    )


def beside_sensors(judged: JudgedGroups, sensors: Sequence[Difference], *, hull_known: bool) -> JudgedGroups:
    """Return what groups differ in with what their sensors show, without what forces say of the same where sensors differ.

    Beside a hull that comes from the same logs, an error of the navigation that forces show and the sensors contradict is
    doubtful: the hull is off in some manoeuvres, and groups differ in these.
    """
    selected = [one for one in sensors if one.selected]
    of_sensors = {one.key for one in selected}
    # What forces show was estimated with the sensors' errors taken out.
    forces = tuple(one for one in judged.differences if one.key not in of_sensors)
    if not hull_known:
        forces = tuple(replace(one, doubt=one.doubt or _unseen_by_sensors(one, sensors)) for one in forces)
    differences = sorted([*selected, *forces], key=lambda one: (bool(one.doubt), -one.evidence))
    compared = [one for one in judged.compared if one.key not in of_sensors]
    compared += [one for one in sensors if not one.selected]
    return replace(judged, differences=tuple(differences), compared=tuple(compared))


def _unseen_by_sensors(one: Difference, sensors: Sequence[Difference]) -> str:
    """Return that sensors, compared with each other, show no such difference, as the end of a sentence; empty where they do."""
    for other in sensors:
        if other.key == one.key and not _overlap(one, other):
            return (
                f"the hull comes from the same logs, and the sensors, compared with each other, show no such difference "
                f"({other.values})"
            )
    return ""


def _overlap(one: Difference, other: Difference) -> bool:
    return all(
        each.low <= other.estimates[name].high and other.estimates[name].low <= each.high
        for name, each in one.estimates.items()
        if name in other.estimates
    )


def judged_difference(made: CampaignFit, candidate: Candidate, contenders: Sequence[Contender]) -> Difference:
    """Return what supports a difference of an estimate."""
    without = without_property(made, candidate)
    found = _difference(made, compare_estimated(made, candidate, without))
    before, after = held_out_loss(without), held_out_loss(made)
    gains = after.gain(before)
    groups = np.array([made.campaign.members[i].group for i in after.log])
    by_group = {group: Gain.of(gains[groups == group]) for group in GROUPS}
    profile = made.campaign.members[0].plain.measurements.profile
    found = replace(
        found,
        selected=True,
        gain=Gain.of(gains),
        by_group=by_group,
        rivals=_rivals(candidate, contenders),
        instead=tuple(_difference(made, one.comparison) for one in contenders if one.comparison is not None),
        circumstances=Circumstances.of(profile),
    )
    doubt = _doubt(found, candidate.effect, made.campaign.hull.known, profile)
    return replace(found, doubt=doubt or _surpassed(contenders, made.disagreement) or _of_regimes(made.campaign))


def _of_regimes(campaign: Campaign) -> str:
    """Return that nothing separates two logs that moved unlike from a hull that is off, as the end of a sentence; empty where
    something does.

    A hull that comes from the same two logs is that of two regimes, and what it is off between them is one difference. Further
    logs of a group show by how much it scatters.
    """
    if campaign.hull.known or scatter_shows(campaign):
        return ""
    axes = [one.axis for one in _regimes(campaign)]
    return (
        f"the hull comes from the same two logs, which moved unlike in {listed(axes)}, and may be off between such motions"
        if axes
        else ""
    )


def _surpassed(contenders: Sequence[Contender], apart: float) -> str:
    """Return that logs scatter in something that explains more than a difference, as the end of a sentence; empty where not."""
    tolerance = JUDGING.unresolved_evidence * max(1.0, apart)
    more = [uncapitalised(one.candidate.title) for one in contenders if one.behind > tolerance]
    return f"{listed(more)} would explain more, and logs of one group differ in that too" if more else ""


def _rivals(candidate: Candidate, contenders: Sequence[Contender]) -> tuple[Rival, ...]:
    rivals = [Rival(one.candidate.effect.id, one.candidate.instance, min(one.behind, 0.0)) for one in contenders]
    kept = {(one.effect, one.instance): one for one in reversed(rivals) if (one.effect, one.instance) != candidate.key}
    return tuple(sorted(kept.values(), key=lambda one: -one.delta_score))


def _doubt(one: Difference, effect: Effect, hull_known: bool, profile: Profile) -> str:
    assert one.gain is not None
    assert one.by_group is not None
    if one.evidence < INFERENCE.prior_odds:
        return f"{weak_evidence(one.evidence, INFERENCE.prior_odds)}, as logs of one group scatter"
    if one.wide:
        return "logs of one group differ in it by as much as the groups do"
    if one.gain.low <= 0.0:
        return "held-out stretches of the logs are not surely predicted better with it"
    for group, gain in one.by_group.items():
        if gain.high < 0.0:
            return f"held-out stretches of group {group} are predicted worse with it"
    values = {name: each.value for name, each in one.estimates.items()}
    ends = {name: (each.low, each.high) for name, each in one.estimates.items()}
    if doubt := value_doubt(effect, one.parameters, values, profile) or effect.doubt_of_ends(ends):
        return doubt
    if not _excludes(one):
        return "no interval excludes that there is none"
    every = one.instance == ALL_THRUSTERS or len(profile.actuators) == 1
    if effect.scales and every and min(low for low, _ in ends.values()) < JUDGING.idle_share:
        return (
            f"the motion of group {one.group} may not follow its recorded force at all, as where actuators were not engaged "
            "in some of its logs"
        )
    if effect.id in OF_HULL and not hull_known:
        return "the damping that it multiplies is known from the same logs only"
    return ""


def _excludes(one: Difference) -> bool:
    neutral = {each.name: each.neutral for each in one.parameters}
    return any(each.low > neutral[name] or each.high < neutral[name] for name, each in one.estimates.items())


def _difference(made: CampaignFit, one: Comparison, *, near: bool = False) -> Difference:
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
    found = Difference.of(candidate, estimates, one.evidence, one.scatter * size, smallest, made.disagreement)
    return replace(found, wide=one.wide)


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
    found += [one.says for one in _regimes(campaign)]
    return tuple(found)


@dataclass(frozen=True)
class _Regimes:
    """An axis on which the groups moved unlike: the share of one group's velocities within the range of the other's."""

    axis: str
    unit: str
    group: str
    other: str
    share: float
    low: float
    high: float

    @property
    def says(self) -> str:
        """Return it as a sentence."""
        return (
            f"Only {100.0 * self.share:.0f} % of the {self.axis} velocity of group {self.group} lies within that of group "
            f"{self.other} "
            f"({self.low:.2f} to {self.high:.2f} {self.unit}): where the hull model is off, that appears as a difference."
        )


def _regimes(campaign: Campaign) -> list[_Regimes]:
    """Return the axes on which the groups moved unlike."""
    found = []
    for k, (axis, unit, scale) in enumerate(
        (("surge", "m/s", 1.0), ("sway", "m/s", 1.0), ("yaw", "deg/s", 180.0 / np.pi))
    ):
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
        # Either may be the one that moved more.
        both = []
        for group, other in (GROUPS[::-1], GROUPS):
            low, high = np.quantile(rows[other], [0.025, 0.975]).tolist()
            share = float(np.mean((rows[group] >= low) & (rows[group] <= high)))
            both.append(_Regimes(axis, unit, group, other, share, scale * low, scale * high))
        found.append(min(both, key=lambda one: one.share))
    return [one for one in found if one.share < JUDGING.common_regime]


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
    open_ = sum(bool(one.unresolved_with) for one in sure)
    whose = "its cause" if len(sure) == 1 else f"the cause of {open_}"
    causes = f", {whose} being one of several that these logs cannot distinguish" if open_ else ""
    parts = [*([f"{counted(len(sure), 'difference')} confirmed"] if sure else [])]
    parts += [f"{counted(hints, 'difference')} estimated, not confirmed"] if hints else []
    return f"{' and '.join(parts)} between the groups{causes}.{also}"
