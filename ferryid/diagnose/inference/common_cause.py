"""One cause of many errors of the hull, such as fouling or a load, against coefficients that are wrong each by itself.

A hull model is never right: of fouling, one or two coefficients are off that fouling does not touch, and to do without it all
the others have to be off beside these. So a cause is weighed with such coefficients beside it, if they are fewer than without.
"""

from __future__ import annotations

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, choose_parameters, fit
from ferryid.effects.effect import HELD


def with_fewer_coefficients(problem: EstimationProblem, made: Fit, coefficients: Candidate) -> Fit | None:
    """Return a fit with some coefficients of the hull free beside its effects, fewer than free ones of a candidate.

    Parameters
    ----------
    problem
        The log.
    made
        Of the cause.
    coefficients
        A candidate that is errors of single coefficients, as chosen without the cause.

    Returns
    -------
    Fit or None
        None where as many are wrong beside the cause.
    """
    effect, profile = coefficients.effect, problem.plain.measurements.profile
    beside = choose_parameters(problem, made, Candidate.of(effect, coefficients.instance, profile))
    if _free(beside) >= _free(coefficients):
        return None
    return fit(problem, (*made.candidates, beside), (*made.values, beside.start))


def _free(candidate: Candidate) -> int:
    return sum(one.size > HELD for one in candidate.parameters)
