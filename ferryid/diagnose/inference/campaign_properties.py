"""Lasting properties of a vessel, selected by what all of its logs say together.

Every candidate is first weighed by gaps and slopes where a search for it begins (a score test as Rao's, hull and conditions of
all logs partialled out); the best are then estimated beside everything else, and one after the other is selected as long as the
evidence speaks for it. What the evidence speaks for no longer beside what was selected after it leaves again, and is a rival of
what took its place.

References
----------
Rao (1948), Large sample tests of statistical hypotheses concerning several parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_model import DIFFERENCE_STEP, Campaign, HullPrior
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects import effects
from ferryid.effects.effect import HELD
from ferryid.side_by_side import over
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

INSTRUMENTS = frozenset({"time_delay"})
"""What is no property of hull or actuators, and yet the same in all logs of a vessel."""
LOADS = frozenset({"payload"})
"""What is a log's own, and may yet be the same in all of them, or in a group of them: a load aboard."""
WEIGHED, WORTH = 5, 0.25
"""Most candidates that are estimated in a round, and the share of the most evidence so far that a further one must promise."""


@dataclass(frozen=True)
class Start:
    """Where the search for a property begins, and the evidence that it would add if the gaps were linear from there [nat]."""

    candidate: Candidate
    begun: CampaignFit
    gain: float


@dataclass(frozen=True)
class ScoredProperty:
    """A property, estimated beside everything else, and the evidence that it adds."""

    candidate: Candidate
    fit: CampaignFit
    gain: float

    def over(self, other: ScoredProperty) -> float:
        """Return the log odds over another, estimated under the same noise [nat].

        An effect has as many parameters on one actuator as on another. Where nobody has modelled the hull, all of its
        coefficients grow with the force of the actuators, and with them the volume that the evidence counts: then what
        either leaves, and asks of the hull, decides between the two.
        """
        if self.fit.campaign.hull.known or not self.same_effect(other):
            return self.gain - other.gain
        return 0.5 * (other.fit.cost - self.fit.cost)

    @property
    def negligible(self) -> bool:
        """Whether it is too small to be worth a name."""
        campaign = self.fit.campaign
        value = campaign.values(self.fit.common, self.fit.own[0])[1][campaign.properties.index(self.candidate)]
        parameters, effect = self.candidate.parameters, self.candidate.effect
        away = [
            abs(at - one.neutral)
            for at, one in zip(value.tolist(), parameters, strict=True)
            if one.unit == parameters[0].unit
        ]
        return bool(max(away) < effect.negligible)

    def same_effect(self, other: ScoredProperty) -> bool:
        """Return whether it is the same effect of another actuator."""
        return self.candidate.effect.id == other.candidate.effect.id


@dataclass(frozen=True)
class TriedProperty:
    """What was tried in the place of a property: the log odds over it [nat], and its share of the most evidence over none."""

    candidate: Candidate
    odds: float
    share: float = 0.0


Rivals = Mapping[tuple[str, str | None], tuple[TriedProperty, ...]]
"""Of each property that was selected, by its key: what was tried in its place."""


def properties_of(campaign: Campaign) -> list[Candidate]:
    """Return every lasting property that no log rules out and some log can show of the actuator.

    An error of the navigation is seen by forces only beside a hull that is known, as one that comes from the same logs takes
    after it, or where it makes port and starboard unlike, which no hull does: what else it has is held then.
    """
    logs = [member.windows.measurements for member in campaign.members]
    profile: Profile = logs[0].profile
    return [
        _beside(campaign.hull, Candidate.of(one, instance, profile))
        for one in effects().values()
        if (one.vessel or one.id in INSTRUMENTS or (one.id in LOADS and campaign.hull.known))
        and one.choose is None
        and (campaign.hull.known or one.sidewise or not one.of_sensor)
        and not any(one.excluded(measurements) for measurements in logs)
        for instance in one.instances(profile)
        if not all(one.cannot_be_of(measurements, instance) for measurements in logs)
    ]


def _beside(hull: HullPrior, candidate: Candidate) -> Candidate:
    """Return a property with what a hull that comes from the same logs would take after held where it does not act."""
    if hull.known or not candidate.effect.of_sensor:
        return candidate
    seen = candidate.effect.sidewise
    parameters = tuple(one if one.name in seen else replace(one, size=HELD) for one in candidate.parameters)
    return replace(candidate, parameters=parameters)


def select_properties(made: CampaignFit, progress: Callable[[str], None]) -> tuple[CampaignFit, Rivals]:
    """Return the estimate with every property that the evidence speaks for, and what was tried in the place of each."""
    given = made.campaign.properties
    rivals: dict[tuple[str, str | None], tuple[TriedProperty, ...]] = {}
    while len(made.campaign.properties) < INFERENCE.most_effects:
        taken = {one.key for one in made.campaign.properties}
        left = [one for one in properties_of(made.campaign) if one.key not in taken]
        # What is compared has the same noise and has settled under it.
        made = estimate_campaign(made.campaign, noise=made.noise, begin=made)
        progress(f"weighing {len(left)} lasting properties over all logs")
        starts = sorted(over(partial(start_of, made), left), key=lambda one: -one.gain)
        found: list[ScoredProperty] = []
        for one in starts[:WEIGHED]:
            # A promise may be of what is impossible: what was estimated decides how much the others must promise.
            if one.gain > max([0.0, *(WORTH * other.gain for other in found)]):
                found.append(_estimated(made, one))
        found = sorted((one for one in found if not one.negligible), key=lambda one: -one.gain)
        if not found or found[0].gain < INFERENCE.prior_odds:
            break
        best = found[0]
        for other in found[1:]:
            if other.same_effect(best) and other.over(best) > 0.0:
                best = other
        rivals[best.candidate.key] = tuple(
            TriedProperty(one.candidate, one.over(best), one.gain / found[0].gain) for one in found if one is not best
        )
        # With what it explains gone, the noise is less; the spreads follow.
        made = _opened(estimate_campaign(best.fit.campaign, begin=best.fit), best.candidate)
    return _without_displaced(made, rivals, given)


def _without_displaced(made: CampaignFit, rivals: Rivals, given: Sequence[Candidate]) -> tuple[CampaignFit, Rivals]:
    """Return an estimate without what was selected and adds nothing worth a name beside the rest, which has it as a rival.

    As of a single log, what the others explain as well goes, the least first. It was selected for something that another
    explains now. Where it stands it may do nothing at all, which leads nowhere: so it is tried from its start in the place of
    each, and takes the place in which it is likelier. What the selection began with is not in question.
    """
    while selected := [one for one in made.campaign.properties if one not in given]:
        fewer = [without_property(made, one) for one in selected]
        k = max(range(len(fewer)), key=lambda i: fewer[i].evidence)
        if made.evidence - fewer[k].evidence >= INFERENCE.prior_odds:
            break
        gone, made = selected.pop(k), fewer[k]
        tried = [_in_place_of(made, one, gone) for one in selected]
        for one in tried:
            rivals = {**rivals, one.found.key: _with_rival(rivals.get(one.found.key, ()), one.tried)}
        best = max(tried, key=lambda one: one.tried.odds, default=None)
        if best is not None and best.tried.odds > 0.0:
            rivals = {**rivals, gone.key: _with_rival(rivals.get(gone.key, ()), best.displaced)}
            made = best.fit
    return made, rivals


@dataclass(frozen=True)
class _Instead:
    """A property in the place of one that was found: what either is over the other, and the estimate with it there."""

    found: Candidate
    tried: TriedProperty
    displaced: TriedProperty
    fit: CampaignFit


def _in_place_of(made: CampaignFit, found: Candidate, other: Candidate) -> _Instead:
    bare = without_property(made, found)
    ours = ScoredProperty(found, made, made.evidence - bare.evidence)
    theirs = _estimated(bare, start_of(bare, other))
    odds, most = theirs.over(ours), max(ours.gain, theirs.gain)
    shares = [one.gain / most if most > 0.0 else 0.0 for one in (theirs, ours)]
    return _Instead(found, TriedProperty(other, odds, shares[0]), TriedProperty(found, -odds, shares[1]), theirs.fit)


def _with_rival(rivals: Sequence[TriedProperty], one: TriedProperty) -> tuple[TriedProperty, ...]:
    """Return what was tried in a property's place with one more, in place of what was known of it before."""
    return (*(other for other in rivals if other.candidate.key != one.candidate.key), one)


def _opened(made: CampaignFit, candidate: Candidate) -> CampaignFit:
    """Return an estimate in which what a selected property holds is free as well, where the evidence favours that.

    What a hull takes after makes no name, but beside a name it would be taken for something else.
    """
    profile = made.campaign.members[0].windows.measurements.profile
    free = replace(candidate, parameters=candidate.effect.parameters_of(profile))
    if free.parameters == candidate.parameters:
        return made
    properties = tuple(free if one == candidate else one for one in made.campaign.properties)
    begun = replace(made, campaign=replace(made.campaign, properties=properties))
    opened = estimate_campaign(begun.campaign, noise=made.noise, begin=begun)
    held = estimate_campaign(made.campaign, noise=made.noise, begin=made)
    return opened if opened.evidence > held.evidence else made


def start_of(made: CampaignFit, candidate: Candidate) -> Start:
    """Return where a search for a property begins: of its starts, the one from which the gaps promise the most evidence."""
    # What lies beyond the start was not tried on campaigns, whose hulls and formulas are known less well.
    starts = (_linearised(made, candidate, share) for share in candidate.start_shares if share <= 1.0)
    return max(starts, key=lambda one: one.gain)


def _linearised(made: CampaignFit, candidate: Candidate, share: float) -> Start:
    """Return the evidence that a property would add if the gaps were linear from some share of its start on.

    Where a limit does not act yet, forces do not depend on it, so that gaps and slopes are taken where the search begins; those
    of the hull and of the logs' own vectors are the estimate's. Gained is what the squares of the gaps and of the prior fall by
    from the estimate, with all of these eliminated, less the logarithm of what is determined of the property.
    """
    begun = with_property(made, candidate, share)
    g, q, normal = made.campaign.g, len(candidate.parameters), made.normal
    place = made.campaign.means.start
    first = begun.common[place : place + q]
    A, b = np.diag(np.append(normal.prior, np.ones(q))), np.concatenate([normal.prior * made.common, first])
    gained = -0.5 * float(first @ first)
    lines = _gaps_and_slopes(begun, range(place, place + q))
    for i, (part, both) in enumerate(zip(made.parts, lines, strict=True)):
        white = made.noise.white(i, both, made.campaign.members[i].windows.runs).reshape(-1, 1 + q)
        J, was, w = part.slopes.reshape(-1, part.slopes.shape[2]), part.gaps.ravel(), white[:, 0]
        K = np.hstack([J[:, :g], white[:, 1:]])
        believed = np.hstack([made.own_belief(i)[:, :g], np.zeros((made.campaign.l, q))])
        across, before = J[:, g:].T @ K + made.own_belief(i)[:, g:].T @ believed, normal.own_slopes[i]
        own = before + J[:, g:].T @ (w - was)
        factor = cho_factor(normal.own[i])
        A += K.T @ K + believed.T @ believed - across.T @ cho_solve(factor, across)
        b += K.T @ w - across.T @ cho_solve(factor, own)
        b[:g] += made.own_gradient(i)[:g]
        gained += 0.5 * float(was @ was - w @ w)
        gained += 0.5 * float(own @ cho_solve(factor, own) - before @ cho_solve(factor, before))
    settled, of_others = normal.prior * made.common + np.sum(normal.slopes, axis=0), A[:g, :g]
    gained += 0.5 * float(b @ np.linalg.solve(A, b) - settled @ np.linalg.solve(of_others, settled))
    gained -= 0.5 * float(np.linalg.slogdet(A)[1] - np.linalg.slogdet(of_others)[1]) + candidate.log_alternatives
    return Start(candidate, begun, gained)


def with_property(made: CampaignFit, candidate: Candidate, share: float = 1.0) -> CampaignFit:
    """Return an estimate with a property more: at a share of the way from where it does not act to its start."""
    campaign = replace(made.campaign, properties=(*made.campaign.properties, candidate))
    place = made.campaign.means.start
    start = [
        share * ((one.neutral if one.start is None else one.start) - one.neutral) / one.size
        for one in candidate.parameters
    ]
    return replace(made, campaign=campaign, common=np.insert(made.common, place, start))


def without_property(made: CampaignFit, candidate: Candidate) -> CampaignFit:
    """Return the estimate without a property, everything else estimated again under the same noise."""
    first = len(made.campaign.hull.mean) + len(made.campaign.shared)
    keep = np.ones(made.campaign.g, dtype=np.bool_)
    for one in made.campaign.properties:
        if one == candidate:
            keep[first : first + len(one.parameters)] = False
        first += len(one.parameters)
    rest = tuple(one for one in made.campaign.properties if one != candidate)
    begun = replace(made, campaign=replace(made.campaign, properties=rest), common=made.common[keep])
    return estimate_campaign(begun.campaign, noise=made.noise, begin=begun)


def _estimated(made: CampaignFit, start: Start) -> ScoredProperty:
    fit = estimate_campaign(start.begun.campaign, noise=made.noise, begin=start.begun)
    return ScoredProperty(start.candidate, fit, fit.evidence - made.evidence)


def _gaps_and_slopes(begun: CampaignFit, columns: Sequence[int]) -> list[Floats]:
    """Return the gaps of every log, and their derivatives by some of the common vector, shape (J, 3, 1 + columns) each."""
    here = begun.campaign.gaps(begun.common, begun.own)
    every = [here]
    for k in columns:
        moved = begun.common.copy()
        moved[k] += DIFFERENCE_STEP
        there = begun.campaign.gaps(moved, begun.own)
        every.append([(one - other) / DIFFERENCE_STEP for one, other in zip(there, here, strict=True)])
    return [np.stack(one, axis=2) for one in zip(*every, strict=True)]
