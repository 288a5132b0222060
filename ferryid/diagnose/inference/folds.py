"""Blocks of a log, who is judged with whom, and what is drawn from them again and again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.inference.autoregression import ORDER
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.types import Floats, Ints

DRAWS = 1000


@dataclass(frozen=True)
class Folds:
    """Blocks of a log's windows and who is judged with whom.

    Attributes
    ----------
    block
        Block of every window, shape (J,).
    fold
        Fold of every window, shape (J,).
    training
        The windows to fit on, for every fold.
    """

    block: Ints
    fold: Ints
    training: tuple[Windows, ...]


def block_s(windows: Windows) -> float:
    """Return how long a block is that is held out [s], in a log that is long enough."""
    return INFERENCE.block_windows * len(windows.weight) * windows.measurements.step_s


def folds_of(windows: Windows) -> Folds | None:
    """Cut windows into blocks and deal them to folds; None where there are fewer than `INFERENCE.fewest_blocks`.

    A block lasts `INFERENCE.block_windows` windows' lengths, less in a short log, and is never shorter than two.
    """
    if len(windows.starts) == 0:
        return None
    measurements = windows.measurements
    width_s = len(windows.weight) * measurements.step_s
    stride_s = float(np.median(np.diff(windows.starts))) * measurements.step_s if len(windows.starts) > 1 else width_s
    seconds = len(windows.starts) * stride_s
    number = round(seconds / (INFERENCE.block_windows * width_s))
    if number < INFERENCE.fewest_blocks:
        number = INFERENCE.fewest_blocks
    if seconds / number < 2.0 * width_s:
        return None
    block = np.arange(len(windows.starts)) * number // len(windows.starts)
    fold = block % INFERENCE.folds
    purge = round(INFERENCE.purge_windows * len(windows.weight)) + len(windows.weight)
    training = []
    for k in range(INFERENCE.folds):
        held = np.sort(windows.starts[fold == k])
        place = np.searchsorted(held, windows.starts)
        after = np.abs(windows.starts - held[np.minimum(place, len(held) - 1)])
        before = np.abs(windows.starts - held[np.maximum(place - 1, 0)])
        training.append(subset(windows, (fold != k) & (np.minimum(after, before) >= purge)))
    if any(_learning(one) < 2 * ORDER for one in training):
        return None
    return Folds(block, fold, tuple(training))


def subset(windows: Windows, chosen: NDArray[np.bool_]) -> Windows:
    """Return some of the windows, shape (J,); a series is broken where one is left out."""
    runs, count = [], 0
    for first, end in windows.runs:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen[first:end], [False]]).astype(np.int8)))
        for a, b in edges.reshape(-1, 2):
            runs.append((count, count + int(b - a)))
            count += int(b - a)
    return replace(windows, starts=windows.starts[chosen], runs=tuple(runs), measured=windows.measured[chosen])


def _learning(windows: Windows) -> int:
    """Return how many windows are left to learn from when each series has started."""
    return sum(max(0, end - first - ORDER) for first, end in windows.runs)


def by_block(values: Floats, block: Ints) -> Floats:
    sums = np.zeros((int(block.max()) + 1, values.shape[1]))
    np.add.at(sums, block, values)
    return sums


def draws(block: Ints) -> Floats:
    """Return how often each block is drawn, shape (DRAWS, blocks)."""
    number = int(block.max()) + 1
    drawn = np.random.default_rng(0).integers(0, number, size=(DRAWS, number))
    counts = np.zeros((DRAWS, number))
    np.add.at(counts, (np.arange(DRAWS)[:, None], drawn), 1.0)
    return counts
