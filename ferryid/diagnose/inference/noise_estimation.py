"""The likeliest noise of what a hypothesis leaves: of each channel, and of disturbances that all channels share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ferryid.diagnose.inference.kalman import DIFFUSE, predictions_alone
from ferryid.diagnose.inference.newton_step import newton_step
from ferryid.diagnose.inference.noise_model import (
    NoiseModel,
    disturbance_columns,
    integrals_of,
    likelihood,
    make_whitening_filter,
    measured_sizes,
    stride_s,
)
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.effect import Process
from ferryid.effects.force_model import ForceModel
from ferryid.side_by_side import over
from ferryid.types import Floats

GROUPS = (0, 0, 1)
"""Channels that share a noise: north and east (or surge and sway), and the turn."""
START_SHARES = ((0.05, 1.0, 0.03), (0.05, 3.0, 0.1), (0.5, 6.0, 0.1), (0.02, 2.0, 0.5))
"""Where the search for a channel's noise begins: white error, as a share of all; time constant of the coloured, in steps; and
disturbance, as a share of the acceleration left over."""
DIFFERENCE_STEP = 1e-4
"""Move of a parameter's logarithm by which a slope is found."""
FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-2, 1e-5, 1e5
"""Damping of the steps of the search for the likeliest noise, as a share of the information."""
LONGEST_STEP = 2.0
"""Longest such step, in a parameter's logarithm."""
SEARCHED_STEPS = 3
"""Steps of a search before it may be given up: the first ones come from far away."""
SUFFICIENT_GAIN, SCREENED_GAIN = 1e-3, 0.1
"""Gain in log-likelihood of a step that is worth another: of a search, and of one that is followed by a search."""

Predictions = tuple[Floats, Floats]
"""Of each of p noises: whitened prediction errors, and the logarithms of their standard deviations, both of shape (p, N)."""
Predicting = Callable[[Floats], Predictions]
"""Returns the predictions of the noises that the logarithms of parameters, shape (p, k), stand for."""


def fit_noise(steps: Windows, gaps: Floats, initial: NoiseModel | None = None) -> NoiseModel:
    """Return the noise that gaps have if each channel has its own, by maximum likelihood.

    Parameters
    ----------
    steps, gaps
        The trial's, and what a hypothesis leaves.
    initial
        Noise to start from; else the search starts at several places.
    """
    h, integrals = stride_s(steps), integrals_of(steps)
    scale = measured_sizes(steps)
    channels = np.empty((gaps.shape[1], 5))
    for group in sorted(set(GROUPS)):
        own = [j for j, g in enumerate(GROUPS) if g == group]
        # Channels that share a noise are series of one channel.
        left, size = np.ascontiguousarray(gaps[:, None, own]), scale[own].mean(keepdims=True)

        def predictions(z: Floats, left: Floats = left, size: Floats = size) -> Predictions:
            whitened, log_scales = predictions_alone(size, np.exp(z), integrals, h, left, steps.ends)
            return whitened.reshape(len(z), -1), log_scales.reshape(len(z), -1)

        rms = float(np.sqrt(np.mean(gaps[:, own] ** 2)))
        # The second difference of a position has six times the variance of its errors, the first of a velocity's twice.
        error = rms * h**integrals / (2.4 if integrals == 2 else 1.4)
        # The likelihood has several tops: the same roughness may be of short errors, of long ones or of pushes.
        begin = [
            np.log([white * error, error, error_s * h, pushed * rms, 10.0 * h])
            for white, error_s, pushed in START_SHARES[: 1 if initial else None]
        ]
        begin += [np.log(initial.channels[own[0]])] if initial else []

        def searched(start: Floats, predictions: Predicting = predictions) -> tuple[float, Floats]:
            return _most_likely(predictions, start, _bounds(start, h))

        # One after the other: threads of such short searches wait for the interpreter as long as they save.
        _, best = min(map(searched, begin), key=lambda end: end[0])
        channels[own] = np.exp(best)
    return NoiseModel(channels)


def fit_noise_with(
    steps: Windows,
    gaps: Floats,
    channel_noise: NoiseModel,
    processes_of: Callable[[Floats], tuple[Process, ...]],
    start: Floats,
    force_model: ForceModel,
    minimum: float = -np.inf,
) -> tuple[NoiseModel, Floats, Floats, float]:
    """Return the noise that gaps have if disturbances push beside each channel's own noise.

    Parameters
    ----------
    steps, gaps
        The trial's, and what a hypothesis leaves.
    channel_noise
        The noise to begin with; its processes stay as they are.
    processes_of
        The further processes, from positive parameters.
    start
        These to begin with, shape (k,).
    force_model
        In which all push.
    minimum
        Logarithm of the likelihood that must come within reach, or the search over all parameters is left out.

    Returns
    -------
    NoiseModel
        With the processes.
    ndarray
        The parameters, shape (k,).
    ndarray
        Standard deviations of their logarithms, shape (k,).
    float
        Logarithm of the likelihood.
    """
    h = stride_s(steps)
    first = [GROUPS.index(group) for group in sorted(set(GROUPS))]

    def noise(z: Floats) -> NoiseModel:
        own, parameters = np.exp(z[: 5 * len(first)].reshape(-1, 5)), np.exp(z[5 * len(first) :])
        return NoiseModel(own[list(GROUPS)], (*channel_noise.processes, *processes_of(parameters)), force_model)

    # How a disturbance pushes does not depend on its parameters.
    responses = disturbance_columns(
        NoiseModel(channel_noise.channels, (*channel_noise.processes, *processes_of(start)), force_model), steps
    )

    def cost(z: Floats) -> float:
        return -likelihood(noise(z), steps, gaps, responses)

    def predicted(z: Floats) -> Predictions:
        ready = make_whitening_filter(noise(z), steps, responses)
        return ready.white(gaps), ready.log_scales.reshape(-1)

    def predictions(every: Floats) -> Predictions:
        whitened, log_scales = zip(*over(predicted, every), strict=True)
        return np.array(whitened), np.array(log_scales)

    channels = np.log(channel_noise.channels[first])
    begin = np.concatenate([channels.ravel(), np.log(start)])
    bounds = [pair for row in channels for pair in _bounds(row, h)]
    bounds += [(float(one) - 5.0, float(one) + 4.0) for one in np.log(start)]
    # What gives way to a disturbance first is the size of each channel's own coloured error and push.
    first_searched = [5 * group + size for group in range(len(first)) for size in (1, 3)]
    first_searched += range(len(begin) - len(start), len(begin))

    def predictions_of_first(every: Floats) -> Predictions:
        full = np.repeat(begin[None], len(every), axis=0)
        full[:, first_searched] = every
        return predictions(full)

    z = begin.copy()
    best, z[first_searched] = _most_likely(
        predictions_of_first,
        begin[first_searched],
        [bounds[k] for k in first_searched],
        most=INFERENCE.screening_iterations,
        wanted=INFERENCE.screening_gain - minimum,
        sufficient=SCREENED_GAIN,
    )
    if -best > minimum - INFERENCE.screening_gain:
        best, z = _most_likely(predictions, z, bounds)
    # What is not worth it need not be known.
    width = _widths(cost, z, len(start), best) if -best > minimum else np.full(len(start), np.inf)
    return noise(z), np.exp(z[len(z) - len(start) :]), width, -best


def excerpt(steps: Windows) -> Windows:
    """Return the steps from which noise is learnt: all of a short log, evenly spread stretches of a long one."""
    n = len(steps.starts)
    if n <= INFERENCE.noise_steps:
        return steps
    length = INFERENCE.noise_steps // INFERENCE.noise_stretches
    runs: list[tuple[int, int]] = []
    rows: list[int] = []
    for middle in np.linspace(0.0, n, 2 * INFERENCE.noise_stretches + 1)[1::2]:
        first, end = int(middle) - length // 2, int(middle) + length // 2
        for a, b in steps.runs:
            own = range(max(a, first), min(b, end))
            if len(own) > DIFFUSE:
                runs.append((len(rows), len(rows) + len(own)))
                rows += own
    at = np.array(rows, dtype=np.int64)
    return replace(steps, starts=steps.starts[at], measured=steps.measured[at], runs=tuple(runs))


def _widths(cost: Callable[[Floats], float], z: Floats, k: int, best: float) -> Floats:
    """Return standard deviations of the last k of the parameters, with the rest as they are; infinite where a cost is flat."""
    if k == 0:
        return np.empty(0)
    d = 0.05
    moves = np.eye(len(z))[len(z) - k :] * d
    bend = np.empty((k, k))
    for i in range(k):
        bend[i, i] = (cost(z + moves[i]) + cost(z - moves[i]) - 2.0 * best) / d**2
    for i in range(k):
        for j in range(i):
            corner = cost(z + moves[i] + moves[j]) + cost(z - moves[i] - moves[j]) - 2.0 * best
            bend[i, j] = bend[j, i] = 0.5 * (corner / d**2 - bend[i, i] - bend[j, j])
    known = np.flatnonzero(np.diag(bend) > 0.0)
    inverse = np.linalg.pinv(bend[np.ix_(known, known)], hermitian=True)
    width = np.full(k, np.inf)
    width[known] = np.sqrt(np.maximum(np.diag(inverse), 1.0 / np.diag(bend)[known]))
    return width


def _most_likely(
    predictions: Predicting,
    start: Floats,
    bounds: list[tuple[float, float]],
    most: int = 60,
    wanted: float = np.inf,
    sufficient: float = SUFFICIENT_GAIN,
) -> tuple[float, Floats]:
    """Return the least cost nearby, minus the logarithm of the likelihood, and its parameters, shape (k,), by Fisher's scoring.

    What the likelihood's second derivatives are on average follows from first ones of the predictions, which are found by
    differences (Harvey 1989, section 3.4); steps are damped as by Levenberg and Marquardt.

    Parameters
    ----------
    predictions
        Of the parameters, several at once.
    start, bounds
        Where the search begins, shape (k,), and the limits of each parameter.
    most
        Steps at most.
    wanted
        Cost above which nobody asks: a search that would stay above it, if each step gained as many times what it promises as
        `INFERENCE.linearisation_factor`, ends where it is.
    sufficient
        Gain of a step that is worth another.
    """
    low, high = np.array(bounds).T
    z, damping = np.clip(start, low, high), FIRST_DAMPING
    (whitened,), (log_scales,) = predictions(z[None])
    cost = 0.5 * float(whitened @ whitened) + float(log_scales.sum())
    for count in range(most):
        moves = np.where(z + DIFFERENCE_STEP <= high, DIFFERENCE_STEP, -DIFFERENCE_STEP)
        near_whitened, near_scales = predictions(z + np.diag(moves))
        by_whitened = (near_whitened - whitened) / moves[:, None]
        by_scale = (near_scales - log_scales) / moves[:, None]
        slope = by_whitened @ whitened + by_scale.sum(axis=1)
        # A prediction moves by its whitened error's move and by what its scale's move hides of that.
        moved = by_whitened + by_scale * whitened
        information = moved @ moved.T + 2.0 * by_scale @ by_scale.T
        # What nothing shows stays where it is.
        scale = np.maximum(np.diag(information), 1e-9 * max(float(np.diag(information).max()), 1e-12))
        gained = 0.0
        reach_low, reach_high = np.maximum(low - z, -LONGEST_STEP), np.minimum(high - z, LONGEST_STEP)
        if count >= SEARCHED_STEPS and cost > wanted:
            step = newton_step(information + LEAST_DAMPING * np.diag(scale), slope, reach_low, reach_high)
            promised = -float(slope @ step + 0.5 * step @ information @ step)
            if cost - INFERENCE.linearisation_factor * promised > wanted:
                break
        while damping < LARGEST_DAMPING:
            new = z + newton_step(information + damping * np.diag(scale), slope, reach_low, reach_high)
            (new_whitened,), (new_scales,) = predictions(new[None])
            new_cost = 0.5 * float(new_whitened @ new_whitened) + float(new_scales.sum())
            if new_cost < cost:
                gained = cost - new_cost
                z, whitened, log_scales, cost = new, new_whitened, new_scales, new_cost
                damping = max(damping / 10.0, LEAST_DAMPING)
                break
            damping *= 10.0
        if gained < sufficient:
            break
    return cost, z


def _bounds(start: Floats, h: float) -> list[tuple[float, float]]:
    times = (float(np.log(0.5 * h)), float(np.log(INFERENCE.longest_memory * h)))
    return [(one - 12.0, one + 6.0) if k not in (2, 4) else times for k, one in enumerate(start.tolist())]
