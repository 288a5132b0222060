"""Accumulated cross-products of basis and residual: all that SIMPLS needs from a log, whatever its length."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Evaluate = Callable[..., Floats]

NULL_EIGENVALUE = 1e-13
"""Eigenvalues of X'X below this part of the largest are rounding noise: X's condition is known up to 3e6 only."""

CHUNK_ROWS = 8192
"""Rows in the scratch: 1.6 MB at 25 columns, so that it is still in the cache when it is multiplied."""
_BLOCK_ROWS = 2048
"""Rows in one BLAS call. Small enough for OpenBLAS to stay on one thread, which is faster here than two."""
SEGMENT_ROWS = 16 * CHUNK_ROWS
"""Rows summed together. Fixed, so that the digits of a sum do not depend on the number of workers."""


@dataclass(frozen=True, eq=False)
class CrossProducts:
    """``[X - s_x, Y - s_y, 1]' [X - s_x, Y - s_y, 1]`` of n rows.

    Attributes
    ----------
    n
        Number of rows.
    K, m
        Number of regressors (basis terms) and of outputs (axes).
    shift
        ``[s_x, s_y]``, subtracted from every row so that large offsets cost no digits, shape (K + m,).
    products
        Shape (K + m + 1, K + m + 1), symmetric; the last row holds the column sums and n.
    """

    n: int
    K: int
    m: int
    shift: Floats
    products: Floats

    @classmethod
    def from_rows(
        cls, X: Floats, Y: Floats, mask: Flags | None = None, *, names: Sequence[str] = (), where: str = "fit"
    ) -> CrossProducts:
        """Cross-products of the rows of `X` (n, K) and `Y` (n, m) where `mask` (n,) is true.

        Raises
        ------
        FerryIdError
            When a value is not finite; the message names the column.
        """
        X, Y = rows_of(X, Y, mask, where)
        accumulator = Accumulator(X.shape[1], Y.shape[1], names=names, where=where)
        accumulator.add(X, Y, mask)
        return accumulator.result()

    def shifted(self, shift: Floats) -> CrossProducts:
        """Return the same cross-products about another shift, shape (K + m,)."""
        step = np.append(shift - self.shift, 0.0)
        sums = self.products[-1]
        products = self.products - np.outer(step, sums) - np.outer(sums, step) + self.n * np.outer(step, step)
        return CrossProducts(self.n, self.K, self.m, shift.copy(), products)

    def __add__(self, other: CrossProducts) -> CrossProducts:
        """Cross-products of the rows of both."""
        if not isinstance(other, CrossProducts):
            return NotImplemented
        if (self.K, self.m) != (other.K, other.m):
            raise ValueError(f"cross-products of {self.K}+{self.m} and {other.K}+{other.m} columns do not add up")
        if self.n == 0:
            return other
        moved = other if np.array_equal(other.shift, self.shift) else other.shifted(self.shift)
        return CrossProducts(self.n + other.n, self.K, self.m, self.shift, self.products + moved.products)

    def centred(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Return ``Sxx (K, K), Sxy (K, m), Syy (m, m), mean_x (K,), mean_y (m,)``, sums about the mean."""
        K = self.K
        sums = self.products[-1, :-1]
        count = max(self.n, 1)
        S = self.products[:-1, :-1] - np.outer(sums, sums) / count
        mean = self.shift + sums / count
        return S[:K, :K], S[:K, K:], S[K:, K:], mean[:K], mean[K:]

    def moments(self) -> tuple[Floats, Floats]:
        """Return mean and sum of squares about the mean of every column, shape (K + m,) each."""
        sums, count = self.products[-1, :-1], max(self.n, 1)
        squares = np.diag(self.products)[:-1] - sums**2 / count
        return self.shift + sums / count, np.maximum(squares, 0.0)

    def spectrum(
        self, columns: NDArray[np.intp], outputs: NDArray[np.intp], scale: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return eigenvalues (r,), eigenvectors (k, r) and rotated covariance (r, g) of the scaled columns.

        Only eigenvalues above `NULL_EIGENVALUE` of the largest are returned: below it lies rounding noise.
        """
        Sxx, Sxy = self.centred()[:2]
        d, e = scale[columns], scale[self.K + outputs]
        C = Sxx[np.ix_(columns, columns)] / np.outer(d, d)
        eigenvalues, vectors = np.linalg.eigh((C + C.T) / 2.0)
        kept = eigenvalues > NULL_EIGENVALUE * max(eigenvalues[-1], 0.0) if len(columns) else slice(0)
        eigenvalues, vectors = eigenvalues[kept][::-1], vectors[:, kept][:, ::-1]
        return eigenvalues, vectors, vectors.T @ (Sxy[np.ix_(columns, outputs)] / np.outer(d, e))

    def sse(self, coefficients: Floats, intercepts: Floats) -> Floats:
        """Sum of squared errors of ``Y - X B - b`` for A candidates at once, shape (A, m).

        Taken about the mean of these rows, ``Syy - 2 B'Sxy + B'Sxx B + n (mean error)²``: where a candidate
        explains all but 1e-9 of the variance, about seven digits are left.

        Parameters
        ----------
        coefficients
            Shape (A, K, m).
        intercepts
            Shape (A, m).
        """
        Sxx, Sxy, Syy, mean_x, mean_y = self.centred()
        quadratic = np.sum(coefficients * (Sxx @ coefficients - 2.0 * Sxy), axis=1)
        offset = mean_y - mean_x @ coefficients - intercepts
        return np.asarray(np.maximum(np.diag(Syy) + quadratic, 0.0) + self.n * offset**2)


def total(parts: Iterable[CrossProducts]) -> CrossProducts:
    """Sum of several cross-products; at least one."""
    return reduce(add, parts)


class Accumulator:
    """Collect cross-products chunk by chunk; its memory does not grow with the number of rows.

    Parameters
    ----------
    K, m
        Number of regressors and of outputs.
    names
        Names of the K regressors, for messages.
    where
        What the rows belong to (a log's name), for messages.
    workers
        Threads for long logs. The result does not depend on it.
    """

    def __init__(
        self, K: int, m: int, *, names: Sequence[str] = (), where: str = "fit", workers: int | None = None
    ) -> None:
        self._K, self._m = K, m
        self._names, self._where = tuple(names), where
        self._workers = workers or min(os.cpu_count() or 1, 4)
        self._n = 0
        self._shift: Floats | None = None
        self._products = np.zeros((K + m + 1, K + m + 1))

    def add(self, X: Floats, Y: Floats, mask: Flags | None = None) -> None:
        """Add the rows of `X` (n, K) and `Y` (n, m) where `mask` (n,) is true."""
        X, Y = rows_of(X, Y, mask, self._where)
        self._add(None, (X,), Y, mask)

    def add_evaluated(self, evaluate: Evaluate, inputs: Sequence[Floats], Y: Floats, mask: Flags | None = None) -> None:
        """Add the rows of ``evaluate(*inputs)`` (n, K) and `Y` (n, m), evaluated chunk by chunk and then forgotten.

        Fastest when `evaluate` returns the transpose of an array with one basis term a row.
        """
        self._add(evaluate, tuple(inputs), Y, mask)

    def result(self) -> CrossProducts:
        """Return what has been added so far."""
        shift = np.zeros(self._K + self._m) if self._shift is None else self._shift
        return CrossProducts(self._n, self._K, self._m, shift.copy(), self._products.copy())

    def _add(self, evaluate: Evaluate | None, inputs: tuple[Floats, ...], Y: Floats, mask: Flags | None) -> None:
        rows = len(Y)
        if self._shift is None:
            self._shift = self._first_mean(evaluate, inputs, Y, mask)
        if self._shift is None:
            return
        bounds = [(low, min(low + SEGMENT_ROWS, rows)) for low in range(0, rows, SEGMENT_ROWS)]

        def segment(bound: tuple[int, int]) -> tuple[int, Floats]:
            return self._segment(evaluate, inputs, Y, mask, *bound)

        if len(bounds) > 2 and self._workers > 1:
            with ThreadPoolExecutor(self._workers) as pool:
                sums = list(pool.map(segment, bounds))
        else:
            sums = [segment(bound) for bound in bounds]
        for count, products in sums:
            self._n += count
            self._products += products

    def _first_mean(
        self, evaluate: Evaluate | None, inputs: tuple[Floats, ...], Y: Floats, mask: Flags | None
    ) -> Floats | None:
        for low in range(0, len(Y), CHUNK_ROWS):
            X, Y_chunk = _chunk(evaluate, inputs, Y, mask, low, min(low + CHUNK_ROWS, len(Y)))
            if len(Y_chunk):
                with np.errstate(all="ignore"):
                    return np.concatenate([X.mean(axis=0), Y_chunk.mean(axis=0)])
        return None

    def _segment(
        self,
        evaluate: Evaluate | None,
        inputs: tuple[Floats, ...],
        Y: Floats,
        mask: Flags | None,
        start: int,
        stop: int,
    ) -> tuple[int, Floats]:
        assert self._shift is not None
        K, width = self._K, self._K + self._m + 1
        products = np.zeros((width, width))
        scratch: Floats | None = None
        count = 0
        for low in range(start, stop, CHUNK_ROWS):
            X, Y_chunk = _chunk(evaluate, inputs, Y, mask, low, min(low + CHUNK_ROWS, stop))
            rows = len(Y_chunk)
            if scratch is None:
                # Row-major [bases; outputs; ones] when the basis comes that way, else rows as they lie.
                flat = np.empty(width * CHUNK_ROWS)
                by_term = X.strides[0] < X.strides[1]
                scratch = flat.reshape(width, -1).T if by_term else flat.reshape(-1, width)
                scratch[:, -1] = 1.0
            with np.errstate(all="ignore"):
                np.subtract(X, self._shift[:K], out=scratch[:rows, :K])
                np.subtract(Y_chunk, self._shift[K:], out=scratch[:rows, K:-1])
                part = _gram(scratch[:rows])
            if not np.isfinite(part).all():
                raise not_finite(X, Y_chunk, self._names, self._where)
            products += part
            count += rows
        return count, products


def rows_of(X: Floats, Y: Floats, mask: Flags | None, where: str) -> tuple[Floats, Floats]:
    """Return `X` and `Y` as two-dimensional float arrays of equal length, or say what does not fit."""
    X = np.asarray(X, dtype=np.float64)
    Y = np.asarray(Y, dtype=np.float64)
    Y = Y[:, None] if Y.ndim == 1 else Y
    if X.ndim != 2 or Y.ndim != 2 or len(X) != len(Y) or (mask is not None and mask.shape != (len(X),)):
        found = f"{X.shape}, {Y.shape} and {None if mask is None else mask.shape}"
        raise FerryIdError(
            f"{where}: basis, outputs and mask of a fit need the same rows, their shapes are {found}. "
            "Fix: pass (n, K), (n, m) and (n,)"
        )
    return X, Y


def not_finite(X: Floats, Y: Floats, names: Sequence[str], where: str) -> FerryIdError:
    """Name the first column that holds NaN, infinity or values whose squares overflow."""
    columns = np.hstack([X, Y])
    bad = ~(np.abs(columns) < 1e150)
    column = int(np.argmax(bad.any(axis=0)))
    if column >= X.shape[1]:
        name = f"output {column - X.shape[1] + 1}"
    else:
        name = f'basis term "{names[column]}"' if column < len(names) else f"basis term {column + 1}"
    row = int(np.argmax(bad[:, column]))
    return FerryIdError(
        f"{where}: {name} must be finite for a fit, found {columns[row, column]} in {int(bad[:, column].sum())} "
        f"of {len(columns)} rows looked at. Fix: mask rows without measurements, or correct the signal's unit"
    )


def _chunk(
    evaluate: Evaluate | None, inputs: tuple[Floats, ...], Y: Floats, mask: Flags | None, low: int, high: int
) -> tuple[Floats, Floats]:
    pieces = [values[low:high] for values in inputs]
    outputs = Y[low:high]
    if mask is not None and not (keep := mask[low:high]).all():
        pieces = [piece[keep] for piece in pieces]
        outputs = outputs[keep]
    return (pieces[0] if evaluate is None else evaluate(*pieces)), outputs


def _gram(rows: Floats) -> Floats:
    """``rows' rows`` in blocks of `_BLOCK_ROWS`, by BLAS syrk."""
    whole = len(rows) // _BLOCK_ROWS * _BLOCK_ROWS
    tail = rows[whole:]
    product = tail.T @ tail
    if whole:
        blocks = rows[:whole].reshape(-1, _BLOCK_ROWS, rows.shape[1])
        product += np.matmul(blocks.transpose(0, 2, 1), blocks).sum(axis=0)
    return product
