"""Intervals where a posterior is no ellipse: one parameter is held ever farther away, and all others follow it.

Of a load that is aboard all along, mass times place is known far better than either, and the hull takes up what mass is too
much: along that ridge the posterior bends, and falls on one side only. Its curvature at the top tells neither.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fit, starting_point
from ferryid.diagnose.inference.onset_estimation import replace_candidate
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.effect import HELD
from ferryid.types import Floats

FIRST_STEP, STEP_GROWTH = 0.5, 1.6
"""First step, in standard deviations at the top, and by how much each is longer than the one before."""
LARGEST_FALL, MOST_REFINEMENTS = 3.0, 8
"""Fall of the logarithm of the evidence between two neighbours that calls for one between them, and how often at most."""
QUANTILES = 41
"""Parts of equal probability into which what is left free is cut."""


def intervals(problem: EstimationProblem, kept: Fit, index: int) -> dict[str, tuple[float, float]]:
    """Return 95 % intervals of a candidate's parameters by name, along the ridge of its posterior.

    Parameters
    ----------
    problem
        The log.
    kept
        What was found.
    index
        Of a candidate whose effect has a profiled parameter.
    """
    candidate = kept.candidates[index]
    names = [one.name for one in candidate.parameters]
    place = names.index(candidate.effect.profiled)
    own = candidate.parameters[place]
    top = float(kept.values[index][place])
    first = max(FIRST_STEP * float(kept.errors(index)[place]), 0.01 * own.size)

    def conditional_fit(value: float, beside: Fit) -> tuple[float, Fit]:
        still = replace(own, size=HELD, neutral=value, start=value)
        parameters = tuple(still if k == place else one for k, one in enumerate(candidate.parameters))
        start = list(beside.values)
        start[index] = np.where(np.arange(len(names)) == place, value, beside.values[index])
        candidates = replace_candidate(kept.candidates, index, replace(candidate, parameters=parameters))
        made = fit(problem, candidates, start, begin=starting_point(problem, beside))
        return made.evidence - 0.5 * ((value - own.neutral) / own.size) ** 2, made

    found = {top: conditional_fit(top, kept)}

    def likely() -> float:
        """Return the evidence below which a value is not likely."""
        return max(evidence for evidence, _ in found.values()) - INFERENCE.profile_drop * INFERENCE.posterior_factor**2

    for side in (-1.0, 1.0):
        value, step, last = top, first, found[top][1]
        # Until nothing lies beyond, or nothing that is likely; the likeliest may lie at the end of what is possible itself.
        while (further := min(max(value + side * step, own.low), own.high)) != value:
            value = further
            found[value] = conditional_fit(value, last)
            if found[value][0] < likely():
                break
            step, last = STEP_GROWTH * step, found[value][1]
    for _ in range(MOST_REFINEMENTS):
        falls = [
            (abs(found[a][0] - found[b][0]), a, b)
            for a, b in pairwise(sorted(found))
            if max(found[a][0], found[b][0]) > likely()
        ]
        fall, a, b = max(falls)
        if fall < LARGEST_FALL:
            break
        higher = max(found[a], found[b], key=lambda one: one[0])[1]
        found[0.5 * (a + b)] = conditional_fit(0.5 * (a + b), higher)
    from scipy.interpolate import PchipInterpolator  # takes half a second to import: only where it is needed

    values = np.array(sorted(found))
    log_weights = np.array([found[value][0] for value in values.tolist()]) / INFERENCE.posterior_factor**2
    fine = np.linspace(values[0], values[-1], 50 * len(values))
    weights = np.exp(PchipInterpolator(values, log_weights)(fine) - log_weights.max())
    cut = ndtri((np.arange(QUANTILES) + 0.5) / QUANTILES)
    ends = {}
    for k, name in enumerate(names):
        if k == place:
            ends[name] = _interval(fine, weights)
            continue
        middle = np.array([found[value][1].values[index][k] for value in values.tolist()])
        spread = np.array([found[value][1].reported_errors(index)[k] for value in values.tolist()])
        spots = np.interp(fine, values, middle)[:, None] + np.interp(fine, values, spread)[:, None] * cut
        ends[name] = _interval(spots.ravel(), np.repeat(weights, QUANTILES))
    return ends


def _interval(values: Floats, weights: Floats) -> tuple[float, float]:
    order = np.argsort(values)
    shares = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, high = np.interp([0.025, 0.975], shares / weights.sum(), values[order]).tolist()
    return low, high
