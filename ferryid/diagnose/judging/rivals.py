"""What else could stand in a finding's place, and how probable that leaves the finding."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, replace
from itertools import combinations
from math import exp, inf

from ferryid.diagnose.inference.common_cause import with_fewer_coefficients
from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    Fit,
    choose_parameters,
    fit,
    starting_point,
    without,
)
from ferryid.diagnose.inference.onset_estimation import (
    Linearisation,
    is_brief,
    likeliest_start,
    linearise,
    passes,
    stands_out,
)
from ferryid.diagnose.inference.search import COARSE_ITERATIONS
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.side_by_side import over


@dataclass(frozen=True)
class RivalFit:
    """Another candidate in the place of one that was found.

    Attributes
    ----------
    candidate
        What it is.
    fit
        Of it beside the others that were found.
    gain
        Its evidence over that of what was found.
    """

    candidate: Candidate
    fit: Fit
    gain: float


@dataclass(frozen=True)
class RivalComparison:
    """How one of several candidates stands beside the others.

    Attributes
    ----------
    rivals
        The best first.
    probability
        Of the candidate, over its rivals and none of them; see `without_companions`.
    evidence
        Of the candidate over none of them [nat].
    companions
        Those that act beside the candidate, and are no rivals.
    """

    rivals: tuple[RivalFit, ...]
    probability: float
    evidence: float = 0.0
    companions: tuple[RivalFit, ...] = ()

    @property
    def nearest(self) -> float:
        """Evidence of the best in the candidate's place over that of the candidate [nat], -inf where there is none."""
        return max((one.gain for one in (*self.rivals, *self.companions)), default=-inf)

    def unresolved(self, candidate: Candidate) -> tuple[str, ...]:
        """Return the ids of effects that cannot be told from a candidate: near in evidence, or of a formula that is alike."""
        names = [
            one.candidate.effect.id
            for one in self.rivals
            if one.gain > -JUDGING.unresolved_evidence
            or (self.evidence > 0.0 and alike(one.candidate, candidate, 1.0 + one.gain / self.evidence))
        ]
        return tuple(dict.fromkeys(names))


def same_curve(one: Candidate, other: Candidate, share: float) -> bool:
    """Tell whether it is another shape of the same actuator's thrust curve that explains nearly as much.

    Parameters
    ----------
    one, other
        Two candidates.
    share
        The evidence of the first over that of the other, each over none.
    """
    shapes = one.effect.of_thrust_curve and other.effect.of_thrust_curve
    return shapes and one.instance == other.instance and share >= JUDGING.alike_shapes


def alike(one: Candidate, other: Candidate, share: float) -> bool:
    """Tell whether two formulas idealise what lies between them, and one explains nearly as much as the other.

    Two shapes of a thrust curve, or a delay and a first-order lag: a receiver's filter and a propeller's drive are neither.

    Parameters
    ----------
    one, other, share
        As of `same_curve`.
    """
    same = one.instance == other.instance and one.effect.is_like(other.effect)
    return same and share >= JUDGING.alike_shapes


def redundant_shape(
    candidates: Sequence[Candidate], evidence: Callable[[Set[int]], float]
) -> tuple[int, int, float] | None:
    """Return the weaker and the stronger of two shapes of one thrust curve where either explains nearly what both do.

    The formulas of both are idealised, so that the second is what the first's is off by.

    Parameters
    ----------
    candidates
        What was selected.
    evidence
        Returns the logarithm of the evidence without some of them, which are given by their places [nat].

    Returns
    -------
    tuple of int, int, float or None
        Places of the weaker and of the stronger, and the evidence of the first over that of the other, each alone over none;
        None where there are no such two.
    """
    for i, j in combinations(range(len(candidates)), 2):
        if not same_curve(candidates[i], candidates[j], 1.0):
            continue
        none = evidence({i, j})
        alone = {i: evidence({j}) - none, j: evidence({i}) - none}
        weaker, stronger = sorted(alone, key=lambda k: alone[k])
        both = evidence(frozenset()) - none
        if both > 0.0 and same_curve(candidates[weaker], candidates[stronger], alone[weaker] / both):
            return weaker, stronger, alone[weaker] / alone[stronger]
    return None


def is_doubted_where(problem: EstimationProblem, made: Fit, index: int) -> bool:
    """Tell whether a candidate may stand in for a simpler one by where the vessel was, as a mooring whose pull is constant."""
    candidate = made.candidates[index]
    values = {one.name: value for one, value in zip(candidate.parameters, made.values[index].tolist(), strict=True)}
    values |= {"onset": candidate.onset_s, "offset": candidate.offset_s}
    return bool(candidate.effect.doubt_where(values, problem.plain.measurements))


def compare_rivals(problem: EstimationProblem, kept: Fit, index: int, library: Sequence[Candidate]) -> RivalComparison:
    """Return how a candidate stands against every other of the library in its place, in its span.

    One that is too brief to be judged is weighed against none at all only: it is no name, whatever else could stand there.
    """
    candidate = kept.candidates[index]
    bare = without(problem, kept, index)
    none = exp(min(bare.evidence - kept.evidence + INFERENCE.prior_odds, 50.0))
    if is_brief(problem, candidate):
        return RivalComparison((), 1.0 / (1.0 + none), kept.evidence - bare.evidence)
    begin = starting_point(problem, bare)
    beside = linearise(problem, bare, begin)
    taken = {one.key for one in kept.candidates}

    def instead(other: Candidate) -> RivalFit:
        refit_spans = (
            replace(other, onset_s=candidate.onset_s, offset_s=candidate.offset_s) if other.effect.onset else other
        )
        stand_in = choose_parameters(problem, bare, refit_spans)
        start = [*bare.values, likeliest_start(problem, beside, stand_in)]
        made = fit(
            problem,
            [*bare.candidates, stand_in],
            start,
            steps=COARSE_ITERATIONS,
            begin=None if stand_in.effect.changes_hull else begin,
            # One that is worse than nothing is no rival, whatever it comes to.
            least=bare.evidence,
            from_afar=stand_in.effect.changes_hull or stand_in.effect.piecewise,
        )
        return RivalFit(stand_in, made, made.evidence - kept.evidence)

    def settled_in(one: RivalFit) -> RivalFit:
        made = fit(problem, one.fit.candidates, one.fit.values, begin=starting_point(problem, one.fit))
        ours = kept.evidence
        if one.candidate.effect.of_coefficients and candidate.effect.changes_hull and made.evidence > ours:
            # With some of these coefficients beside it, the cause of the others may be likelier.
            pair = with_fewer_coefficients(problem, kept, one.candidate)
            ours = ours if pair is None else max(ours, pair.evidence)
        return RivalFit(one.candidate, made, made.evidence - ours)

    others = [other for other in library if other.key not in taken]
    others = [one for one in others if _may_stand_in(problem, beside, candidate, one)]
    rivals = over(instead, others)
    rivals.sort(key=lambda one: -one.gain)
    # How far behind the others are does not matter to the digit.
    rivals[: JUDGING.fitted_rivals] = over(settled_in, rivals[: JUDGING.fitted_rivals])
    rivals.sort(key=lambda one: -one.gain)
    if not is_doubted_where(problem, kept, index):
        # What may stand in for the candidate, and explains no more, is the same in other words.
        rivals = [one for one in rivals if one.gain > JUDGING.unresolved_evidence or not _is_doubted(problem, one)]
    against = none + sum(exp(min(one.gain, 50.0)) for one in rivals)
    return RivalComparison(tuple(rivals), 1.0 / (1.0 + against), kept.evidence - bare.evidence)


def _is_doubted(problem: EstimationProblem, one: RivalFit) -> bool:
    return is_doubted_where(problem, one.fit, len(one.fit.candidates) - 1)


def least_gain(problem: EstimationProblem, kept: Fit, index: int, rival: RivalFit) -> float:
    """Return the evidence over that of a candidate from which a rival takes its place [nat].

    A candidate that may stand in for a simpler one by where the vessel was gives way to what explains nearly as much.
    """
    gives_way = is_doubted_where(problem, kept, index) and not _is_doubted(problem, rival)
    return -JUDGING.unresolved_evidence if gives_way else 0.0


def with_both(problem: EstimationProblem, kept: Fit, index: int, rival: Fit) -> Fit:
    """Return a fit with a rival, and beside it what it replaces where that is more likely than not: both may act."""
    both = _beside(problem, kept, index, rival)
    return both if both.evidence - rival.evidence > INFERENCE.prior_odds else rival


def _beside(problem: EstimationProblem, kept: Fit, index: int, rival: Fit) -> Fit:
    candidate, values = kept.candidates[index], kept.values[index]
    # The rival of a step stands beside its level all along.
    others = [k for k, one in enumerate(rival.candidates) if one.key != candidate.key]
    candidates = [*(rival.candidates[k] for k in others), candidate]
    start = [*(rival.values[k] for k in others), values]
    both = fit(problem, candidates, start)
    if not any(one.effect.profiled for one in candidates):
        return both
    # As in `without`: from the profile's hull the way may end on a lower top.
    near = fit(problem, candidates, start, begin=starting_point(problem, rival))
    return max(both, near, key=lambda one: one.evidence)


def without_companions(problem: EstimationProblem, kept: Fit, index: int, standing: RivalComparison) -> RivalComparison:
    """Return how a candidate stands where a rival may act beside it as well as in its place.

    One beside which the candidate is still more likely than not is no rival: both act, whether or not the other has a name. The
    probability is that of all hypotheses that hold the candidate, alone and beside each of the rivals that are near, among
    these and those that hold none, one or two of the rivals.
    """
    candidate = kept.candidates[index]
    near = [
        one
        for one in standing.rivals
        if one.gain > -JUDGING.unresolved_evidence and not same_curve(one.candidate, candidate, 1.0)
    ]
    if not near:
        return standing
    last = len(near[0].fit.candidates) - 1
    both = over(lambda one: _beside(problem, kept, index, one.fit).evidence, near)
    pairs = over(lambda pair: _beside(problem, pair[0].fit, last, pair[1].fit).evidence, list(combinations(near, 2)))
    held = [0.0, *(one - kept.evidence - INFERENCE.prior_odds for one in both)]
    others = [INFERENCE.prior_odds - standing.evidence]
    others += [one.gain for one in standing.rivals if not any(one is each for each in near)]
    # Over the candidate alone: what it and some coefficients come to together is among the hypotheses that hold it.
    others += [one.fit.evidence - kept.evidence for one in near]
    others += [one - kept.evidence - INFERENCE.prior_odds for one in pairs]
    top = max(*held, *others)
    ours, theirs = (sum(exp(one - top) for one in some) for some in (held, others))
    companions = tuple(
        one for one, pair in zip(near, both, strict=True) if pair - one.fit.evidence > INFERENCE.prior_odds
    )
    rivals = tuple(one for one in standing.rivals if not any(one is each for each in companions))
    return replace(standing, rivals=rivals, companions=companions, probability=ours / (ours + theirs))


def _may_stand_in(problem: EstimationProblem, beside: Linearisation, candidate: Candidate, other: Candidate) -> bool:
    """Tell whether another may stand in a candidate's place: what only passes explains nothing that lasts or comes often."""
    if not other.effect.passing:
        return True
    there = replace(other, onset_s=candidate.onset_s, offset_s=candidate.offset_s)
    return passes(problem, there) and stands_out(problem, beside, there)
