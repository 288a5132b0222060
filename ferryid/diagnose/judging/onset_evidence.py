"""Whether a force that set in, or ended, within a log is known beside a hull that was estimated from the same log.

A hull that nobody knows can stand in for most of what acts all along: a weak propeller, for one, is less drag. It does not
change from one moment to the next. What does is known by that, where it is large, happens once, and is not the water or the
hull that changed. Nor is it the actuator that changed where it works in another regime just then.
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
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.actuator_force import along, index_of, speed_along
from ferryid.effects.force_model import Measurements
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Flags, Floats


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


def regime_of_span(measurements: Measurements, candidate: Candidate) -> str:
    """Return how an actuator works in the span of a candidate as it does at no other time, as a clause; else nothing.

    A propeller that is reversed at speed, or runs at a speed far above any other, may give another thrust than its curve
    says without being weaker than before. A regime is a direction of the force with a velocity through the water along it.
    It is of the span alone where the actuator pushes that way in less than `EFFECTS.acting_share` of the log outside of it,
    or where the velocity is beyond those out there, rest included, by `JUDGING.regime_margin` of the largest: what a
    weak thruster itself does to the speed is less. It has to hold for `JUDGING.regime_share` of the squared force in the span.
    """
    if not candidate.times or candidate.instance not in measurements.names:
        return ""
    usable, k = measurements.usable, index_of(measurements, candidate.instance)
    push, speed, t = along(measurements, k)[usable], speed_along(measurements, k)[usable], measurements.t[usable]
    works = np.abs(push) > EFFECTS.acting_force * float(np.max(np.abs(push), initial=0.0))
    within = (t >= candidate.onset_s) & (t < candidate.offset_s)
    if not (works & within).any():
        return ""
    new = np.zeros(len(t), dtype=bool)
    for way in (push > 0.0, push < 0.0):
        here, elsewhere = works & way & within, works & way & ~within
        new |= here & _beyond(speed, elsewhere, float(np.max(np.abs(speed[works]))))
    power = push**2
    if power[new].sum() < JUDGING.regime_share * power[works & within].sum():
        return ""
    pushes, moves = float(power[new] @ np.sign(push[new])), float(np.median(speed[new]))
    ways = ["ahead" if one > 0.0 else "astern" for one in (pushes, moves)]
    return f"in its span {candidate.instance} pushes {ways[0]} at {abs(moves):.2g} m/s {ways[1]} through the water"


def _beyond(speed: Floats, rows: Flags, largest: float) -> Flags:
    """Return which speeds are far from those of some rows; all where there are too few of these."""
    if np.mean(rows) < EFFECTS.acting_share:
        return np.ones(len(speed), dtype=bool)
    low, high = np.quantile(speed[rows], [EFFECTS.acting_share, 1.0 - EFFECTS.acting_share])
    margin = JUDGING.regime_margin * largest
    return np.asarray((speed < min(low, 0.0) - margin) | (speed > max(high, 0.0) + margin))


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
