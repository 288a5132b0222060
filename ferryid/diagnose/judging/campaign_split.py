"""Logs that no common hull fits: one of another vessel among those of a campaign, or a hull that changed between two days.

A campaign is parted where its logs are predicted better by two hulls than by one, on stretches that neither was fitted to. Of
every log, blocks are held out in turn; the hull comes from other logs, all of them or those of the same part, and from the rest
of the log itself. Formulas are off in every campaign, so that logs differ about one hull by more than their noise: a hull is as
uncertain as the logs that it comes from differ among themselves. To part is right only where both the likelihood and the force
errors of the smaller part are far better with a hull of its own.

Every block is predicted from the normal equations at the common estimate, which is exact where gaps are linear in the hull.
Parts that are tried are single logs, those before and after a time, and references against the rest; of many the likeliest, by
how far their hulls are apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.cached import cached_property
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.changes_between_logs import find_change
from ferryid.diagnose.judging.campaign_evidence import Gain, held_out_blocks, without_conditions
from ferryid.diagnose.judging.changes_between_logs import ChangeTest, judge_part
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.side_by_side import over
from ferryid.types import Flags, Floats, Ints

WEIGHED = 4
"""Ways to part a campaign that are judged on held-out data, the likeliest of each kind."""
ROUNDS = 8
"""Most rounds in which logs are put to the part that they are nearer to."""


@dataclass(frozen=True)
class HullDistance:
    """How far the hulls of two parts of a campaign are apart, in what both parts show.

    Attributes
    ----------
    evidence
        Half the squared distance over its covariance, in which logs differ about a hull as much as within the parts [nat].
    scatter
        That squared distance over its expectation, over the greatest of a log to the others of its part; 0 where no part has
        logs enough to show how they scatter.
    share
        The distance over the larger of the two hulls, in the same units; what is expected of equal hulls is taken off.
    """

    evidence: float
    scatter: float
    share: float

    @property
    def far(self) -> bool:
        """True where equal hulls are not so far apart, logs of one part much nearer, and the difference is much of a hull."""
        return (
            self.evidence >= JUDGING.split_evidence
            and self.scatter >= JUDGING.split_scatter
            and self.share >= JUDGING.split_share
        )

    @property
    def still_far(self) -> bool:
        """True where that remains beside conditions that each log may have."""
        return self.evidence >= JUDGING.split_kept * JUDGING.split_evidence and self.share >= JUDGING.split_share

    @property
    def unlike(self) -> bool:
        """True where equal hulls are hardly so far apart, and the difference is most of a hull."""
        return self.still_far and self.share >= JUDGING.split_most


NO_DISTANCE = HullDistance(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Split:
    """Two parts of a campaign that no common hull fits.

    Attributes
    ----------
    inside
        Which logs are the smaller part, shape (L,).
    gain
        Held-out log-likelihood of two hulls over one, beside the conditions that the logs may have.
    ratio
        Held-out squared force error with the common hull over that with the part's own: geometric mean over logs and axes of a
        part, the greater of the two.
    hulls
        How far the hulls of the parts are apart.
    change
        A load or a loss of force in one part, beside which a common hull fits; None where nothing of that kind explains it.
    """

    inside: Flags
    gain: Gain
    ratio: float
    hulls: HullDistance = NO_DISTANCE
    change: ChangeTest | None = None

    @property
    def likely(self) -> bool:
        """True where they predict held-out stretches surely better, by more than logs of one vessel differ."""
        return (
            self.gain.total >= JUDGING.split_screening * JUDGING.split_gain
            and self.gain.low > 0.0
            and self.ratio >= JUDGING.split_ratio
        )

    @property
    def found(self) -> bool:
        """True where they predict them far better."""
        return self.gain.total >= JUDGING.split_gain

    @property
    def apart(self) -> bool:
        """True where they predict them far better, and the hulls are farther apart than logs of one vessel are.

        A short log among noisy ones leaves the gain less sure, and the logs' scatter large. Hulls are apart there as well where
        both what they differ by and what the common one leaves of the force error are more than in logs of one vessel.
        """
        if self.change is not None or not self.found or self.gain.low <= 0.0:
            return False
        surely = self.gain.low >= JUDGING.split_surely and self.hulls.far
        return surely or (self.ratio >= JUDGING.split_error and self.hulls.unlike)


def find_split(campaign: Campaign, reference: Flags) -> Split | None:
    """Return how a campaign falls into two parts that no common hull fits; None where one fits all.

    A load that came aboard between logs, or one of several thrusters that weakened, is no other hull: beside it the logs are
    judged again. A factor of all forces is: it does the same as one on all of the hull.

    Parameters
    ----------
    campaign
        Its logs in order of time.
    reference
        Which of them are references, shape (L,).
    """
    split = _found(campaign, reference)
    if split is None:
        return None
    made = estimate_campaign(campaign)
    change = find_change(made)
    if change is not None and change.scales_all:
        return split
    left = split if change is None else _found(change.fit.campaign, reference)
    # What changed at a time may be no more than the best that a time makes of what is in a single log.
    return None if left is None else _with_change(left, made, reference)


def _with_change(split: Split, made: CampaignFit, reference: Flags) -> Split:
    """Return a split with the load or the loss of force of one part that explains it, or what remains apart beside that."""
    tested = judge_part(made, split.inside, [str(i) for i in range(len(split.inside))])
    if tested is None:
        return split
    rest = _found(tested.fit.campaign, reference)
    if split.apart:
        # A thruster that gives hardly any force in a log bends its hull as far. Only what is confirmed is that.
        return replace(split, change=tested) if rest is None and tested.confirmed else split
    if rest is None:
        return replace(split, change=tested)
    return split if np.array_equal(rest.inside, split.inside) else rest


def _found(campaign: Campaign, reference: Flags) -> Split | None:
    fit = estimate_campaign(without_conditions(campaign))
    bare = _judged(fit, _ways(reference))
    likely = [one for one in bare if one.likely]
    # Where a wind that nobody measured is most of the force error, another hull makes little of it.
    hidden = [one for one in bare if one.found and one.gain.low > 0.0] if campaign.conditions else []
    alike = _Logs(fit).alike()
    apart = [one for one in (*bare, *(_judged(fit, alike) if alike else ())) if one.apart]
    best = [max(some, key=lambda one: one.gain.total) for some in (likely or hidden, _fewest(apart)) if some]
    tried = list({one.inside.tobytes(): one for one in best}.values())
    if tried and campaign.conditions:
        # A wind or a current of one log must not look like another hull, nor hide one.
        made = estimate_campaign(campaign)
        tried = [one for one in (_beside(made, way) for way in tried) if one is not None]
    return max((one for one in tried if one.found), key=lambda one: one.gain.total, default=None)


def _fewest(apart: Sequence[Split]) -> list[Split]:
    """Return, of the ways to part logs that lie within the likeliest one, that of the fewest logs; none of none.

    A log that says little of its hull is near to either part: it stays with the others unless it is apart by itself.
    """
    if not apart:
        return []
    likeliest = max(apart, key=lambda one: one.gain.total)
    within = [one for one in apart if not np.any(one.inside & ~likeliest.inside)]
    return [min(within, key=lambda one: (int(one.inside.sum()), -one.gain.total))]


def _beside(made: CampaignFit, way: Split) -> Split | None:
    """Return a way to part logs as it is judged beside the conditions that they may have; None where these explain it."""
    (beside,) = _judged(made, [way.inside])
    if way.apart and beside.hulls.still_far:
        # What is held out of a log by itself is predicted from little beside a wind of its own: the hulls decide.
        return way
    if not way.likely and not beside.likely:
        return None
    return replace(way, gain=beside.gain, ratio=way.ratio if way.likely else beside.ratio)


def _ways(reference: Flags) -> list[Flags]:
    """Return the ways to part logs: one against the others, before a time and after it, references against the rest."""
    count = len(reference)
    order = np.arange(count)
    ways = [order == i for i in range(count)]
    ways += [order < k for k in range(2, count - 1)]
    if reference.any() and not reference.all():
        ways.append(reference)
    # Of two logs it is one way.
    return _different(ways)


def _different(ways: Sequence[Flags]) -> list[Flags]:
    """Return ways by their smaller parts, each once."""
    return list({tuple(min(one, ~one, key=_smaller).tolist()): min(one, ~one, key=_smaller) for one in ways}.values())


def _smaller(inside: Flags) -> tuple[int, tuple[bool, ...]]:
    return int(inside.sum()), tuple((~inside).tolist())


def _judged(made: CampaignFit, ways: Sequence[Flags]) -> list[Split]:
    logs = _Logs(made)
    kinds = [[one for one in ways if one.sum() == 1], [one for one in ways if one.sum() > 1]]
    return [logs.split(one) for kind in kinds for one in sorted(kind, key=logs.apart, reverse=True)[:WEIGHED]]


@dataclass(frozen=True)
class _Logs:
    """The logs of a campaign at the common estimate: what some of them say of the hull, and how it predicts others."""

    made: CampaignFit

    @cached_property
    def linear(self) -> list[tuple[Floats, Floats]]:
        """Accelerations left over in every log, and their derivatives."""
        return self.made.campaign.linearised(self.made.common, self.made.own)

    def apart(self, inside: Flags) -> float:
        """Return how far the hulls of two parts are apart, by how uncertain they are: squared, over its expectation."""
        return _distance(*(self._belief(np.flatnonzero(one)) for one in (inside, ~inside))).relative

    def hulls(self, parts: Sequence[Ints]) -> HullDistance:
        """Return how far the hulls of two parts are apart, by how uncertain logs that differ within the parts leave them."""
        factor = max(self.disagreement(one) for one in parts)
        found = _distance(*(self._belief(one, factor) for one in parts))
        several = [one for one in parts if len(one) >= JUDGING.split_scattering]
        within = [self._to_others(i, one, factor) for one in several for i in one.tolist()]
        # Logs of one vessel are as far apart as expected, at the least.
        scatter = found.relative / max(1.0, *within) if within else 0.0
        sizes = []
        for A, b in (self._belief(one, factor) for one in parts):
            hull = self._whole(self.made.common + np.linalg.solve(A, b))
            sizes.append(float(hull @ np.linalg.solve(found.covariance, hull)))
        share = np.sqrt(max(found.squared - found.expected, 0.0) / max(*sizes, 1e-12))
        return HullDistance(0.5 * found.squared, float(scatter), float(share))

    def _to_others(self, i: int, part: Ints, factor: float) -> float:
        return _distance(self._belief(np.array([i]), factor), self._belief(part[part != i], factor)).relative

    def _whole(self, common: Floats) -> Floats:
        """Return the vector of all logs with the hull counted from none instead of from what was believed of it."""
        hull, whole = self.made.campaign.hull, np.zeros_like(common)
        free = hull.free
        whole[free] = (hull.root @ common[: len(hull.mean)] + hull.mean)[free] / hull.spread[free]
        return whole

    def alike(self) -> list[Flags]:
        """Return parts of logs that are nearer to each other than to the rest, from every log on; none of few logs."""
        count = len(self.made.parts)
        if count <= JUDGING.split_scattering:
            return []
        every = np.arange(count)
        factor = max(1.0, min(self.made.disagreement, JUDGING.usual_disagreement))
        own = [self._belief(np.array([i]), factor) for i in range(count)]
        ways = []
        for i in range(count):
            inside = every == i
            for _ in range(ROUNDS):
                parts = [every[inside], every[~inside]]
                nearer = np.array([self._nearer(own[j], j, parts, factor) for j in range(count)])
                if nearer.all() or not nearer.any() or np.array_equal(nearer, inside):
                    break
                inside = nearer
            if 1 < inside.sum() < count - 1:
                ways.append(inside)
        return _different(ways)

    def _nearer(self, own: tuple[Floats, Floats], j: int, parts: Sequence[Ints], factor: float) -> bool:
        """Return whether a log is likelier one of the first part than one of the second."""
        losses = []
        for part in parts:
            others = part[part != j]
            if not len(others):
                return bool(part is parts[0])
            found = _distance(own, self._belief(others, factor))
            losses.append(found.squared + float(np.linalg.slogdet(found.covariance)[1]))
        return losses[0] < losses[1]

    def split(self, inside: Flags) -> Split:
        """Judge one way to part the logs, by held-out blocks."""
        every = np.arange(len(inside))
        parts = [every[inside], every[~inside]]
        # One hull is not believed more firmly than two are: the logs differ between the parts by what is to be judged.
        factor = max(self.disagreement(one) if len(one) > 1 else 1.0 for one in parts)

        def judged(i: int) -> tuple[Floats, Floats]:
            own = parts[0] if inside[i] else parts[1]
            one = self._held_out(i, every[every != i], factor)
            two = self._held_out(i, own[own != i], self.disagreement(own[own != i]))
            errors = [np.mean(errors**2, axis=0) for _, errors in (one, two)]
            return _gains(one[0], two[0], self.made.parts[i].gaps.size), np.log(errors[0] / errors[1])

        found = over(judged, every.tolist())
        ratios = np.stack([one for _, one in found])
        ratio = max(float(np.exp(np.mean(ratios[one]))) for one in (inside, ~inside))
        return Split(inside, Gain.of(np.concatenate([gains for gains, _ in found])), ratio, self.hulls(parts))

    def disagreement(self, which: Ints) -> float:
        """Return the variance by which some logs differ about their own common hull over that of their noise, at least 1."""
        if len(which) < 2:
            # One log cannot say: as much as logs of one vessel differ.
            return JUDGING.usual_disagreement
        A, slope = self._belief(which)
        normal, (inverses, known) = self.made.normal, self._alone
        gradients = normal.slopes[which] + normal.matrices[which] @ np.linalg.solve(A, slope)
        gradients = gradients[:, : self.made.campaign.means.stop]
        apart = float(np.einsum("ig,igk,ik->", gradients, inverses[which], gradients))
        return max(1.0, apart / max(float(known[which].sum()) * (1.0 - 1.0 / len(which)), 1e-12))

    @cached_property
    def _alone(self) -> tuple[Floats, Floats]:
        """What each log alone makes of what all share: covariances, shape (L, k, k), and how much it tells, shape (L,)."""
        shared = self.made.campaign.means.stop
        matrices = self.made.normal.matrices[:, :shared, :shared]
        inverses = np.asarray(np.linalg.inv(matrices + np.eye(matrices.shape[1])), dtype=np.float64)
        return inverses, np.einsum("igk,ikg->i", matrices, inverses)

    def _belief(self, which: Ints, factor: float = 1.0) -> tuple[Floats, Floats]:
        """Return what some logs say of the step from the common estimate: its precision, and that times its mean."""
        normal, common = self.made.normal, self.made.common
        H, b = normal.matrices[which].sum(axis=0) / factor, normal.slopes[which].sum(axis=0) / factor
        return np.diag(normal.prior) + H, -(normal.prior * common + b)

    def _held_out(self, i: int, others: Ints, factor: float) -> tuple[Floats, Floats]:
        """Return the squares of a log's held-out blocks, whitened, and its errors, if others bring the hull."""
        made, part = self.made, self.made.parts[i]
        P, b = self._belief(others, factor)
        believed = made.own_belief(i)
        g, width = len(b), part.slopes.shape[2]
        J, w = part.slopes.reshape(-1, width), part.gaps.ravel()
        N = J.T @ J + believed.T @ believed
        N[:g, :g] += P
        right = np.append(b, np.zeros(width - g)) - made.own_gradient(i) - J.T @ w
        errors, slopes = self.linear[i]
        errors, squares = errors.copy(), []
        for block, near in held_out_blocks(made.campaign.members[i].windows):
            K, v = part.slopes[near].reshape(-1, width), part.gaps[near].ravel()
            step = np.linalg.solve(N - K.T @ K, right + K.T @ v)
            squares.append(float(np.sum((part.gaps[block] + part.slopes[block] @ step) ** 2)))
            errors[block] += slopes[block] @ step
        return np.array(squares), errors


@dataclass(frozen=True)
class _Distance:
    """How far two hulls are apart: squared, over its covariance, shape (g, g), and what is expected of equal ones."""

    squared: float
    expected: float
    covariance: Floats

    @property
    def relative(self) -> float:
        """The square over its expectation."""
        return self.squared / max(self.expected, 1.0)


def _distance(one: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> _Distance:
    """Return how far two hulls are apart, each given by its precision, and that times its mean."""
    (A, first), (B, second) = one, other
    away = np.linalg.solve(A, first) - np.linalg.solve(B, second)
    covariance = np.asarray(np.linalg.inv(A) + np.linalg.inv(B), dtype=np.float64)
    # Directions of which a part knows nothing differ by nothing but the prior.
    expected = float(np.trace(np.eye(len(A)) - 0.5 * covariance))
    return _Distance(float(away @ np.linalg.solve(covariance, away)), expected, covariance)


def _gains(one: Floats, two: Floats, count: int) -> Floats:
    """Return the log-likelihood that each block of a log gains, from its squares under one hull and under two.

    How loud the noise of the log is follows from each: where its hull is wrong, the common estimate has called it noise.
    """
    first, second = float(one.sum()), float(two.sum())
    apart = first - second
    mean = second if abs(apart) < 1e-9 * second else apart / np.log(first / second)
    return np.asarray(0.5 * count * (one - two) / mean)
