"""Coefficient intervals by block bootstrap: whole stretches are drawn again, because neighbouring rows agree."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CHUNK_ROWS, CrossProducts, Rows, gram, subtract
from ferryid.regression.qr import standard_deviations
from ferryid.regression.recurrence import extract
from ferryid.regression.simpls import group_outputs
from ferryid.regression.thresholds import REGRESSION
from ferryid.types import Flags, Floats, Ints

_BINS = 2000
"""Residuals are averaged to about this many bins before their autocorrelation is judged."""
_BATCH = 250
"""Draws side by side: their 22 x 22 matrices stay in the second-level cache."""


@dataclass(frozen=True, eq=False)
class Bootstrap:
    """Spread of the coefficients over draws.

    Attributes
    ----------
    low, high
        Interval of the coefficients, shape (K, m).
    intercept_low, intercept_high
        Interval of the intercepts, shape (m,).
    covariance
        Per output, over coefficients and intercept (last), shape (m, K + 1, K + 1).
    draws
        Number of draws.
    blocks
        Number of blocks that were drawn from.
    block_s
        Length of a block [s]; NaN where the blocks were given ready-made.
    notes
        What to know before trusting the intervals, as sentences.
    """

    low: Floats
    high: Floats
    intercept_low: Floats
    intercept_high: Floats
    covariance: Floats
    draws: int
    blocks: int
    block_s: float = float("nan")
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Blocks:
    """Cross-products of B blocks about one shift; see `CrossProducts`.

    Attributes
    ----------
    n
        Rows in each block, shape (B,).
    K, m
        Number of regressors and of outputs.
    shift
        Shape (K + m,).
    products
        Shape (B, K + m + 1, K + m + 1).
    """

    n: Ints
    K: int
    m: int
    shift: Floats
    products: Floats

    @classmethod
    def stack(cls, parts: Sequence[CrossProducts]) -> Blocks:
        """Stack cross-products about the first one's shift."""
        first = parts[0]
        products = np.array([part.shifted(first.shift).products for part in parts])
        return cls(np.array([part.n for part in parts]), first.K, first.m, first.shift, products)

    @classmethod
    def of(cls, parts: Sequence[Rows], rate_hz: Sequence[float], block_s: float) -> Blocks:
        """Cut the rows of one or several logs into blocks of about `block_s` seconds, none across two logs."""
        spans = [
            (rows, low, high)
            for rows, rate in zip(parts, rate_hz, strict=True)
            for low, high in _spans(rows, max(1, round(block_s * rate)))
        ]
        blocks = []
        shift: Floats | None = None
        for rows, low, high in spans:
            X, Y = rows.chunk(low, high)
            if shift is None:
                shift = np.concatenate([X.mean(axis=0), Y.mean(axis=0)])
                K, m = X.shape[1], Y.shape[1]
            by_term = X.strides[0] < X.strides[1]
            joined = np.empty((len(Y), K + m + 1), order="F" if by_term else "C")
            subtract(X, shift[:K], joined[:, :K])
            subtract(Y, shift[K:], joined[:, K:-1])
            joined[:, -1] = 1.0
            blocks.append(gram(joined))
        if shift is None:
            raise FerryIdError("fit: no rows to draw from for the intervals, found 0. Fix: use a longer log")
        products = np.array(blocks)
        return cls(products[:, -1, -1].round().astype(np.int64), K, m, shift, products)

    def whole(self) -> CrossProducts:
        """Cross-products of all blocks together."""
        return CrossProducts(int(self.n.sum()), self.K, self.m, self.shift, self.products.sum(axis=0))


def bootstrap_coefficients(
    blocks: Blocks | Sequence[CrossProducts],
    components: int,
    *,
    draws: int = 1000,
    seed: int = 0,
    scale: bool = True,
    scale_y: bool | None = None,
    allowed: Flags | None = None,
    level: float = 0.95,
    block_s: float = float("nan"),
    notes: tuple[str, ...] = (),
    where: str = "fit",
    transform: Callable[[Floats, Floats], tuple[Floats, Floats]] | None = None,
) -> Bootstrap:
    """Refit SIMPLS on as many blocks as there are, drawn with replacement, `draws` times over.

    Columns are scaled as in the fit to all blocks, and directions in which no block varies are left out: the scale is a
    choice of units, not an estimate. Intervals are percentiles of the draws, moved out for the number B of blocks: at the
    probability where a normal variable reaches ``sqrt(B/(B - 1)) t`` of Student's t with B - 1 degrees (Hesterberg).
    The covariance is that of the draws times B/(B - 1).

    Parameters
    ----------
    blocks
        Cross-products of contiguous stretches, long enough for residuals in different blocks to be independent.
    components
        Number of components of the model.
    draws, seed
        Number of draws and seed of the generator.
    scale, scale_y, allowed
        As in `ferryid.regression.simpls.fit_simpls`.
    level
        Coverage of the intervals.
    block_s, notes
        Passed on to the result.
    where
        What is fitted, for messages.
    transform
        Takes the coefficients of all draws, shape (draws, K, m), and their intercepts, (draws, m), to those whose spread is
        wanted.

    Raises
    ------
    FerryIdError
        With fewer than two blocks.

    References
    ----------
    Carlstein (1986), Annals of Statistics 14, 1171-1179 (blocks that do not overlap); Lahiri (2003), Resampling Methods
    for Dependent Data, chapter 2; Hesterberg (2015), The American Statistician 69, 371-386, section 5.3 (expanded
    percentiles).
    """
    stacked = blocks if isinstance(blocks, Blocks) else Blocks.stack(blocks)
    count = len(stacked.n)
    if count < 2:
        raise FerryIdError(
            f"{where}: intervals by block bootstrap need two blocks or more, found {count}. Fix: use a longer log"
        )
    if count < REGRESSION.few_blocks:
        notes = (
            *notes,
            f"Only {counted(count, 'independent stretch')} to draw from: the intervals are probably too narrow.",
        )
    coefficients, intercepts = _draw(stacked, components, draws, seed, scale, scale_y, allowed)
    if transform is not None:
        coefficients, intercepts = transform(coefficients, intercepts)
    table = np.concatenate([coefficients, intercepts[:, None, :]], axis=1).transpose(2, 1, 0)
    widened = count / (count - 1)
    low, high = percentiles(table, count, level)
    deviation = table - table.mean(axis=2, keepdims=True)
    covariance = deviation @ deviation.transpose(0, 2, 1) / max(draws - 1, 1) * widened
    return Bootstrap(
        low=low[:, :-1].T,
        high=high[:, :-1].T,
        intercept_low=low[:, -1],
        intercept_high=high[:, -1],
        covariance=covariance,
        draws=draws,
        blocks=count,
        block_s=block_s,
        notes=notes,
    )


def percentiles(table: Floats, count: int, level: float = 0.95) -> tuple[Floats, Floats]:
    """Return the ends of the interval that holds `level` of the draws along the last axis, moved out for `count` blocks.

    Linear between draws, as `numpy.quantile`; Hesterberg (2015), section 5.3.
    """
    from scipy.special import ndtr, stdtrit  # a tenth of a second to import: only where it is needed

    tail = float(ndtr(np.sqrt(count / (count - 1)) * stdtrit(count - 1, (1.0 - level) / 2.0)))
    ordered = np.sort(table, axis=-1)
    place = tail * (table.shape[-1] - 1)
    below = int(place)
    above = min(below + 1, table.shape[-1] - 1)
    part = place - below
    low = ordered[..., below] * (1.0 - part) + ordered[..., above] * part
    high = ordered[..., -1 - below] * (1.0 - part) + ordered[..., -1 - above] * part
    return low, high


def block_seconds(
    parts: Sequence[Rows], rate_hz: Sequence[float], coefficients: Floats, intercepts: Floats
) -> tuple[float, tuple[str, ...]]:
    """Length of a block [s] for a fit with `coefficients` (K, m) and `intercepts` (m,), and what to know about it.

    The longest of `correlated_rows` over the logs, but so that there are from 10 to 500 blocks.
    """
    lengths, seconds = [0.0], 0.0
    for rows, rate in zip(parts, rate_hz, strict=True):
        chunks = (rows.chunk(low, low + CHUNK_ROWS) for low in range(0, len(rows.Y), CHUNK_ROWS))
        residual = np.concatenate([Y - X @ coefficients - intercepts for X, Y in chunks])
        seconds += len(residual) / rate
        if len(residual) >= REGRESSION.fewest_blocks:
            lengths.append(correlated_rows(residual) / rate)
    longest, allowed_s = max(lengths), seconds / REGRESSION.fewest_blocks
    if longest <= allowed_s:
        return max(longest, seconds / REGRESSION.most_blocks), ()
    note = (
        f"Residuals stay correlated over blocks of {longest:.3g} s; the rows allow {allowed_s:.3g} s only: "
        "the intervals are probably too narrow."
    )
    return allowed_s, (note,)


def correlated_rows(residual: Floats) -> int:
    """Block length in rows from the residual's autocorrelation, the longest over the outputs.

    The automatic choice of Politis and White for blocks that do not overlap, ``b = (2 G² / D)^(1/3) n^(1/3)`` with
    ``G = Σ λ |k| R(k)`` and ``D = 2 (Σ λ R(k))²``, R the autocovariance and λ their flat-top window. The residual is
    first averaged to about 2000 bins, so that the answer does not depend on how finely a log was sampled.

    Parameters
    ----------
    residual
        Shape (n, m), in order of time.

    References
    ----------
    Politis and White (2004), Econometric Reviews 23, 53-70, with the correction by Patton, Politis and White (2009).
    """
    n, m = residual.shape
    width = max(1, n // _BINS)
    bins = residual[: n // width * width].reshape(-1, width, m).mean(axis=1)
    return int(width * max((_politis_white(column) for column in bins.T), default=1))


def _politis_white(series: Floats) -> int:
    n = len(series)
    longest = max(1, int(min(3.0 * np.sqrt(n), n / 3.0)))
    centred = series - series.mean()
    variance = float(centred @ centred) / n
    if n < 8 or variance <= (16.0 * np.finfo(float).eps * float(np.abs(series).max())) ** 2:
        return 1
    run = max(5, int(np.sqrt(np.log10(n))))
    lags = min(int(np.ceil(np.sqrt(n))) + run, n - 1)
    R = np.array([centred[: n - k] @ centred[k:] for k in range(lags + 1)]) / n
    small = np.abs(R[1:] / R[0]) < 2.0 * np.sqrt(np.log10(n) / n)
    quiet = np.flatnonzero(np.convolve(small, np.ones(run), "valid") == run)
    last = int(quiet[0]) if len(quiet) else lags - run
    reach = min(max(2 * last, 1), lags)
    k = np.arange(1, reach + 1)
    window = np.minimum(1.0, 2.0 * (1.0 - k / reach))
    spectrum = R[0] + 2.0 * float(window @ R[1 : reach + 1])
    slope = 2.0 * float(window @ (k * R[1 : reach + 1]))
    if spectrum <= 0.0:
        return longest
    best = float(np.abs(slope / spectrum) ** (2.0 / 3.0) * n ** (1.0 / 3.0))
    return max(1, min(int(np.ceil(best)), longest))


def _spans(rows: Rows, length: int) -> list[tuple[int, int]]:
    """Bounds of blocks with about `length` used rows each, as equal as can be."""
    used = np.arange(len(rows.Y)) if rows.mask is None else np.flatnonzero(rows.mask)
    if not len(used):
        return []
    bounds = np.linspace(0, len(used), max(1, round(len(used) / length)) + 1).round().astype(np.int64)
    return [(int(used[low]), int(used[high - 1]) + 1) for low, high in pairwise(bounds)]


def _moved(blocks: Blocks, shift: Floats) -> Floats:
    """Products of all blocks about another shift."""
    step = np.append(shift - blocks.shift, 0.0)
    cross = blocks.products[:, -1, :, None] * step
    square = blocks.n[:, None, None] * np.outer(step, step)
    return np.asarray(blocks.products - cross - cross.transpose(0, 2, 1) + square)


def times_drawn(count: int, draws: int, seed: int) -> Floats:
    """How often each of `count` blocks comes up in each draw of as many with replacement, shape (draws, count)."""
    picked = np.random.default_rng(seed).integers(0, count, (draws, count))
    flat = np.bincount((picked + count * np.arange(draws)[:, None]).ravel(), minlength=draws * count)
    return flat.reshape(draws, count).astype(np.float64)


def _draw(
    blocks: Blocks,
    components: int,
    draws: int,
    seed: int,
    scale: bool,
    scale_y: bool | None,
    allowed: Flags | None,
) -> tuple[Floats, Floats]:
    """Coefficients (draws, K, m) and intercepts (draws, m)."""
    K, m = blocks.K, blocks.m
    whole = blocks.whole()
    mean, squares = whole.moments()
    deviation = standard_deviations(mean, squares, whole.n)
    usable = np.isfinite(deviation)
    unit = np.ones_like(deviation)
    by_output = scale if scale_y is None else scale_y
    scales = np.where(
        usable, np.concatenate([(deviation if scale else unit)[:K], (deviation if by_output else unit)[K:]]), 1.0
    )
    products = _moved(blocks, mean)
    count = len(blocks.n)
    times = times_drawn(count, draws, seed)
    coefficients, intercepts = np.zeros((draws, K, m)), np.empty((draws, m))
    sums = times @ products[:, -1, K:]
    intercepts[:] = mean[K:] + sums[:, :m] / sums[:, m:]
    for columns, outputs in group_outputs(allowed, K, m):
        columns, outputs = columns[usable[columns]], outputs[usable[K + outputs]]
        axes = whole.spectrum(columns, outputs, scales)[1]
        r, g = axes.shape[1], len(outputs)
        # Blocks in the principal axes of the whole: [basis, outputs, 1], r + g + 1 columns.
        into = np.zeros((K + m + 1, r + g + 1))
        into[columns, :r] = axes / scales[columns][:, None]
        into[K + outputs, r + np.arange(g)] = 1.0 / scales[K + outputs]
        into[-1, -1] = 1.0
        turned = into.T @ products @ into
        upper = np.triu_indices(r + g + 1)
        packed = np.ascontiguousarray(turned[:, *upper])
        index = np.empty((r + g + 1, r + g + 1), dtype=np.intp)
        index[upper] = index.T[upper] = np.arange(len(upper[0]))
        out = into[columns, :r]
        for low in range(0, draws, _BATCH):
            part = slice(low, low + _BATCH)
            summed = (times[part] @ packed)[:, index]
            offsets = summed[:, -1, :-1] / summed[:, -1, -1:]
            centred = summed[:, :-1, :-1] - offsets[:, :, None] * summed[:, -1:, :-1]
            gram_matrix = np.ascontiguousarray(centred[:, :r, :r])
            R, _, Q, _ = extract(
                lambda vector, C=gram_matrix: (C @ vector[:, :, None])[:, :, 0],  # type: ignore[misc]
                np.ascontiguousarray(centred[:, :r, r:]),
                components,
            )
            B = R @ Q.transpose(0, 2, 1)
            e = scales[K + outputs]
            coefficients[part, columns[:, None], outputs] = out @ B * e
            intercepts[part, outputs] -= (offsets[:, None, :r] @ B)[:, 0] * e
    intercepts -= mean[:K] @ coefficients
    return coefficients, intercepts
