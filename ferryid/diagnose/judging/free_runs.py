"""Free runs of two hypotheses in held-out blocks of a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.folds import Folds, by_block, draws
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import Measurements
from ferryid.effects.free_motion import run_freely
from ferryid.types import Floats, Ints

QUANTITIES = ("position", "heading", "speed", "yaw rate")
"""What the errors of a free run are of."""
DIVERGED = 1e6
"""State beyond which a free run is stopped [m, rad, m/s, rad/s]."""


@dataclass(frozen=True)
class FreeRuns:
    """Errors of held-out free runs, root mean square over all starts, at some horizons.

    Attributes
    ----------
    horizons_s
        Shape (h,).
    before, after
        Position [m], heading [rad], speed [m/s] and yaw rate [rad/s], shape (h, 4); NaN where the log has no position.
    removed, low, high
        Fraction of the error that was removed with its 95 % block-bootstrap interval, shape (h, 4). Of one block `high`
        is NaN.
    starts
        Number of runs.
    """

    horizons_s: Floats
    before: Floats
    after: Floats
    removed: Floats
    low: Floats
    high: Floats
    starts: int

    @property
    def worse(self) -> tuple[str, ...]:
        """Which of `QUANTITIES` err more, by `JUDGING.worse_run` and beyond chance, over the longest horizon that tells it."""
        known = np.flatnonzero(np.isfinite(self.high).any(axis=1))
        if not known.size:
            return ()
        removed, high = self.removed[known[-1]], self.high[known[-1]]
        worse = (removed < -JUDGING.worse_run) & (high < 0.0)
        return tuple(name for name, more in zip(QUANTITIES, worse.tolist(), strict=True) if more)


def free_runs(problem: EstimationProblem, folds: Folds, before: Sequence[Fit], after: Sequence[Fit]) -> FreeRuns:
    """Integrate the force models of two hypotheses from many starts in held-out blocks and compare them with the log.

    A run is given the forces that act along the measured path by the force model, and integrates hull, load and flow with
    Heun's rule from its start; it stays in its block. Both hypotheses start alike, from the smoothed velocity.

    Parameters
    ----------
    problem, folds
        The log.
    before, after
        Fits for every fold.
    """
    windows, measurements = problem.windows, problem.windows.measurements
    width_s = len(windows.weight) * measurements.step_s
    horizons = width_s * np.array([0.5, 1.0, 2.0, 4.0])
    stride = max(1, round(width_s / 40.0 / measurements.step_s))
    steps = np.maximum(1, np.round(horizons / measurements.step_s / stride).astype(int))
    starts, last, block = _starts(windows, folds, stride * int(steps[0]))
    horizons = steps * stride * measurements.step_s
    errors = np.full((2, len(starts), len(steps), 4), np.nan)
    for k in range(INFERENCE.folds):
        own = np.flatnonzero(block % INFERENCE.folds == k)
        if own.size == 0:
            continue
        for which, fits in enumerate((before, after)):
            model = fitted_force_model(problem.plain, fits[k])
            path = _stopped(run_freely(model, starts[own], stride, int(steps[-1]), DIVERGED))
            for h, count in enumerate(steps):
                rows = starts[own] + stride * int(count)
                inside = rows <= last[own]
                errors[which, own[inside], h] = _error(measurements, rows[inside], path[int(count), inside])
    # A run that left the numbers behind counts for neither.
    bad = ~np.isfinite(errors[:, :, :, 1:]).all(axis=(0, 3))
    errors[:, bad] = np.nan
    return _judged(horizons, errors, block)


def _starts(windows: Windows, folds: Folds, shortest: int) -> tuple[Ints, Ints, Ints]:
    """Return first and last possible row of each run, and its block: one run every window's length."""
    starts, last, block = [], [], []
    for first, end in windows.runs:
        for k in np.unique(folds.block[first:end]):
            rows = windows.starts[first:end][folds.block[first:end] == k]
            final = int(rows[-1]) + len(windows.weight) - 1
            for row in range(int(rows[0]), final - shortest + 1, len(windows.weight)):
                starts.append(row)
                last.append(final)
                block.append(int(k))
    return np.array(starts, dtype=np.int64), np.array(last, dtype=np.int64), np.array(block, dtype=np.int64)


def _stopped(path: Floats) -> Floats:
    """Return states of runs, shape (steps + 1, s, 6), without those from where a run diverged on: they are left out."""
    diverged = np.logical_or.accumulate(~(np.abs(path) < DIVERGED).all(axis=2), axis=0)
    return np.where(diverged[:, :, None], np.nan, path)


def _error(measurements: Measurements, rows: Ints, state: Floats) -> Floats:
    """Return errors of position, heading, speed and yaw rate, shape (s, 4)."""
    away = state[:, :2] - measurements.eta[rows, :2]
    turned = np.abs(state[:, 2] - measurements.psi[rows])
    slip = state[:, 3:] - measurements.nu[rows]
    return np.column_stack(
        [np.hypot(away[:, 0], away[:, 1]), turned, np.hypot(slip[:, 0], slip[:, 1]), np.abs(slip[:, 2])]
    )


def _judged(horizons: Floats, errors: Floats, block: Ints) -> FreeRuns:
    """Return root mean squares over runs and their bootstrap over blocks, from errors of shape (2, starts, h, 4)."""
    shape = errors.shape[2:]
    known = np.isfinite(errors).all(axis=0)
    flat = [np.where(known, one, 0.0).reshape(len(block), -1) for one in errors]
    count = known.reshape(len(block), -1).astype(np.float64)
    total = np.maximum(count.sum(axis=0), 1.0)
    counted_runs = count.sum(axis=0) > 0
    before, after = (
        np.where(counted_runs, np.sqrt((one**2).sum(axis=0) / total), np.nan).reshape(shape) for one in flat
    )
    picks = draws(block)
    sums = [picks @ by_block(one**2, block) for one in flat]
    ratio = np.sqrt(sums[1] / np.where(sums[0] > 0.0, sums[0], np.nan))
    low, high = np.full(ratio.shape[1], np.nan), np.full(ratio.shape[1], np.nan)
    if counted_runs.any():
        low[counted_runs], high[counted_runs] = np.nanquantile(1.0 - ratio[:, counted_runs], [0.025, 0.975], axis=0)
    # Draws of one block are all alike, and tell nothing of chance.
    high[(by_block(count, block) > 0.0).sum(axis=0) < 2] = np.nan
    removed = 1.0 - after / before
    # Where every run diverges, or the log has no stretch that is long enough, there is none.
    starts = len(block) if counted_runs.any() else 0
    return FreeRuns(horizons, before, after, removed, low.reshape(shape), high.reshape(shape), starts)
