"""The sizes of what was found, with their 95 % intervals; its times have a posterior of their own."""

from __future__ import annotations

from dataclasses import replace

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit
from ferryid.diagnose.inference.profile_likelihood import intervals


def size_estimates(problem: EstimationProblem, kept: Fit, index: int) -> dict[str, Estimate]:
    """Return the parameters of a candidate by name, but for its times; those of which nothing is known are left out."""
    candidate = kept.candidates[index]
    error = kept.reported_errors(index)
    estimates = {}
    unreported = candidate.effect.unreported(problem.plain.measurements, kept.values[index])
    followed = intervals(problem, kept, index) if candidate.effect.profiled and not candidate.times else {}
    for parameter, value, spread in zip(candidate.parameters, kept.values[index].tolist(), error.tolist(), strict=True):
        made = Estimate.normal(value, spread, parameter.unit, parameter.low, parameter.high)
        if parameter.name in followed:
            low, high = followed[parameter.name]
            made = replace(made, low=min(low, value), high=max(high, value))
        least = candidate.effect.minimum_change
        if parameter.name in unreported:
            continue
        if least > 0.0 and made.low < parameter.neutral + least and made.high > parameter.neutral - least:
            continue
        estimates[parameter.name] = made
    return estimates
