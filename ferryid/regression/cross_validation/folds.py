"""Cross-validation of smoothing windows and component counts, every combination from one set of cross-products.

Training rows are smoothed with the window that is tried, test rows always alike, so that windows can be compared: a long window
makes its own test rows easier to predict. Folds are sums of the logs' pieces; none is formed again for another count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.cross_validation.block_sums import OUT, BlockSums
from ferryid.regression.simpls import fit_simpls_many, training_sums
from ferryid.types import Flags, Floats, Ints

MOST_GROUPS = 10
"""Whole logs are dealt to so many folds where there are more."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Cross-validated errors of every window and component count.

    Attributes
    ----------
    mse
        Mean square error of the test rows per axis [N², N², (N·m)²], shape (W, A, 3).
    standard_error
        Of `mse`, from its scatter over the folds, shape (W, A, 3).
    base
        Mean square error of the base model on the same rows, shape (3,).
    folds, rows
        Number of folds, and of test rows in all of them.
    """

    mse: Floats
    standard_error: Floats
    base: Floats
    folds: int
    rows: int
    by_fold: Floats
    """Mean square error of every fold's test rows, shape (W, F, A, 3)."""

    def normalised(self) -> tuple[Floats, Floats]:
        """Return error and its standard error, each axis over its smallest error and averaged, shape (W, A) each."""
        least = self.mse.min(axis=(0, 1))
        return self._mean(self.mse, least), self._mean(self.standard_error, least)

    def _mean(self, values: Floats, least: Floats) -> Floats:
        """Return the mean of values over the least error of their axis, shape (...).

        An axis without any error, of the base model neither, is one that is not judged, and does not count.
        """
        axes = np.count_nonzero((self.mse.max(axis=(0, 1)) > 0.0) | (self.base > 0.0))
        return np.asarray((values / np.where(least > 0.0, least, 1.0)).sum(axis=-1) / max(axes, 1))

    def near(self) -> Flags:
        """Return which combinations cannot be told from the best, shape (W, A).

        They are worse by no more than one standard error of the paired differences over the folds, nor by more than one of the
        best's own error: that folds differ is no reason to take fewer components, nor is it that few of them fail in one fold.
        """
        curve, own = self.normalised()
        window, count = np.unravel_index(int(np.argmin(curve)), curve.shape)
        least = self.mse.min(axis=(0, 1))
        error = self._mean(self.by_fold, least)
        worse = error - error[window, :, count][None, :, None]
        folds = error.shape[1]
        band = np.std(worse, axis=1, ddof=1) / sqrt(folds) if folds > 1 else np.zeros_like(curve)
        return np.asarray(curve <= curve[window, count] + np.minimum(band, own[window, count]))

    def choice(self) -> tuple[int, int]:
        """Return number of window and of components (1..A): the simplest that cannot be told from the best.

        Of all that `near` has, those with fewest components, and of these the one with the least error; Breiman et al. (1984),
        3.4.3, with differences.
        """
        curve, near = self.normalised()[0], self.near()
        fewest = int(np.argmax(near.any(axis=0)))
        return int(np.argmin(curve[:, fewest])), fewest + 1

    def most_supported(self) -> int:
        """Return the largest number of components, at the first window, that is not worse than the best beyond chance.

        Beyond chance is more than one standard error of the paired differences over the folds. For estimates with a prior,
        which shrinks where the data say little: more components then cost nothing.
        """
        least = self.mse[0].min(axis=0)
        error = self._mean(self.by_fold[0], least)
        best = int(np.argmin(error.mean(axis=0)))
        worse = error - error[:, best : best + 1]
        band = np.std(worse, axis=0, ddof=1) / sqrt(len(error))
        return int(np.flatnonzero(worse.mean(axis=0) <= band)[-1]) + 1

    def best(self) -> tuple[int, int]:
        """Return number of window and of components (1..A) of the least error."""
        curve = self.normalised()[0]
        window, fewer = np.unravel_index(int(np.argmin(curve)), curve.shape)
        return int(window), int(fewer) + 1


@dataclass(frozen=True, eq=False)
class Folds:
    """Cross-products of every fold: what trains, smoothed with each of W windows, and what tests.

    Attributes
    ----------
    training
        W sequences of F cross-products.
    test
        F cross-products of the same rows, smoothed for testing; outputs are what the base model leaves.
    """

    training: tuple[tuple[CrossProducts, ...], ...]
    test: tuple[CrossProducts, ...]

    def curves(self, allowed: Flags, components: int, where: str = "sweep") -> Curves:
        """Return the errors of 1..`components` components at every window.

        Parameters
        ----------
        allowed
            Terms that each output may use, shape (K, 3).
        components
            A, the largest number of components.
        where
            What is swept, for messages.

        Raises
        ------
        FerryIdError
            With fewer than two folds that hold rows.
        """
        held = [i for i, fold in enumerate(self.test) if fold.n and all(one[i].n for one in self.training)]
        if len(held) < 2:
            raise FerryIdError(
                f"{where}: cross-validation needs two folds with rows, found {len(held)}. Fix: use a longer log or more logs"
            )
        sums = [one for window in self.training for one in training_sums([window[i] for i in held])]
        fits = fit_simpls_many(sums, components, allowed=allowed, where=where)
        tests = [self.test[i] for i in held]
        errors = np.array(
            [
                test.sse(fit.coefficients, fit.intercepts)
                for window in range(len(self.training))
                for test, fit in zip(tests, fits[window * len(held) : (window + 1) * len(held)], strict=True)
            ]
        ).reshape(len(self.training), len(held), components, -1)
        rows = np.array([fold.n for fold in tests], dtype=np.float64)
        K, m = tests[0].K, tests[0].m
        base = sum(test.sse(np.zeros((1, K, m)), np.zeros((1, m)))[0] for test in tests) / rows.sum()
        return Curves(
            mse=errors.sum(axis=1) / rows.sum(),
            standard_error=np.std(errors / rows[:, None, None], axis=1, ddof=1) / sqrt(len(held)),
            base=np.asarray(base),
            folds=len(held),
            rows=int(rows.sum()),
            by_fold=errors / rows[:, None, None],
        )


class FoldSums:
    """Folds added up log by log, so that only one log's pieces are held at a time.

    Parameters
    ----------
    windows
        W, the number of windows.
    k
        Number of folds, 2 or more; of whole logs at most `MOST_GROUPS`. Those that no block falls into stay empty.
    whole
        True: a fold is whole logs, dealt in turn. False: contiguous stretches of every log, each log in as many as it has
        blocks for, from where the last log ended.
    """

    def __init__(self, windows: int, k: int, *, whole: bool = False) -> None:
        k = min(MOST_GROUPS, k) if whole else k
        self._k, self._whole, self._next = k, whole, 0
        self._training: list[list[CrossProducts | None]] = [[None] * k for _ in range(windows)]
        self._test: list[CrossProducts | None] = [None] * k

    def add(self, training: Sequence[BlockSums], test: BlockSums, used: Flags | None = None) -> Ints:
        """Add one log.

        Parameters
        ----------
        training, test
            Its pieces at every window, and those for testing, of the same blocks.
        used
            Blocks that take part, shape (B,); all where None.

        Returns
        -------
        ndarray
            Number of the fold of each block, shape (B,); `OUT` of one that takes no part.
        """
        blocks = np.arange(test.blocks) if used is None else np.flatnonzero(used)
        labels = np.full(test.blocks, OUT)
        if not blocks.size:
            return labels
        parts = 1 if self._whole else min(self._k, blocks.size)
        labels[blocks] = (np.arange(blocks.size) * parts // blocks.size + self._next) % self._k
        self._next = (self._next + parts) % self._k
        for fold in np.unique(labels[blocks]).tolist():
            for sums, pieces in zip(self._training, training, strict=True):
                sums[fold] = _with(sums[fold], pieces.labelled(labels, fold))
            self._test[fold] = _with(self._test[fold], test.labelled(labels, fold))
        return labels

    def folds(self) -> Folds:
        """Return what has been added."""
        held = [fold for fold, test in enumerate(self._test) if test is not None]
        return Folds(
            tuple(tuple(cross for fold in held if (cross := sums[fold])) for sums in self._training),
            tuple(cross for fold in held if (cross := self._test[fold])),
        )


def _with(sums: CrossProducts | None, more: CrossProducts) -> CrossProducts:
    return more if sums is None else sums + more
