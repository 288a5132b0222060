"""The sizes of what was found, with their 95 % intervals; its times have a posterior of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit
from ferryid.diagnose.inference.profile_likelihood import intervals
from ferryid.effects.wording import parameter_word

UNCONFIRMED = "Estimated, not confirmed: "
"""Before the sizes of what was dropped."""


def sizes_text(estimates: Mapping[str, Estimate]) -> str:
    """Return sizes with their 95 % intervals, as a part of a sentence; empty where there is none."""
    parts = []
    for name, one in estimates.items():
        value, low, high = (f"{number:z.{one.digits}f}" for number in (one.value, one.low, one.high))
        unit = "" if one.unit == "-" else f" {one.unit}"
        parts.append(f"{parameter_word(name)} {value}{unit} ({low} to {high})")
    return "; ".join(parts)


def size_estimates(problem: EstimationProblem, kept: Fit, index: int, *, profiled: bool = True) -> dict[str, Estimate]:
    """Return the parameters of a candidate by name, but for its times; those of which nothing is known are left out.

    Parameters
    ----------
    problem
        Of the fit.
    kept, index
        The fit, and which of its candidates.
    profiled
        False gives intervals by standard errors also where the likelihood of an effect is followed, which takes fits.
    """
    candidate = kept.candidates[index]
    error = kept.reported_errors(index)
    estimates = {}
    unreported = candidate.effect.unreported(problem.plain.measurements, kept.values[index])
    followed = intervals(problem, kept, index) if profiled and candidate.effect.profiled and not candidate.times else {}
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
