"""Accumulated cross-products of basis and residual: all that SIMPLS needs from a log, whatever its length."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.regression.thresholds import REGRESSION
from ferryid.side_by_side import over
from ferryid.types import Flags, Floats

CHUNK_ROWS = 8192
"""Rows in the scratch: 1.6 MB at 25 columns, so that it is still in the cache when it is multiplied."""
_BLAS_ENTRIES = 16_000
"""Entries in one BLAS call. From 16,384 on OpenBLAS adds threads, which slows such thin products down, tenfold and more
when other programs are busy; below, a product of one thread costs no more per row."""
LARGEST = 1e150
"""Values from here on are refused: their squares overflow."""
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
        ``[s_x, s_y]``, subtracted from every row so that large offsets cost no digits, shape (K + m,). Zero where the
        first chunk's mean is smaller than its standard deviation.
    products
        Shape (K + m + 1, K + m + 1), symmetric; the last row holds the column sums and n.
    """

    n: int
    K: int
    m: int
    shift: Floats
    products: Floats

    @classmethod
    def of(cls, *parts: Rows, names: Sequence[str] = (), where: str = "fit") -> CrossProducts:
        """Cross-products of the rows of one or several logs.

        Raises
        ------
        FerryIdError
            When a value is not finite; the message names the column.
        """
        first = parts[0].chunk(0, 0)
        accumulator = Accumulator(first[0].shape[1], first[1].shape[1], names=names, where=where)
        for rows in parts:
            accumulator.add_rows(rows)
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
            raise ValueError(
                f"cross-products of {self.K}+{self.m} and {other.K}+{counted(other.m, 'column')} do not add up"
            )
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

        Only eigenvalues above `REGRESSION.null_eigenvalue` of the largest are returned: below it lies rounding noise.
        """
        Sxx, Sxy = self.centred()[:2]
        d, e = scale[columns], scale[self.K + outputs]
        C = Sxx[np.ix_(columns, columns)] / np.outer(d, d)
        eigenvalues, vectors = np.linalg.eigh((C + C.T) / 2.0)
        kept = eigenvalues > REGRESSION.null_eigenvalue * max(eigenvalues[-1], 0.0) if len(columns) else slice(0)
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


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of one log for a fit, as a matrix or as something that is evaluated chunk by chunk and then forgotten.

    Attributes
    ----------
    inputs
        One array of shape (n, K), the basis itself; or, with `fill`, its arguments, n rows each, None where absent.
    Y
        Outputs, shape (n, m).
    mask
        Rows to use, shape (n,); None: all.
    fill
        ``fill(out, *inputs)`` writes the basis of a slice of the inputs into `out` (K, rows); nothing is copied.
    terms
        K, needed with `fill`.
    """

    inputs: tuple[Floats | None, ...]
    Y: Floats
    mask: Flags | None = None
    fill: Callable[..., None] | None = None
    terms: int = 0

    @classmethod
    def of(cls, X: Floats, Y: Floats, mask: Flags | None = None, where: str = "fit") -> Rows:
        """Rows of a matrix `X` (n, K) and outputs `Y` (n, m) or (n,).

        Raises
        ------
        FerryIdError
            Where the shapes do not fit together.
        """
        X, Y = np.asarray(X, dtype=np.float64), np.asarray(Y, dtype=np.float64)
        Y = Y[:, None] if Y.ndim == 1 else Y
        if X.ndim != 2 or Y.ndim != 2 or len(X) != len(Y) or (mask is not None and mask.shape != (len(X),)):
            found = f"{X.shape}, {Y.shape} and {None if mask is None else mask.shape}"
            raise FerryIdError(
                f"{where}: basis, outputs and mask of a fit need the same rows, their shapes are {found}. "
                "Fix: pass (n, K), (n, m) and (n,)"
            )
        return cls((X,), Y, mask)

    def chunk(self, low: int, high: int, buffer: Floats | None = None) -> tuple[Floats, Floats]:
        """Return basis (rows, K) and outputs (rows, m) of the rows in use from `low` up to `high`.

        With `fill` the basis is a part of `buffer` (K, at least as many rows), where that is given.
        """
        pieces = [None if values is None else values[low:high] for values in self.inputs]
        outputs = self.Y[low:high]
        if self.mask is not None and not (keep := self.mask[low:high]).all():
            pieces = [None if piece is None else piece[keep] for piece in pieces]
            outputs = outputs[keep]
        if self.fill is not None:
            out = np.empty((self.terms, len(outputs))) if buffer is None else buffer[:, : len(outputs)]
            self.fill(out, *pieces)
            return out.T, outputs
        assert pieces[0] is not None
        return pieces[0], outputs


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
        Threads for long logs, where there are as many cores. The result does not depend on it.
    """

    def __init__(self, K: int, m: int, *, names: Sequence[str] = (), where: str = "fit", workers: int = 4) -> None:
        self._K, self._m = K, m
        self._names, self._where = tuple(names), where
        self._workers = workers
        self._n = 0
        self._shift: Floats | None = None
        self._products = np.zeros((K + m + 1, K + m + 1))

    def add(self, X: Floats, Y: Floats, mask: Flags | None = None) -> None:
        """Add the rows of `X` (n, K) and `Y` (n, m) where `mask` (n,) is true.

        Raises
        ------
        FerryIdError
            When a value is not finite; the message names the column.
        """
        self.add_rows(Rows.of(X, Y, mask, self._where))

    def add_rows(self, rows: Rows) -> None:
        """Add rows."""
        if self._shift is None:
            self._shift = first_mean(rows)
        shift = self._shift
        if shift is None:
            return

        def segment(low: int) -> tuple[int, Floats]:
            return self._segment(rows, shift, low, min(low + SEGMENT_ROWS, len(rows.Y)))

        starts = range(0, len(rows.Y), SEGMENT_ROWS)
        most = self._workers if len(starts) > 2 else 1
        for count, products in over(segment, starts, most=most):
            self._n += count
            self._products += products

    def result(self) -> CrossProducts:
        """Return what has been added so far."""
        shift = np.zeros(self._K + self._m) if self._shift is None else self._shift
        return CrossProducts(self._n, self._K, self._m, shift.copy(), self._products.copy())

    def _segment(self, rows: Rows, shift: Floats, start: int, stop: int) -> tuple[int, Floats]:
        K, width = self._K, self._K + self._m + 1
        products = np.zeros((width, width))
        flat = np.empty(width * min(CHUNK_ROWS, stop - start))
        # Row-major [bases; outputs; ones] when the basis comes that way, else rows as they lie.
        scratch = flat.reshape(width, -1).T
        if rows.fill is None:
            X, _ = rows.chunk(start, min(start + 2, stop))
            scratch = scratch if X.strides[0] < X.strides[1] else flat.reshape(-1, width)
        scratch[:, -1] = 1.0
        moved = np.flatnonzero(shift[:K])
        count = 0
        for low in range(start, stop, CHUNK_ROWS):
            X, Y = rows.chunk(low, min(low + CHUNK_ROWS, stop), scratch.T[:K])
            filled = scratch[: len(Y)]
            with np.errstate(all="ignore"):
                if rows.fill is None:
                    subtract(X, shift[:K], filled[:, :K])
                else:
                    for k in moved:
                        filled[:, k] -= shift[k]
                subtract(Y, shift[K:], filled[:, K:-1])
                part = gram(filled)
            if not np.isfinite(part).all():
                raise not_finite(X, Y, self._names, self._where)
            products += part
            count += len(Y)
        return count, products


def first_mean(rows: Rows) -> Floats | None:
    """Return the shift of cross-products of these rows, shape (K + m,); None where no row is in use."""
    for low in range(0, len(rows.Y), CHUNK_ROWS):
        X, Y = rows.chunk(low, low + CHUNK_ROWS)
        if len(Y):
            with np.errstate(all="ignore"):
                mean = np.concatenate([X.mean(axis=0), Y.mean(axis=0)])
                # A mean below the standard deviation costs no digit: leave it.
                spread = np.concatenate([X.std(axis=0), Y.std(axis=0)])
                return np.where(np.abs(mean) < spread, 0.0, mean)
    return None


def not_finite(X: Floats, Y: Floats, names: Sequence[str], where: str) -> FerryIdError:
    """Name the first column that holds NaN, infinity or values whose squares overflow."""
    columns = np.hstack([X, Y])
    bad = ~(np.abs(columns) < LARGEST)
    column = int(np.argmax(bad.any(axis=0)))
    if column >= X.shape[1]:
        name = f"output {column - X.shape[1] + 1}"
    else:
        name = f'basis term "{names[column]}"' if column < len(names) else f"basis term {column + 1}"
    row = int(np.argmax(bad[:, column]))
    return FerryIdError(
        f"{where}: {name} must be finite for a fit, found {columns[row, column]} in {int(bad[:, column].sum())} "
        f"of {counted(len(columns), 'row')} looked at. Fix: mask rows without measurements, or correct the signal's unit"
    )


def subtract(values: Floats, shift: Floats, out: Floats) -> None:
    """``out[:] = values - shift``, column by column where that is how `out` lies: five times as fast there."""
    if out.strides[0] > out.strides[1]:
        np.subtract(values, shift, out=out)
        return
    for k in range(len(shift)):
        np.subtract(values[:, k], shift[k], out=out[:, k])


def gram(rows: Floats) -> Floats:
    """``rows' rows`` by BLAS syrk, in blocks of `_BLAS_ENTRIES`."""
    block = max(1, _BLAS_ENTRIES // rows.shape[1])
    whole = len(rows) // block * block
    tail = rows[whole:]
    product = tail.T @ tail
    if whole:
        blocks = rows[:whole].reshape(-1, block, rows.shape[1])
        product += np.matmul(blocks.transpose(0, 2, 1), blocks).sum(axis=0)
    return product
