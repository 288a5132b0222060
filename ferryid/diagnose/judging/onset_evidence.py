"""Whether a force that set in, or ended, within a log is known beside a hull that was estimated from the same log.

A hull that nobody knows can stand in for most of what acts all along: a weak propeller, for one, is less drag. It does not
change from one moment to the next. What does is known by that, where it is large, happens once, and is not the water or the
hull that changed.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, log

import numpy as np

from ferryid.diagnose.inference.estimation import (
    HULL_DIFFERENCE,
    Candidate,
    EstimationProblem,
    Fit,
    fit,
    starting_point,
    without,
)
from ferryid.diagnose.inference.folds import block_s
from ferryid.diagnose.inference.onset_estimation import is_brief, largest_gain, lasts_s, linearise, replace_candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects import effects


def sets_in(problem: EstimationProblem, kept: Fit, index: int) -> bool:
    """Return whether a candidate of a fit sets in or ends as an event that no hull, however far off, explains.

    It must not be there for as long as a fit is judged on. Its evidence must be `INFERENCE.contrast` times that of any
    effect, and that which any other span of the same effect adds beside it: a hull that is off in some manoeuvres asks for more
    than one. It must exceed by the odds of an effect that of the same effect all along, that of a damping that changed
    then, as over a bank or with something caught on the hull, and that of a thrust curve of another shape where the thruster
    may have been set to another level then; each also beside a hull whose formula is off in the manoeuvres of the span.
    """
    candidate = kept.candidates[index]
    if not candidate.times or candidate.effect.passing or is_brief(problem, candidate):
        return False
    # What it is compared with must have been seen for as long as a fit is judged on.
    whole = replace(candidate, onset_s=0.0, offset_s=inf)
    if lasts_s(problem, whole) - lasts_s(problem, candidate) < block_s(problem.windows):
        return False
    bare = without(problem, kept, index)
    own = kept.evidence - bare.evidence
    if own < INFERENCE.contrast * INFERENCE.prior_odds:
        return False
    fits = [bare]
    for other in (whole, *_changed_damping(problem, candidate), *_by_level(problem, candidate)):
        values = (*kept.values[:index], other.start, *kept.values[index + 1 :])
        begin = starting_point(problem, kept)
        tried = (
            fit(problem, replace_candidate(kept.candidates, index, other), values, begin=one) for one in (begin, None)
        )
        fits.append(max(tried, key=lambda one: one.evidence))
    if kept.evidence - max(one.evidence for one in fits) < INFERENCE.prior_odds:
        return False
    if kept.evidence - max(_evidence_of_other_hull(problem, one, candidate) for one in fits) < INFERENCE.prior_odds:
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


def _by_level(problem: EstimationProblem, candidate: Candidate) -> list[Candidate]:
    """Return the form of an effect that goes with how hard its actuator works, where there is one."""
    effect = candidate.effect.by_level
    return [] if effect is None else [Candidate.of(effect, candidate.instance, problem.plain.measurements.profile)]


def _evidence_of_other_hull(problem: EstimationProblem, rest: Fit, candidate: Candidate) -> float:
    """Return the log evidence of a fit whose hull has other coefficients in the span of a candidate that it lacks.

    A formula of the hull that holds on average is off in some manoeuvres, and a span may be one of these. Each coefficient
    differs by chance, by `INFERENCE.formula_scatter` of itself; linearised, which the damping is.
    """
    linear = linearise(problem, rest, starting_point(problem, rest))
    hull = linear.force_model.hull
    free = np.flatnonzero((problem.hull_spread > 0.0) & (hull != 0.0))
    step = HULL_DIFFERENCE * np.abs(hull[free])
    changes = problem.steps.hull_changes(linear.force_model, free, step) / HULL_DIFFERENCE * INFERENCE.formula_scatter
    times = problem.steps.middle_s
    changes[(times < candidate.onset_s) | (times >= candidate.offset_s)] = 0.0
    added = problem.whitening_filter.white(changes)
    shared = linear.slopes.T @ added
    # What hull and effects of the whole log make up for is not theirs; the prior of what differs is of unit variance.
    A = added.T @ added - shared.T @ linear.inverse @ shared + np.eye(len(free))
    pull = added.T @ linear.left
    gained = 0.5 * float(pull @ np.linalg.solve(A, pull)) - 0.5 * float(np.linalg.slogdet(A)[1])
    return rest.evidence + gained - len(candidate.times) * log(len(problem.windows.starts))
