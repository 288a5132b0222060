"""Cross-products of one log in blocks, at several smoothing windows: what cross-validation is made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ferryid.identify.inertia.shares import axes_without_force
from ferryid.identify.rows import known_rows, rows_of
from ferryid.identify.settings import FOLDS, TEST_WINDOW_S, FitSettings
from ferryid.identify.split import purge_seconds
from ferryid.models.forces import compute_residual, without_inputs
from ferryid.regression.bases import Basis
from ferryid.regression.cross_validation import BlockSums, Folds, FoldSums, block_edges
from ferryid.signals.smooth import Measured, smooth_measured
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class LogSums:
    """One log in a cross-validation.

    Attributes
    ----------
    log
        Its name.
    training
        Its pieces at each window.
    test
        The same blocks smoothed for testing; outputs are what the base model leaves of the measured force.
    force, base
        Count, mean and sum of squares about the mean, of the measured force and of the base model's on the test rows of each
        block, shape (B, 3, 3): they say on which axes no actuator acts, and what R² compares with.
    reference
        The same of the error of the base model without measured wind, current and payload, which models are judged
        against.
    """

    log: str
    training: tuple[BlockSums, ...]
    test: BlockSums
    force: Floats
    base: Floats
    reference: Floats


def sum_log(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    measured: Measured,
    windows_s: Sequence[float],
    *,
    blocks: int = FOLDS,
    wanted: Flags | None = None,
) -> LogSums:
    """Return the pieces of one log at several windows.

    Parameters
    ----------
    profile, settings, functions
        Vessel, base model and residual, and the basis.
    measured
        The log before smoothing.
    windows_s
        Windows of the training rows [s].
    blocks
        Number of blocks; fewer in a log too short for so many.
    wanted
        Rows to use, shape (n,); all where None.
    """
    test = smooth_measured(measured, TEST_WINDOW_S)
    bare = without_inputs(test)
    motions = (smooth_measured(measured, window_s, settings.smoother) for window_s in windows_s)
    return sum_motions(
        functions,
        (test, compute_residual(profile, test, settings.scale)),
        ((motion, compute_residual(profile, motion, settings.scale, settings.residual)) for motion in motions),
        max(TEST_WINDOW_S, *windows_s),
        blocks=blocks,
        wanted=wanted,
        reference=compute_residual(profile, bare, settings.scale),
    )


def sum_motions(
    functions: Basis,
    test: tuple[Motion, Floats],
    training: Iterable[tuple[Motion, Floats]],
    reach_s: float,
    *,
    blocks: int = FOLDS,
    wanted: Flags | None = None,
    reference: Floats | None = None,
) -> LogSums:
    """Return the pieces of one log from smoothed motions.

    Parameters
    ----------
    functions
        The basis.
    test, training
        Motion of the test rows, and those of the training rows, each with what is to be explained, shape (n, 3).
    reach_s
        Longest smoothing window of all [s].
    blocks, wanted
        As in `sum_log`.
    reference
        Error of the model that others are judged against, shape (n, 3).
    """
    motion, error = test
    every = np.ones(len(motion.t), dtype=bool) if wanted is None else wanted
    used = known_rows(motion, functions, error, error) & every
    purge = purge_seconds(motion.rate_hz, reach_s)
    # A block is at least two purges long, so that more of it is used than lost.
    most = max(1, int(np.count_nonzero(used) / motion.rate_hz / (2.0 * purge)))
    edges = block_edges(used, min(blocks, most), round(purge * motion.rate_hz))

    def pieces(motion: Motion, output: Floats, rows: Flags) -> BlockSums:
        (one,) = rows_of(functions, [motion], [output], [rows])
        return BlockSums.of(one, edges, names=functions.terms, where=motion.log)

    at_windows = [pieces(one, target, known_rows(one, functions, target, target) & every) for one, target in training]
    spans = [slice(low, high) for low, high in pairwise(edges[::3])]
    force, base, judged = (
        np.array([moments_of(values[span][used[span]]) for span in spans])
        for values in (motion.tau, motion.tau - error, error if reference is None else reference)
    )
    return LogSums(motion.log, tuple(at_windows), pieces(motion, error, used), force, base, judged)


def force_free_axes(logs: Sequence[LogSums]) -> Flags:
    """Return the axes on which no actuator acts in any of the logs, shape (3,)."""
    force, base = (np.concatenate(moments) for moments in ([log.force for log in logs], [log.base for log in logs]))
    return axes_without_force(pooled_deviation(force), pooled_deviation(base))


def moments_of(values: Floats) -> Floats:
    """Return count, mean and sum of squares about the mean of values (n, 3), shape (3, 3)."""
    if not len(values):
        return np.zeros((3, 3))
    mean = values.mean(axis=0)
    return np.array([np.full(3, float(len(values))), mean, ((values - mean) ** 2).sum(axis=0)])


def pooled_mean_square(moments: Floats) -> Floats:
    """Return the mean square of all rows of several blocks, shape (3,), from the moments of each, shape (B, 3, 3)."""
    count, mean, squares = moments.transpose(1, 0, 2)
    return np.asarray((squares + count * mean**2).sum(axis=0) / np.maximum(count.sum(axis=0), 1.0))


def pooled_deviation(moments: Floats) -> Floats:
    """Return the standard deviation of all rows of several blocks, shape (3,), from the moments of each, shape (B, 3, 3)."""
    count, mean, squares = moments.transpose(1, 0, 2)
    whole = np.maximum(count.sum(axis=0), 1.0)
    between = count * (mean - (count * mean).sum(axis=0) / whole) ** 2
    return np.asarray(np.sqrt((squares + between).sum(axis=0) / whole))


def folds_by_blocks(logs: Sequence[LogSums], k: int = FOLDS) -> Folds:
    """Return folds of contiguous stretches of every log."""
    return _folds(logs, FoldSums(len(logs[0].training), k))


def folds_by_logs(logs: Sequence[LogSums]) -> Folds:
    """Return folds of whole logs."""
    return _folds(logs, FoldSums(len(logs[0].training), len(logs), whole=True))


def _folds(logs: Sequence[LogSums], sums: FoldSums) -> Folds:
    for log in logs:
        sums.add(log.training, log.test)
    return sums.folds()
