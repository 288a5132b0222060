"""Whether an effect that acts all along is known beside a hull that was estimated from the same log.

A hull that is estimated from the log that shows an effect takes up what its 26 coefficients can of it. A true hull has more:
lift, drag of drift and turning, side forces of its propeller, lopsidedness. Each of them is a force that the motion through
the water decides. Here all products of the velocities up to the third order, and a constant, are free on each axis beside the
hull; what an effect gains then is not the hull's. What else is missing from the model, the same log shows by what other effects
gain beside this one: it has to stand out against them as an event does (`ferryid.diagnose.judging.onset_evidence`).

The gain is that of linear least squares at either estimate, with the effect and without it, which is exact where prediction
errors are linear in what is free.

References
----------
Frisch and Waugh (1933), Partial time regressions as compared with individual trends.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    Fit,
    effect_slopes,
    fitted_force_model,
    without,
)
from ferryid.diagnose.inference.motion_responses import motion_responses
from ferryid.diagnose.inference.search import largest_gain_beside
from ferryid.diagnose.inference.thresholds import INFERENCE


def beyond_any_hull(
    problem: EstimationProblem, kept: Fit, index: int, library: Sequence[Candidate], nearest: float = -inf
) -> bool:
    """Return whether a candidate of a fit that acts all along is none of what a hull, however far off, could be.

    Its evidence must be `INFERENCE.contrast` times that of any effect, and that of every other effect, whether the fit has it
    or not; it must be ahead of any other in its place by the odds of an effect, and gain as much where any force of the motion
    is free. How strong an actuator is shows by masses and damping alone, which nobody knows.

    Parameters
    ----------
    problem, kept, index
        As of `gain_beside_motion`.
    library
        Every candidate.
    nearest
        Evidence of the best other candidate in its place over it [nat].
    """
    candidate = kept.candidates[index]
    if candidate.times or candidate.effect.scales or nearest > -INFERENCE.prior_odds:
        return False
    own = [kept.evidence - without(problem, kept, i).evidence for i in range(len(kept.candidates))]
    others = [one for i, one in enumerate(own) if i != index]
    if own[index] < INFERENCE.contrast * max([INFERENCE.prior_odds, *others]):
        return False
    if gain_beside_motion(problem, kept, index) < INFERENCE.prior_odds:
        return False
    return own[index] > INFERENCE.contrast * largest_gain_beside(problem, kept, library)


def gain_beside_motion(problem: EstimationProblem, kept: Fit, index: int) -> float:
    """Return the log-likelihood that a candidate of a fit gains where any force of the motion is free beside it [nat].

    Parameters
    ----------
    problem
        With the noise that the fit leaves.
    kept
        The fit, with its hull.
    index
        Of the candidate.
    """
    return 0.5 * (_left(problem, without(problem, kept, index)) - _left(problem, kept))


def _left(problem: EstimationProblem, made: Fit) -> float:
    """Return the least cost of a hypothesis beside any force of the motion: squared errors, and departures from the prior."""
    errors = problem.white(fitted_force_model(problem.plain, made))
    every = [one for candidate in made.candidates for one in candidate.parameters]
    neutral, size = (np.array([getattr(one, name) for one in every]) for name in ("neutral", "size"))
    values = np.concatenate([*made.values, np.empty(0)])
    moves = problem.hull_spread > 0.0
    of_hull = np.where(moves, (made.hull - problem.plain.hull) / np.where(moves, problem.hull_spread, 1.0), 0.0)
    of_motion = motion_responses(problem, made)
    hull_slopes = problem.hull_slopes(fitted_force_model(problem.plain, made), made.hull)
    slopes = np.hstack([hull_slopes, effect_slopes(problem, made), of_motion])
    departed = np.concatenate([of_hull, (values - neutral) / size, np.zeros(of_motion.shape[1])])
    step = -np.linalg.solve(slopes.T @ slopes + np.eye(len(departed)), slopes.T @ errors + departed)
    return float(np.sum((errors + slopes @ step) ** 2) + np.sum((departed + step) ** 2))
