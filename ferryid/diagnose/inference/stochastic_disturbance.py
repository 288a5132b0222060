"""Disturbances that nobody measured and that come and go by chance: gusts and waves, as states of the filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.noise_estimation import fit_noise, fit_noise_with
from ferryid.diagnose.inference.noise_model import NoiseModel, likelihood, stride_s
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.effect import Process
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats

START_STRENGTHS, START_FREQUENCIES = (0.3, 1.0), (0.5, 0.7, 1.0, 1.4, 2.0)
"""Where the search begins, as shares of the usual ones; from hardly anything nothing leads on."""


@dataclass(frozen=True)
class DisturbanceState:
    """A disturbance with its parameters, the standard deviations of their logarithms, and the evidence for it."""

    candidate: Candidate
    values: Floats
    widths: Floats
    gain: float

    @property
    def known(self) -> frozenset[str]:
        """Names of the parameters that the log tells."""
        named = zip(self.candidate.parameters, self.widths.tolist(), strict=True)
        return frozenset(one.name for one, width in named if width < INFERENCE.vague_log)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Parameters with their 95 % intervals, which are even in the logarithm."""
        away = np.exp(
            1.96 * np.minimum(np.hypot(self.widths, self.candidate.effect.formula_error), INFERENCE.widest_log)
        )
        low, high = self.values / away, self.values * away
        return {
            one.name: Estimate(value, max(a, one.low), min(b, one.high), one.unit)
            for one, value, a, b in zip(
                self.candidate.parameters, self.values.tolist(), low.tolist(), high.tolist(), strict=True
            )
        }


def fit_disturbances(
    problem: EstimationProblem,
    made: Fit,
    candidates: Sequence[Candidate],
    undisturbed: ForceModel,
    minimum_gain: float = INFERENCE.disturbance_gain,
    *,
    initial: Sequence[DisturbanceState] = (),
) -> tuple[EstimationProblem, tuple[DisturbanceState, ...]]:
    """Return the trial with the disturbances in its filter that what a fit leaves speaks for, and these.

    Each is weighed by its likelihood, at its most likely parameters and noise, less Schwarz's penalty for its parameters and
    what its prior odds are lower where the log was recorded.

    Parameters
    ----------
    problem
        Its filter is learnt anew.
    made
        What has been found.
    candidates
        Disturbances that the measurements can show.
    undisturbed
        The plain force model without any of them.
    minimum_gain
        Evidence that the first of them must show: what else explains as much is looked at before it.
    initial
        What they were beside another fit: where the search begins.
    """
    force_model = fitted_force_model(problem.plain, made)
    steps = problem.excerpt
    gaps = steps.gap(force_model)
    noise = fit_noise(steps, gaps, problem.filter)
    before = {state.candidate.key: [state.values] for state in initial}
    best = likelihood(noise, steps, gaps)
    states: list[DisturbanceState] = []
    left = list(candidates)
    while left:
        required_gain = INFERENCE.disturbance_gain if states else minimum_gain
        tried = []
        for candidate in left:
            assert candidate.effect.unsteady is not None
            processes = candidate.effect.unsteady(force_model)
            if not processes(_usual_values(candidate)):
                continue
            places = before.get(candidate.key, _starts(candidate))
            start = max(places, key=lambda one: _log_likelihood(steps, gaps, noise, processes(one), force_model))
            penalty = 0.5 * len(start) * log(len(steps.starts)) + candidate.log_alternatives
            fitted_noise, values, widths, after = fit_noise_with(
                steps, gaps, noise, processes, start, force_model, best + penalty + required_gain
            )
            gain = after - best - penalty
            if _is_identified(candidate, values, widths, stride_s(steps)):
                tried.append((gain, fitted_noise, DisturbanceState(candidate, values, widths, gain), after))
        if not tried:
            break
        gain, fitted_noise, state, after = max(tried, key=lambda one: one[0])
        if gain < required_gain:
            break
        noise, best = fitted_noise, after
        states.append(state)
        left.remove(state.candidate)
    plain = undisturbed
    for state in states:
        # On average, too, they may do something.
        plain = state.candidate.act(plain, state.values)
    return replace(problem.with_noise_of(made), filter=noise, plain=plain), tuple(states)


def _is_identified(candidate: Candidate, values: Floats, widths: Floats, step_s: float) -> bool:
    """Tell whether a disturbance is known: how fast it is, how strong on one axis at least, and its moment if it has one.

    A position's error in a narrow band looks like a force along it, but turns nothing; what is faster than the filter's steps
    was not seen by it; and waves slower than any sea are none.
    """
    band = np.array([parameter.unit == "Hz" for parameter in candidate.parameters])
    possible = all(
        one.low <= value <= one.high for one, value in zip(candidate.parameters, values.tolist(), strict=True)
    )
    if not possible or (values[band] * step_s > INFERENCE.fastest_share).any():
        return False
    strength = _strengths(candidate)
    turning = np.array([parameter.unit == "N·m" for parameter in candidate.parameters])
    return bool(
        (widths[~strength | turning] < INFERENCE.vague_log).all() and (widths[strength] < INFERENCE.vague_log).any()
    )


def _strengths(candidate: Candidate) -> NDArray[np.bool_]:
    return np.array([parameter.name.endswith("std") for parameter in candidate.parameters])


def _log_likelihood(
    steps: Windows, gaps: Floats, noise: NoiseModel, processes: tuple[Process, ...], force_model: ForceModel
) -> float:
    return likelihood(NoiseModel(noise.channels, (*noise.processes, *processes), force_model), steps, gaps)


def _starts(candidate: Candidate) -> list[Floats]:
    """Return parameters to begin with: strengths, and frequencies where there is one, about the usual ones."""
    usual = _usual_values(candidate)
    strength = _strengths(candidate)
    band = np.array([parameter.unit == "Hz" for parameter in candidate.parameters])
    bands = START_FREQUENCIES if band.any() else (1.0,)
    return [usual * np.where(strength, a, np.where(band, b, 1.0)) for a in START_STRENGTHS for b in bands]


def _usual_values(candidate: Candidate) -> Floats:
    return np.array([parameter.size for parameter in candidate.parameters])
