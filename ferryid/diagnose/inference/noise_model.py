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

from ferryid.diagnose.inference.kalman import DIFFUSE, errors, errors_alone, gains, summed
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
class Part:
    """Channels that are filtered together: which, their noise, shared states, and the gains of every series."""

    channels: tuple[int, ...]
    noise: Floats
    blocks: Floats
    columns: Floats
    gains: tuple[tuple[Floats, Floats], ...] = field(repr=False)


@dataclass(frozen=True)
class WhiteningFilter:
    """A filter with its gains for the steps of one trial; see `make_whitening_filter`."""

    steps: Windows
    parts: tuple[Part, ...]

    def white(self, gaps: Floats) -> Floats:
        """Return whitened prediction errors of gaps, shape (J, c) flat, or (J, c, q) with q columns.

        The first steps of every series only tell where it starts, and are zero.
        """
        left = np.empty((*gaps.shape[:2], 1 if gaps.ndim == 2 else gaps.shape[2]))
        integrals, h = integrals_of(self.steps), stride_s(self.steps)
        for part in self.parts:
            own = list(part.channels)
            for (first, end), (K, spread) in zip(self.steps.runs, part.gains, strict=True):
                series = summed_up(gaps[first:end][:, own].reshape(end - first, len(own), -1), self.steps)
                if not part.blocks.size:
                    errors_ = errors_alone(K, spread, part.noise, integrals, h, series[:, 0])[:, None]
                else:
                    columns = part.columns[first:end]
                    errors_ = errors(K, spread, part.noise, integrals, part.blocks, columns, h, series)
                errors_[:DIFFUSE] = 0.0
                left[first:end, own] = errors_
        return np.ascontiguousarray(left.reshape(-1) if gaps.ndim == 2 else left.reshape(-1, gaps.shape[2]))

    @property
    def log_scale(self) -> float:
        """Sum of the logarithms of the standard deviations of all predictions."""
        return sum(float(np.log(spread[DIFFUSE:]).sum()) for part in self.parts for _, spread in part.gains)

    @property
    def log_scales(self) -> Floats:
        """Logarithms of the standard deviations of all predictions, shape (J, c); zero for those that are not judged."""
        every = np.zeros((len(self.steps.starts), sum(len(part.channels) for part in self.parts)))
        for part in self.parts:
            for (first, end), (_, spread) in zip(self.steps.runs, part.gains, strict=True):
                every[first + DIFFUSE : end, list(part.channels)] = np.log(spread[DIFFUSE:])
        return every


def make_whitening_filter(noise: NoiseModel, steps: Windows, responses: Floats | None = None) -> WhiteningFilter:
    """Return a filter with its gains for some steps. Channels that share no disturbance are filtered by themselves.

    `responses` are those of `disturbance_columns`, where they are known already.
    """
    h, integrals = stride_s(steps), integrals_of(steps)
    scale = measured_sizes(steps)
    if noise.processes and noise.force_model is not None:
        columns = disturbance_columns(noise, steps) if responses is None else responses
        blocks, drive = _blocks(noise.processes, h)
        by_run = tuple(
            gains(scale, noise.channels, integrals, blocks, drive, np.ascontiguousarray(columns[a:b]), h)
            for a, b in steps.runs
        )
        return WhiteningFilter(
            steps, (Part(tuple(range(len(noise.channels))), noise.channels, blocks, columns, by_run),)
        )
    parts = []
    for j in range(len(noise.channels)):
        own = noise.channels[j : j + 1]
        by_run = tuple(_alone(scale[j : j + 1], own, integrals, b - a, h) for a, b in steps.runs)
        parts.append(Part((j,), own, np.empty((0, 0)), _no_columns(len(steps.starts)), by_run))
    return WhiteningFilter(steps, tuple(parts))


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


def summed_up(gaps: Floats, steps: Windows) -> Floats:
    """Return the gaps of one series, shape (J, c) or (J, c, q), as what they sum up to in position or velocity."""
    flat = np.ascontiguousarray(gaps).reshape(*gaps.shape[:2], -1)
    return summed(flat, integrals_of(steps), stride_s(steps)).reshape(gaps.shape)


def measured_sizes(steps: Windows) -> Floats:
    """Return the root mean square of what is measured in every channel, in position or velocity, shape (c,)."""
    measured = steps.measured[:, steps.channels]
    size = np.sqrt(np.mean(measured**2, axis=0)) * stride_s(steps) ** integrals_of(steps)
    return np.asarray(np.maximum(size, 1e-9))


def _no_columns(n: int) -> Floats:
    return np.empty((n, 1, 0))


def _alone(scale: Floats, noise: Floats, integrals: int, n: int, h: float) -> tuple[Floats, Floats]:
    return gains(scale, noise, integrals, np.empty((0, 0)), np.empty((2, 0, 0)), _no_columns(n), h)


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
