"""In which lasting properties two groups of logs of one vessel differ: one hull for both, and effects that act in one group.

Both groups are one campaign. A difference is a property that acts in the logs of one group only, beside everything that all
logs share, so that its parameters are those of one group relative to the other: a factor of 0.8 is four fifths of the force
that the other group's logs have, whatever that is.

A property that scatters from log to log, as where the hull model is off in other ways in every manoeuvre, differs between any
two groups. So the same property is a random effect of each log, beside the difference, with a standard deviation that is not
known: log i has z_i = d g_i + b_i with b_i from N(0, s²), in sizes. Gaps are linear in all of these near the estimate, b_i is
eliminated from the normal equations of its log, and evidence and posterior are averaged over s by its evidence and its prior
(none, or, with the prior odds of any effect, one of a grid).

References
----------
Laird and Ware (1982), Random-effects models for longitudinal data; Hoeting et al. (1999), Bayesian model averaging: a tutorial.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import exp, log, pi, sqrt

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp

from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_model import DIFFERENCE_STEP, Campaign
from ferryid.diagnose.inference.campaign_properties import (
    INSTRUMENTS,
    LOADS,
    WEIGHED,
    properties_of,
    with_property,
    without_property,
)
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects import effects
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import ForceModel
from ferryid.effects.wording import ALL_THRUSTERS
from ferryid.side_by_side import over
from ferryid.types import Flags, Floats, Ints

GROUPS = ("A", "B")
"""The logs that are named first, and those that they are compared with."""
OF_HULL = frozenset({"fouling"})
"""What a single log shows beside a hull model alone, and groups beside the hull that they share."""
FAULTS = frozenset({"thruster_gain"})
"""Factors of force. One of the groups has less than the other: a loss in the one, as no actuator gains force of itself."""
SCATTERS = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
"""Standard deviations between logs that are averaged over beside none, in sizes of a parameter."""


@dataclass(frozen=True)
class Comparison:
    """A difference between groups, estimated beside everything else.

    Attributes
    ----------
    candidate
        The effect, and the group in whose logs it acts.
    values, errors
        Its parameters in their units, and their standard deviations with the scatter between logs, shape (p,).
    evidence
        Logarithm of the evidence over that of no such difference, both averaged over the scatter between logs [nat].
    over_alike
        The same without scatter: what differences are compared by, as the scatter of each is another.
    scatter
        Standard deviation between logs, in sizes, averaged over.
    smallest
        Distance from neutral that would have been seen with an even chance, in their units, shape (p,); infinite for none.
    """

    candidate: Candidate
    values: Floats
    errors: Floats
    evidence: float
    over_alike: float
    scatter: float
    smallest: Floats

    @property
    def wide(self) -> bool:
        """True where logs of one group differ by as much as was looked for, or more."""
        return self.scatter > INFERENCE.wide_scatter * SCATTERS[-1]

    @property
    def excludes_none(self) -> bool:
        """True where the 95 % interval of some parameter does not hold its neutral value."""
        neutral = np.array([one.neutral for one in self.candidate.parameters])
        return bool(np.any(np.abs(self.values - neutral) > 1.96 * self.errors))


@dataclass(frozen=True)
class Contender:
    """What was tried in place of a difference that was selected.

    `behind` is its evidence less that of the selected one, without scatter [nat]: above zero where logs scatter in it so much
    that no difference is known, or where it is no simpler. `comparison` is what it would be in the other's place.
    """

    candidate: Candidate
    behind: float
    comparison: Comparison | None = None


def in_groups(campaign: Campaign, names: Sequence[str]) -> Campaign:
    """Return a campaign whose logs belong to groups, one name each."""
    members = tuple(replace(one, group=name) for one, name in zip(campaign.members, names, strict=True))
    return replace(campaign, members=members)


def grouped_as(campaign: Campaign, other: Campaign) -> Campaign:
    """Return a campaign whose logs belong to the groups of another of the same logs."""
    return in_groups(campaign, [one.group for one in other.members])


def differences_of(campaign: Campaign) -> list[Candidate]:
    """Return every difference that no log rules out and, of an actuator, some log of each group can show.

    One whose neutral value is an end of what is possible, as a lag, a load or a loss of force, may act in either group. The
    shape of a thrust curve is as uncertain in one group as in the other: that it differs is sought beside the same shape in all
    logs only, or an error of the curve would be taken for a difference.
    """
    shared = {one.key for one in campaign.properties if not one.group}
    profile = campaign.members[0].windows.measurements.profile
    found = list[Candidate]()
    for one in effects().values():
        lasts = one.vessel or one.id in INSTRUMENTS or one.id in LOADS
        if not lasts or one.choose is not None or one.unsteady is not None or _untestable(one, campaign):
            continue
        for instance in one.instances(profile):
            candidate = Candidate.of(one, instance, profile)
            if one.of_thrust_curve and candidate.key not in shared:
                continue
            if candidate.parameters and _shown_in_each_group(candidate, campaign):
                found.append(candidate)
    found += all_thrusters(campaign)
    # Beside a level that both groups have, which is less than the other is not known beforehand.
    sided = [one if one.key in shared else _as_loss(one) for one in found]
    return [replace(one, group=group) for one in sided for group in _groups(one)]


def _as_loss(candidate: Candidate) -> Candidate:
    """Return a factor of force as a loss; beside a hull that is known, less in one group is not more in the other."""
    if candidate.effect.id not in FAULTS:
        return candidate
    first, *rest = candidate.parameters
    # At its end a limit has no slope.
    lost = replace(first, high=first.neutral, start=first.neutral - 0.5 * first.size)
    return replace(candidate, parameters=(lost, *rest))


def _groups(candidate: Candidate) -> tuple[str, ...]:
    first = candidate.parameters[0]
    return GROUPS if first.neutral in (first.low, first.high) else GROUPS[1:]


def _untestable(effect: Effect, campaign: Campaign) -> bool:
    every = [member.windows.measurements for member in campaign.members]
    if effect.id in OF_HULL:
        return any(one.profile.setting in effect.absent_in for one in every)
    return any(effect.excluded(one) for one in every)


def _shown_in_each_group(candidate: Candidate, campaign: Campaign) -> bool:
    shown = {
        one.group
        for one in campaign.members
        if not candidate.effect.cannot_be_of(one.windows.measurements, candidate.instance)
    }
    return shown == {one.group for one in campaign.members}


def all_thrusters(campaign: Campaign) -> list[Candidate]:
    """Return the force of all thrusters alike, where there are several."""
    profile = campaign.members[0].windows.measurements.profile
    if len(profile.actuators) < 2:
        return []
    gain = replace(effects()["thruster_gain"], apply=_scaled)
    return [Candidate.of(gain, ALL_THRUSTERS, profile)]


def _scaled(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    for name in force_model.measurements.names:
        force_model = effects()["thruster_gain"].apply(force_model, p, name)
    return force_model


def select_differences(
    made: CampaignFit, progress: Callable[[str], None], unresolved: float
) -> tuple[CampaignFit, tuple[tuple[Candidate, tuple[Contender, ...]], ...]]:
    """Return the estimate with every difference that the evidence favours, and what contended with each.

    What all logs share is selected beside them, so that a property of both groups is not taken for a difference. Of several
    that are less than `unresolved` [nat] apart, beside what the logs differ by beyond their noise, the simplest is first.
    """
    contenders: dict[Candidate, tuple[Contender, ...]] = {}
    while len(made.campaign.properties) < INFERENCE.most_effects:
        taken = made.campaign.properties
        # A level of all thrusters that both groups have would be taken for a loss in the one, and then in the other.
        common = (*properties_of(made.campaign), *all_thrusters(made.campaign))
        left = [one for one in (*differences_of(made.campaign), *common) if one not in taken]
        # What is compared has the same noise and has settled under it.
        made = estimate_campaign(made.campaign, noise=made.noise, begin=made)
        progress(f"weighing {len(left)} differences between the groups")
        best = likeliest_difference(made, left)
        if best is None:
            break
        contenders[best.comparison.candidate] = best.contenders
        # With what it explains gone, the noise is less.
        made = estimate_campaign(best.fit.campaign, begin=best.fit)
    for earlier in made.campaign.properties:
        # A later one may explain what an earlier one stood in for.
        if len(made.campaign.properties) > 1:
            without = without_property(made, earlier)
            if compare_estimated(made, earlier, without).evidence < INFERENCE.prior_odds:
                made = without
    return _in_place_of_each_other(made, contenders, unresolved)


def _known(one: Comparison) -> bool:
    """Return whether the evidence favours a difference that logs of one group do not scatter in by all that was looked for."""
    return one.evidence >= INFERENCE.prior_odds and not one.wide


def _in_place_of_each_other(
    made: CampaignFit, contenders: dict[Candidate, tuple[Contender, ...]], unresolved: float
) -> tuple[CampaignFit, tuple[tuple[Candidate, tuple[Contender, ...]], ...]]:
    """Return an estimate with the likelier of each difference and what contended with it, now that all else is estimated.

    What was selected first was weighed beside less, and what came later may have been what set it apart.
    """
    found = []
    for one in [each for each in made.campaign.properties if each.group]:
        without = without_property(made, one)
        taken = made.campaign.properties
        best, tried = one, {one: (made, compare_estimated(made, one, without))}
        for other in contenders.get(one, ()):
            if other.candidate.group and other.candidate not in taken:
                fit = _estimated(without, other.candidate)
                tried[other.candidate] = fit, compare_estimated(fit, other.candidate, without)
        least = max(here.over_alike for _, here in tried.values()) - unresolved * max(1.0, made.disagreement)
        near = [each for each, (_, here) in tried.items() if here.over_alike >= least and _known(here)]
        # An interval that holds none is no name where another's does not.
        near = [each for each in near if tried[each][1].excludes_none] or near
        if near:
            best = min(near, key=lambda each: (len(each.parameters), -tried[each][1].over_alike))
        behind = tried[best][1].over_alike
        rest = [
            Contender(each, here.over_alike - behind, here) for each, (_, here) in tried.items() if each is not best
        ]
        if best is not one:
            made = estimate_campaign(tried[best][0].campaign, begin=tried[best][0])
        found.append((best, tuple(rest)))
    return made, tuple(found)


@dataclass(frozen=True)
class Likeliest:
    """A difference that the evidence favours, the estimate with it, and what was tried in its place."""

    comparison: Comparison
    fit: CampaignFit
    contenders: tuple[Contender, ...]


def likeliest_difference(made: CampaignFit, left: Sequence[Candidate]) -> Likeliest | None:
    """Return the likeliest of some differences beside an estimate that lacks them; None where the evidence favours none."""
    weighed = over(partial(compare_near, made), left)
    order = sorted((one for one in weighed if _possible(one)), key=lambda one: -one.evidence)[:WEIGHED]
    tried = []
    for one in order:
        if one.evidence > 0.0:
            fit = _estimated(made, one.candidate)
            tried.append((compare_estimated(fit, one.candidate, made), fit))
    tried.sort(key=lambda pair: -pair[0].over_alike)
    likely = [(one, fit) for one, fit in tried if one.evidence >= INFERENCE.prior_odds]
    if not likely:
        return None
    best, fit = likely[0]
    # What logs scatter in by as much is no difference that is known, and may be the one nevertheless.
    seen = {one.candidate for one, _ in tried}
    others = [one for one, _ in tried if one is not best]
    others += [
        one for one in weighed if _possible(one) and one.candidate not in seen and one.over_alike > best.over_alike
    ]
    contenders = tuple(Contender(one.candidate, one.over_alike - best.over_alike) for one in others)
    return Likeliest(best, fit, contenders)


def _possible(one: Comparison) -> bool:
    first = one.candidate.parameters[0]
    return _on_its_side(first, float(one.values[0]) - first.neutral)


def _on_its_side(first: Parameter, away: float) -> bool:
    """Return whether an effect exists on this side of its neutral value."""
    return not (first.neutral == first.low and away < 0.0) and not (first.neutral == first.high and away > 0.0)


def _estimated(made: CampaignFit, candidate: Candidate) -> CampaignFit:
    begun = with_property(made, candidate)
    return estimate_campaign(begun.campaign, noise=made.noise, begin=begun)


def compare_near(made: CampaignFit, candidate: Candidate) -> Comparison:
    """Return what a difference would be beside an estimate that lacks it, if the gaps were linear in it."""
    slopes = _slopes(made, candidate, _in_sizes(candidate, candidate.start))
    grams = [_gram(made, i, one, _acts(made.campaign, i, candidate)) for i, one in enumerate(slopes)]
    p = len(candidate.parameters)
    with_it, without = _averaged(made, grams, p, True), _averaged(made, grams, p, False)
    neutral = np.array([one.neutral for one in candidate.parameters])
    tail = gross(_in_sizes(candidate, neutral) + with_it.shift) - candidate.log_alternatives
    evidence = with_it.evidence - without.evidence + tail
    over_alike = with_it.steady - without.steady + tail
    return _comparison(made, candidate, neutral, with_it, evidence, over_alike)


def gains_of_ways(made: CampaignFit, candidate: Candidate, ways: Sequence[Flags]) -> list[float]:
    """Return the evidence that a difference would add that acts in some of the logs, for several ways to choose them.

    The gaps are taken to be linear in it and no scatter between logs is averaged over: what is likely is to be compared in
    full. That of a way in which it would have the wrong sign is minus infinity.
    """
    slopes = _slopes(made, candidate, _in_sizes(candidate, candidate.start))
    grams = over(lambda i: _gram(made, i, slopes[i]), range(len(slopes)))
    g, p = made.campaign.g, len(candidate.parameters)
    matrices, slopes_of_logs = np.stack([one.matrix for one in grams]), np.stack([one.slope for one in grams])
    A = np.diag(made.normal.prior) + np.sum(matrices[:, :g, :g], axis=0)
    settled = np.linalg.solve(A, made.normal.prior * made.common + np.sum(slopes_of_logs[:, :g], axis=0))
    first = candidate.parameters[0]
    found = []
    for way in ways:
        across, own = np.sum(matrices[way, :g, g:], axis=0), np.sum(matrices[way, g:, g:], axis=0)
        S = np.eye(p) + own - across.T @ np.linalg.solve(A, across)
        slope = np.sum(slopes_of_logs[way, g:], axis=0) - across.T @ settled
        shift = -np.linalg.solve(S, slope)
        gain = -0.5 * float(slope @ shift) - 0.5 * float(np.linalg.slogdet(S)[1]) - candidate.log_alternatives
        found.append(gain if _on_its_side(first, float(shift[0])) else -np.inf)
    return found


def compare_estimated(made: CampaignFit, candidate: Candidate, without: CampaignFit) -> Comparison:
    """Return what a difference of an estimate is, against an estimate without it under the same noise."""
    campaign = made.campaign
    first = len(campaign.hull.mean) + len(campaign.shared)
    for one in campaign.properties:
        if one == candidate:
            break
        first += len(one.parameters)
    rows = slice(first, first + len(candidate.parameters))
    z = made.common[rows]
    slopes = _slopes(without, candidate, z)
    p = len(candidate.parameters)
    grams = [_gram(made, i, one) for i, one in enumerate(slopes)]
    with_it = _averaged(made, grams, p, False, rows)
    value = campaign.values(made.common, made.own[0])[1][campaign.properties.index(candidate)]
    tail = gross(_in_sizes(candidate, value))
    alike = made.evidence - without.evidence
    # Logs that scatter are where the difference puts them: far from where all are alike, nothing is linear from there.
    others = [with_it.steady - alike, *_instead(made, grams, p, rows)[1:]]
    none = float(logsumexp(np.array(others) + np.log(list(_scatters(campaign).values()))))
    evidence, over_alike = with_it.evidence - none + tail, alike + tail
    return _comparison(made, candidate, value, with_it, evidence, over_alike)


def gross(z: Floats) -> float:
    """Return what a prior of Student's form, of three degrees of freedom, adds to the evidence of a normal one [nat].

    Differences may be gross, such as a propeller that lost a blade: an estimate of many sizes is not less likely for that than
    logs that scatter as much. `z` is the estimate in sizes, where it is certain.
    """
    student = log(2.0 / (pi * sqrt(3.0))) - 2.0 * np.log1p(z**2 / 3.0)
    return float(np.sum(student + 0.5 * z**2 + 0.5 * log(2.0 * pi)))


def _comparison(
    made: CampaignFit, candidate: Candidate, at: Floats, found: _Averaged, evidence: float, over_alike: float
) -> Comparison:
    size = np.array([one.size for one in candidate.parameters])
    away = np.abs(at + size * found.shift - [one.neutral for one in candidate.parameters])
    # One log each has no scatter to be seen: they differ as logs do.
    apart = 1.0 if scatter_shows(made.campaign) else max(1.0, made.disagreement)
    widened = INFERENCE.posterior_factor * size * np.sqrt(found.variance * apart)
    errors = np.hypot(widened, candidate.effect.formula_error * away)
    known = np.maximum(1.0 / np.maximum(found.variance, 1e-12) - 1.0, 0.0)
    least = np.sqrt((1.0 + known) * (2.0 * INFERENCE.prior_odds + np.log1p(known))) / np.maximum(known, 1e-12)
    # The evidence must favour it, and the interval exclude none.
    smallest = np.where(known > 1.0, np.maximum(size * least, 1.96 * widened), np.inf)
    return Comparison(candidate, at + size * found.shift, errors, evidence, over_alike, found.scatter, smallest)


def scatter_shows(campaign: Campaign) -> bool:
    """Return whether some group has two logs, so that a scatter between logs differs from a difference between groups."""
    return len(campaign.members) > len(GROUPS)


def _acts(campaign: Campaign, i: int, candidate: Candidate) -> bool:
    return candidate.group in ("", campaign.members[i].group)


def _in_sizes(candidate: Candidate, values: Floats) -> Floats:
    neutral = np.array([one.neutral for one in candidate.parameters])
    return np.asarray((values - neutral) / [one.size for one in candidate.parameters])


def _slopes(made: CampaignFit, candidate: Candidate, z: Floats) -> list[Floats]:
    """Return derivatives of the gaps of every log by a property as if it acted there, whitened, shape (J, 3, p) each."""
    everywhere = with_property(made, replace(candidate, group=""))
    first = made.campaign.means.start
    common = everywhere.common.copy()
    common[first : first + len(z)] = z

    here, columns = everywhere.campaign.gaps(common, made.own), []
    for k in range(len(z)):
        moved = common.copy()
        moved[first + k] += DIFFERENCE_STEP
        there = everywhere.campaign.gaps(moved, made.own)
        columns.append([(one - other) / DIFFERENCE_STEP for one, other in zip(there, here, strict=True)])
    return [
        made.noise.white(i, np.stack(every, axis=2), made.campaign.members[i].windows.runs)
        for i, every in enumerate(zip(*columns, strict=True))
    ]


@dataclass(frozen=True)
class _Gram:
    """Normal equations of a log with its own part eliminated: of common vector, difference and scatter, and their gradient."""

    matrix: Floats
    slope: Floats


def _gram(made: CampaignFit, i: int, columns: Floats, acts: bool | None = None) -> _Gram:
    """Return those of a log; the difference has columns of its own where it is not part of the common vector."""
    g, part = made.campaign.g, made.parts[i]
    J, w = part.slopes.reshape(-1, part.slopes.shape[2]), part.gaps.ravel()
    D = columns.reshape(-1, columns.shape[2])
    K = np.hstack([J[:, :g], *(() if acts is None else (acts * D,)), D])
    believed = np.hstack([made.own_belief(i)[:, :g], np.zeros((made.campaign.l, K.shape[1] - g))])
    across = K.T @ J[:, g:] + believed.T @ made.own_belief(i)[:, g:]
    factor = cho_factor(made.normal.own[i])
    matrix = K.T @ K + believed.T @ believed - across @ cho_solve(factor, across.T)
    slope = K.T @ w - across @ cho_solve(factor, made.normal.own_slopes[i])
    slope[:g] += made.own_gradient(i)[:g]
    return _Gram(matrix, slope)


@dataclass(frozen=True)
class _Averaged:
    """A model averaged over the scatter between logs.

    Attributes
    ----------
    evidence, steady
        Logarithm of the evidence, but for what all models about an estimate have in common, and the same without scatter.
    shift, variance
        Of the difference, from where it is linear, in sizes, shape (p,).
    scatter
        Its standard deviation between logs, in sizes.
    """

    evidence: float
    steady: float
    shift: Floats
    variance: Floats
    scatter: float


def _averaged(made: CampaignFit, grams: Sequence[_Gram], p: int, beside: bool, rows: slice | None = None) -> _Averaged:
    """Average a model over the scatter between logs.

    Parameters
    ----------
    made
        The estimate about which the gaps are linear.
    grams
        Of its logs.
    p
        Parameters of the difference.
    beside
        Whether it has a difference that the estimate lacks, in the columns after the common vector.
    rows
        Where the difference stands in the common vector, if there.
    """
    g = made.campaign.g
    wide = len(grams[0].slope) - p
    used = np.arange(wide if beside else g)
    kept = rows if rows is not None else slice(g, g + p) if beside else slice(0, 0)
    priors = _scatters(made.campaign)
    centre, prior = np.zeros(len(used)), np.ones(len(used))
    centre[:g], prior[:g] = made.normal.prior * made.common, made.normal.prior
    found = [_with_scatter(grams, used, p, one, centre, prior) for one in priors]
    logs = np.array([one.evidence for one in found])
    weights = np.log(list(priors.values())) + logs
    evidence = float(logsumexp(weights))
    share = np.exp(weights - evidence)
    shifts = np.array([one.shift[kept] for one in found])
    shift = share @ shifts
    variance = share @ (np.array([one.variance[kept] for one in found]) + (shifts - shift) ** 2)
    return _Averaged(evidence, float(logs[0]), shift, variance, float(share @ np.array(list(priors))))


def _scatters(campaign: Campaign) -> dict[float, float]:
    """Return the standard deviations between logs, in sizes, with their prior probabilities; none is the first."""
    if not scatter_shows(campaign):
        return {0.0: 1.0}
    # A scatter is as rare as any other effect.
    rare = exp(-INFERENCE.prior_odds)
    return {0.0: 1.0 - rare, **dict.fromkeys(SCATTERS, rare / len(SCATTERS))}


@dataclass(frozen=True)
class _Step:
    """The evidence of one scatter, but for what all have in common, and shift and variance of the vector, shape (k,)."""

    evidence: float
    shift: Floats
    variance: Floats


def _with_scatter(grams: Sequence[_Gram], used: Ints, p: int, scatter: float, centre: Floats, prior: Floats) -> _Step:
    """Return what one standard deviation between logs [sizes] makes of the `used` part of the vector, with its prior."""
    wide = len(grams[0].slope) - p
    scattered = np.arange(wide, wide + p)
    A, r, logarithm = np.diag(prior), centre.copy(), 0.0
    for one in grams:
        H, h = one.matrix[np.ix_(used, used)], one.slope[used]
        if scatter > 0.0:
            B = one.matrix[np.ix_(scattered, scattered)] + np.eye(p) / scatter**2
            across, mine = one.matrix[np.ix_(used, scattered)], one.slope[scattered]
            follow = np.linalg.solve(B, np.column_stack([across.T, mine]))
            H, h = H - across @ follow[:, :-1], h - across @ follow[:, -1]
            logarithm += 0.5 * float(mine @ follow[:, -1]) - 0.5 * float(np.linalg.slogdet(B * scatter**2)[1])
        A, r = A + H, r + h
    move = np.linalg.solve(A, r)
    evidence = logarithm + 0.5 * float(r @ move) - 0.5 * float(np.linalg.slogdet(A)[1])
    return _Step(evidence, np.asarray(-move), np.diag(np.linalg.inv(A)))


def _instead(made: CampaignFit, grams: Sequence[_Gram], p: int, rows: slice) -> list[float]:
    """Return the evidence of each scatter between logs in place of a difference that stands in an estimate's vector.

    The difference goes back to none, and every log's own part begins there; all is linear about the estimate.
    """
    back = np.zeros(len(grams[0].slope))
    back[rows] = -made.common[rows]
    moved = [_Gram(one.matrix, one.slope + one.matrix @ back) for one in grams]
    cost = sum(float(one.slope @ back + 0.5 * back @ one.matrix @ back) for one in grams)
    used = np.delete(np.arange(made.campaign.g), np.r_[rows])
    prior = made.normal.prior[used]
    # The prior of the difference is no longer paid for.
    cost -= 0.5 * float(made.common[rows] @ made.common[rows])
    centre = prior * made.common[used]
    return [_with_scatter(moved, used, p, one, centre, prior).evidence - cost for one in _scatters(made.campaign)]
