"""Chunk-wise QR (TSQR) where cross-products would lose digits: forming X'X squares the condition number of X."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.regression.cross_products import CHUNK_ROWS, LARGEST, CrossProducts, Rows, not_finite
from ferryid.regression.thresholds import REGRESSION
from ferryid.types import Floats

_BLOCK_ROWS = 256
"""Rows factorised at once: they stay in the innermost caches, 2.5 times as fast as 1024 and more."""


@dataclass(frozen=True, eq=False)
class QrFactor:
    """Triangle R of ``[1, X - s_x, Y - s_y] = Q R`` over n rows; adds up like `CrossProducts`, without squaring.

    Attributes
    ----------
    n
        Number of rows.
    K, m
        Number of regressors and of outputs.
    shift
        ``[s_x, s_y]``, shape (K + m,).
    triangle
        Upper triangular, shape (1 + K + m, 1 + K + m). Its first row holds the means times sqrt(n), the rest the
        triangle of the centred rows.
    """

    n: int
    K: int
    m: int
    shift: Floats
    triangle: Floats

    @classmethod
    def of(cls, *parts: Rows, names: Sequence[str] = (), where: str = "fit") -> QrFactor:
        """Factorise the rows of one or several logs, 8192 rows at a time.

        Raises
        ------
        FerryIdError
            When a value is not finite; the message names the column.
        """
        first = parts[0].chunk(0, 0)
        K, m = first[0].shape[1], first[1].shape[1]
        factor = cls(0, K, m, np.zeros(K + m), np.zeros((1 + K + m, 1 + K + m)))
        chunks = (part.chunk(low, low + CHUNK_ROWS) for part in parts for low in range(0, len(part.Y), CHUNK_ROWS))
        for X, Y in chunks:
            if not len(Y):
                continue
            if not (np.abs(X).max(initial=0.0) < LARGEST and np.abs(Y).max(initial=0.0) < LARGEST):
                raise not_finite(X, Y, names, where)
            shift = factor.shift if factor.n else np.concatenate([X.mean(axis=0), Y.mean(axis=0)])
            block = np.empty((len(Y), 1 + K + m))
            block[:, 0] = 1.0
            np.subtract(X, shift[:K], out=block[:, 1 : 1 + K])
            np.subtract(Y, shift[K:], out=block[:, 1 + K :])
            factor += cls(len(block), K, m, shift, _triangle(block))
        return factor

    def shifted(self, shift: Floats) -> QrFactor:
        """Return the same factor about another shift: only the row of means changes."""
        triangle = self.triangle.copy()
        triangle[0, 1:] -= triangle[0, 0] * (shift - self.shift)
        return QrFactor(self.n, self.K, self.m, shift.copy(), triangle)

    def __add__(self, other: QrFactor) -> QrFactor:
        """Factor of the rows of both."""
        if not isinstance(other, QrFactor):
            return NotImplemented
        if (self.K, self.m) != (other.K, other.m):
            raise ValueError(f"factors of {self.K}+{self.m} and {other.K}+{counted(other.m, 'column')} do not add up")
        if self.n == 0:
            return other
        moved = other if np.array_equal(other.shift, self.shift) else other.shifted(self.shift)
        triangle = _triangle(np.vstack([self.triangle, moved.triangle]))
        return QrFactor(self.n + other.n, self.K, self.m, self.shift, triangle)

    def moments(self) -> tuple[Floats, Floats]:
        """Return mean and sum of squares about the mean of every column, shape (K + m,) each."""
        mean = self.shift.copy()
        if self.n:
            mean += self.triangle[0, 1:] / self.triangle[0, 0]
        return mean, np.sum(self.triangle[1:, 1:] ** 2, axis=0)

    def spectrum(
        self, columns: NDArray[np.intp], outputs: NDArray[np.intp], scale: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return eigenvalues (r,), eigenvectors (k, r) and rotated covariance (r, g) of the scaled columns."""
        inner = self.triangle[1:, 1:] / scale
        if not len(columns):
            return np.zeros(0), np.zeros((0, 0)), np.zeros((0, len(outputs)))
        left, singular, right = np.linalg.svd(inner[:, columns], full_matrices=False)
        kept = singular > REGRESSION.null_singular * singular[0]
        singular = singular[kept]
        rotated = left[:, kept].T @ inner[:, self.K + outputs]
        return singular**2, right[kept].T, singular[:, None] * rotated

    def sse(self, coefficients: Floats, intercepts: Floats) -> Floats:
        """Sum of squared errors of ``Y - X B - b`` for A candidates at once, shape (A, m), without cancellation."""
        K = self.K
        first = self.shift[K:] - self.shift[:K] @ coefficients - intercepts
        triangle = self.triangle
        errors = triangle[:, 1 + K :] - triangle[:, 1 : 1 + K] @ coefficients
        errors[:, 0] += triangle[0, 0] * first
        return np.asarray(np.sum(errors**2, axis=1))


def condition(source: CrossProducts | QrFactor) -> tuple[float, int]:
    """Condition number of the standardised basis, null directions apart, and the number of unexplained null directions.

    A null direction is explained by a column without variance, or by two columns that agree to 1e-13 in
    correlation: those are exact in cross-products too. Any other calls for QR.
    """
    mean, squares = source.moments()
    scale = standard_deviations(mean, squares, source.n)
    columns = np.flatnonzero(np.isfinite(scale[: source.K]))
    eigenvalues, vectors, _ = source.spectrum(columns, np.arange(source.m), np.where(np.isfinite(scale), scale, 1.0))
    if not len(eigenvalues):
        return 1.0, 0
    correlation = (vectors * eigenvalues) @ vectors.T
    norm = np.sqrt(np.diag(correlation))
    tied = np.triu(np.abs(correlation / np.outer(norm, norm)) > 1.0 - 1e-13, 1)
    explained = int(tied.any(axis=0).sum())
    missing = len(columns) - len(eigenvalues) - explained
    return float(np.sqrt(eigenvalues[0] / eigenvalues[-1])), max(missing, 0)


def standard_deviations(mean: Floats, squares: Floats, n: int) -> Floats:
    """Standard deviations (n - 1 in the denominator); infinite where a column is constant to its last digits."""
    deviation = np.sqrt(squares / max(n - 1, 1))
    constant = deviation <= 16.0 * np.finfo(float).eps * np.abs(mean)
    return np.where(constant, np.inf, deviation)


def factorise(*parts: Rows, names: Sequence[str] = (), where: str = "fit") -> CrossProducts | QrFactor:
    """Cross-products of the rows, or their QR factor where `condition` says that cross-products would lose digits.

    The rows are gone over a second time only when the condition of the standardised basis exceeds
    `REGRESSION.condition_for_qr`, or when a linear dependence shows that is neither a constant nor a duplicate column.

    Raises
    ------
    FerryIdError
        When a value is not finite; the message names the column.
    """
    cross = CrossProducts.of(*parts, names=names, where=where)
    number, unexplained = condition(cross)
    if number <= REGRESSION.condition_for_qr and not unexplained:
        return cross
    return QrFactor.of(*parts, names=names, where=where)


def _triangle(rows: Floats) -> Floats:
    """Upper triangle (p, p) of `rows` (n, p) by a tree of Householder factorisations, `_BLOCK_ROWS` rows a leaf."""
    width = rows.shape[1]
    block = max(_BLOCK_ROWS, 4 * width)
    while len(rows) > block:
        whole = len(rows) // block * block
        leaves = np.asarray(np.linalg.qr(rows[:whole].reshape(-1, block, width), mode="r")).reshape(-1, width)
        rows = np.vstack([leaves, rows[whole:]])
    triangle = np.linalg.qr(rows, mode="r")
    return np.vstack([triangle, np.zeros((width - len(triangle), width))])
