"""The noise of what a hypothesis leaves, and the filter that whitens it.

What is left of the accelerations in every step is summed up to what is left of the positions (or velocities): there the error
of the measurement is plain, and a disturbance is what pushes. A Kalman filter that knows the sizes and time constants of both
gives prediction errors that are white and depend on nothing but the past. So a controller that answers a disturbance, or the
error of a measurement, does not bias what is estimated (Ljung 1999, section 13.4); and gusts and waves, which nobody measured,
are states of the filter instead of being forced into the hull's coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, exp, pi, sin

import numpy as np

from ferryid.cached import cached_property
from ferryid.diagnose.inference.kalman import (
    DIFFUSE,
    gains_alone,
    gains_together,
    whitened_alone,
    whitened_together,
)
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.effect import Process
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats


@dataclass(frozen=True)
class NoiseModel:
    """The noise of the steps of a trial.

    Attributes
    ----------
    channels
        As `ferryid.diagnose.inference.kalman.gains` takes it, shape (c, 5).
    processes
        Shared disturbances.
    force_model
        In which these push.
    """

    channels: Floats
    processes: tuple[Process, ...] = ()
    force_model: ForceModel | None = None


@dataclass(frozen=True)
class WhiteningFilter:
    """A filter with its gains for the steps of one trial; see `make_whitening_filter`.

    Attributes
    ----------
    steps
        Those of the trial.
    noise
        Of each channel, shape (c, 5).
    blocks, columns
        Transition of the shared states, shape (s, s), and what a unit of each accelerates, shape (J, c, s).
    gains, spread
        Gains of all steps, shape (J, c, states), and standard deviations of the predictions, shape (J, c).
    """

    steps: Windows
    noise: Floats
    blocks: Floats
    columns: Floats
    gains: Floats = field(repr=False)
    spread: Floats = field(repr=False)

    def white(self, gaps: Floats) -> Floats:
        """Return whitened prediction errors of gaps, shape (J, c) flat, or (J, c, q) with q columns.

        The first steps of every series only tell where it starts, and are zero.
        """
        every = np.ascontiguousarray(gaps, dtype=np.float64).reshape(*gaps.shape[:2], -1)
        integrals, h, runs = integrals_of(self.steps), stride_s(self.steps), self.steps.ends
        if self.blocks.size:
            left = whitened_together(
                every, runs, self.gains, self.spread, self.noise, integrals, self.blocks, self.columns, h
            )
        else:
            left = whitened_alone(every, runs, self.gains, self.spread, self.noise, integrals, h)
        return left.reshape(-1) if gaps.ndim == 2 else left.reshape(-1, every.shape[2])

    @cached_property
    def log_scale(self) -> float:
        """Sum of the logarithms of the standard deviations of all predictions."""
        return float(self.log_scales.sum())

    @cached_property
    def log_scales(self) -> Floats:
        """Logarithms of the standard deviations of all predictions, shape (J, c); zero for those that are not judged."""
        every = np.log(self.spread)
        for first, end in self.steps.runs:
            every[first : min(first + DIFFUSE, end)] = 0.0
        return every


def make_whitening_filter(noise: NoiseModel, steps: Windows, responses: Floats | None = None) -> WhiteningFilter:
    """Return a filter with its gains for some steps. Channels that share no disturbance are filtered by themselves.

    `responses` are those of `disturbance_columns`, where they are known already.
    """
    h, integrals, scale = stride_s(steps), integrals_of(steps), measured_sizes(steps)
    channels = np.ascontiguousarray(noise.channels)
    if noise.processes and noise.force_model is not None:
        columns = np.ascontiguousarray(disturbance_columns(noise, steps) if responses is None else responses)
        blocks, drive = _blocks(noise.processes, h)
        found = gains_together(scale, channels, integrals, blocks, drive, columns, h, steps.ends)
        return WhiteningFilter(steps, channels, blocks, columns, *found)
    found = gains_alone(scale, channels, integrals, h, steps.ends, len(steps.starts))
    return WhiteningFilter(steps, channels, np.empty((0, 0)), np.empty((len(steps.starts), len(channels), 0)), *found)


def disturbance_columns(noise: NoiseModel, steps: Windows) -> Floats:
    """Return the acceleration of every channel by a unit of every state of the shared disturbances, shape (J, c, states)."""
    assert noise.force_model is not None
    columns = []
    for process in noise.processes:
        pushed = replace(noise.force_model, external=noise.force_model.external + process.force)
        column = (steps.gap(pushed) - steps.gap(noise.force_model))[:, :, None]
        columns.append(column)
        if process.frequency_hz > 0.0:
            columns.append(np.zeros_like(column))
    return np.concatenate(columns, axis=2)


def likelihood(noise: NoiseModel, steps: Windows, gaps: Floats, responses: Floats | None = None) -> float:
    """Return the logarithm of the likelihood of gaps, but for a constant; `responses` as in `make_whitening_filter`."""
    ready = make_whitening_filter(noise, steps, responses)
    return -0.5 * float(np.sum(ready.white(gaps) ** 2)) - ready.log_scale


def integrals_of(steps: Windows) -> int:
    """Return 2 for steps of positions, 1 for those of velocities."""
    return 2 if steps.channels[0] else 1


def stride_s(steps: Windows) -> float:
    """Return the time between two steps [s]; a position's weight is two of them long, a velocity's one."""
    return (len(steps.weight) - 1) // integrals_of(steps) * steps.measurements.step_s


def measured_sizes(steps: Windows) -> Floats:
    """Return the root mean square of what is measured in every channel, in position or velocity, shape (c,)."""
    measured = steps.measured_channels
    size = np.sqrt(np.mean(measured**2, axis=0)) * stride_s(steps) ** integrals_of(steps)
    return np.asarray(np.maximum(size, 1e-9))


def _blocks(processes: tuple[Process, ...], h: float) -> tuple[Floats, Floats]:
    """Return transition, and covariances of what enters and of the start, of all processes' states."""
    sizes = [1 if one.frequency_hz == 0.0 else 2 for one in processes]
    F, entering, first = (np.zeros((sum(sizes), sum(sizes))) for _ in range(3))
    at = 0
    for one, size in zip(processes, sizes, strict=True):
        rows = slice(at, at + size)
        keep, turn = exp(-h / one.time_constant_s), 2.0 * pi * one.frequency_hz * h
        if size == 1:
            F[rows, rows] = keep
        else:
            F[rows, rows] = keep * np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
        first[rows, rows] = one.std**2 * np.eye(size)
        entering[rows, rows] = (1.0 - keep**2) * one.std**2 * np.eye(size)
        at += size
    return F, np.stack([entering, first])
