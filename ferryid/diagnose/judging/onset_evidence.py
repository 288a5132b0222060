"""Whether a force that set in, or ended, within a log is known beside a hull that was estimated from the same log.

A hull that nobody knows can stand in for most of what acts all along: a weak propeller, for one, is less drag. It does not
change from one moment to the next. What does is known by that, where it is large, happens once, and is not the water or the
hull that changed.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit, starting_point, without
from ferryid.diagnose.inference.folds import block_s
from ferryid.diagnose.inference.onset_estimation import is_brief, largest_gain, lasts_s, linearise, replace_candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects import effects


def sets_in(problem: EstimationProblem, kept: Fit, index: int) -> bool:
    """Return whether a candidate of a fit sets in or ends as an event that no hull, however far off, explains.

    It must not be there for as long as a fit is judged on. Its evidence must be `INFERENCE.contrast` times that of any
    effect, and that which any other span of the same effect adds beside it: a hull that is off in some manoeuvres asks for more
    than one. It must exceed by the odds of an effect that of the same effect all along, and that of a damping that changed
    then, as over a bank or with something caught on the hull.
    """
    candidate = kept.candidates[index]
    if not candidate.times or candidate.effect.passing or is_brief(problem, candidate):
        return False
    # What it is compared with must have been seen for as long as a fit is judged on.
    whole = replace(candidate, onset_s=0.0, offset_s=inf)
    if lasts_s(problem, whole) - lasts_s(problem, candidate) < block_s(problem.windows):
        return False
    own = kept.evidence - without(problem, kept, index).evidence
    if own < INFERENCE.contrast * INFERENCE.prior_odds:
        return False
    others = [whole, *_changed_damping(problem, candidate)]
    for other in others:
        values = (*kept.values[:index], other.start, *kept.values[index + 1 :])
        begin = starting_point(problem, kept)
        near, far = (
            fit(problem, replace_candidate(kept.candidates, index, other), values, begin=one) for one in (begin, None)
        )
        if kept.evidence - max(near.evidence, far.evidence) < INFERENCE.prior_odds:
            return False
    beside = largest_gain(problem, linearise(problem, kept, starting_point(problem, kept)), candidate)
    return own > INFERENCE.contrast * max(beside, 0.0)


def _changed_damping(problem: EstimationProblem, candidate: Candidate) -> list[Candidate]:
    """Return a change of the damping in the span of a candidate, where there are velocities to damp."""
    if candidate.effect.id == "fouling":
        return []
    profile = problem.plain.measurements.profile
    damping = Candidate.of(effects()["fouling"], None, profile)
    return [replace(damping, onset_s=candidate.onset_s, offset_s=candidate.offset_s)]
