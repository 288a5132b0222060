"""Coloured noise of many short series: autoregressions of all orders up to one, by Burg's method.

A series is whitened from its first row on: a row with k rows before it by the autoregression of order k. What a bag of some
seconds says is so used as wholly as what an hour does.

References
----------
Burg (1975), Maximum entropy spectral analysis; Kay (1988), Modern spectral estimation, chapter 7, for several segments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.cached import cached_property
from ferryid.compiled import compiled
from ferryid.types import Floats, Ints

Runs = Sequence[tuple[int, int]]
"""Unbroken series of rows, as (first, end)."""
ORDER = 8
"""Highest order: windows overlap over three strides, and what moves a vessel slowly lasts for longer."""
PAIRS = 20
"""Rows with so many before them that an order needs for each of its coefficients: short series have few for the highest."""
LEAST_VARIANCE = 1e-12
"""Of the channel's variance, below which a series that predicts itself counts as no noise."""


@dataclass(frozen=True)
class ColouredNoise:
    """Autoregressions of c channels.

    Attributes
    ----------
    coefficients
        ``coefficients[k]`` predicts a row from the k before it, the last one first, shape (c, k).
    scale
        Standard deviation of what is left at every order, shape (orders, c).
    unmix
        Inverse Cholesky factor of the correlation between the channels, shape (c, c).
    """

    coefficients: tuple[Floats, ...]
    scale: Floats
    unmix: Floats

    def white(self, gaps: Floats, runs: Runs) -> Floats:
        """Return whitened gaps, (J, c) or (J, c, q) for q columns at once, in the same shape."""
        flat = np.ascontiguousarray(gaps, dtype=np.float64).reshape(*gaps.shape[:2], -1)
        ends = np.array(runs, dtype=np.int64).reshape(-1, 2)
        return _whitened(flat, ends, self.triangle, self.scale, self.unmix).reshape(gaps.shape)

    @cached_property
    def triangle(self) -> Floats:
        """The coefficients of all orders as one array, zero beyond each order's, shape (orders, c, orders - 1)."""
        top = len(self.coefficients) - 1
        every = np.zeros((top + 1, len(self.unmix), top))
        for k, one in enumerate(self.coefficients):
            every[k, :, :k] = one
        return every


@compiled
def _whitened(gaps: Floats, runs: Ints, coefficients: Floats, scale: Floats, unmix: Floats) -> Floats:
    """Return `ColouredNoise.white` of gaps, shape (J, c, q), of unbroken series from `runs[:, 0]` up to `runs[:, 1]`."""
    out = np.zeros_like(gaps)
    c, q = gaps.shape[1], gaps.shape[2]
    top = coefficients.shape[2]
    left = np.empty((c, q))
    for run in range(runs.shape[0]):
        first = runs[run, 0]
        for n in range(first, runs[run, 1]):
            # A row with k rows before it is predicted by order k, or the highest.
            k = min(n - first, top)
            for i in range(c):
                for m in range(q):
                    left[i, m] = gaps[n, i, m]
                for j in range(k):
                    weight = coefficients[k, i, j]
                    for m in range(q):
                        left[i, m] -= weight * gaps[n - 1 - j, i, m]
                size = scale[k, i]
                for m in range(q):
                    left[i, m] /= size
            for i in range(c):
                for j in range(c):
                    weight = unmix[i, j]
                    if weight != 0.0:
                        for m in range(q):
                            out[n, i, m] += weight * left[j, m]
    return out


def fit_coloured_noise(gaps: Floats, runs: Runs, order: int = ORDER) -> ColouredNoise:
    """Return the noise that gaps, shape (J, c), have if nothing but noise is in them."""
    c = gaps.shape[1]
    lengths = [end - first for first, end in runs]
    order = next((k - 1 for k in range(1, order + 1) if sum(max(n - k, 0) for n in lengths) < PAIRS * k), order)
    ends = np.array(runs, dtype=np.int64).reshape(-1, 2)
    triangle, variances = _burg(np.ascontiguousarray(gaps, dtype=np.float64), ends, order)
    coefficients = tuple(triangle[k, :, :k] for k in range(order + 1))
    scale = np.sqrt(variances)
    left = ColouredNoise(coefficients, scale, np.eye(c)).white(gaps, runs)
    covariance = left.T @ left / max(len(left), 1)
    size = np.sqrt(np.diag(covariance))
    size[size == 0.0] = 1.0
    # The variance of what is left is as found, the first rows of short series included.
    correlation = covariance / np.outer(size, size) + 1e-9 * np.eye(c)
    return ColouredNoise(coefficients, scale * size, np.linalg.inv(np.linalg.cholesky(correlation)))


@compiled
def _burg(gaps: Floats, runs: Ints, order: int) -> tuple[Floats, Floats]:
    """Return coefficients, shape (orders, c, order), and variances, shape (orders, c), of all orders, from several series.

    Parameters
    ----------
    gaps
        Shape (J, c).
    runs
        First row of every series and the one after its last, shape (runs, 2).
    order
        The highest.
    """
    c = gaps.shape[1]
    found, variances = np.zeros((order + 1, c, order)), np.empty((order + 1, c))
    for j in range(c):
        forward, backward = gaps[:, j].copy(), gaps[:, j].copy()
        total, count = 0.0, 0
        for run in range(runs.shape[0]):
            for n in range(runs[run, 0], runs[run, 1]):
                total += forward[n] * forward[n]
                count += 1
        variances[0, j] = max(total / max(count, 1), 1e-300)
        least = LEAST_VARIANCE * variances[0, j]
        for k in range(1, order + 1):
            across, power = 0.0, 0.0
            for run in range(runs.shape[0]):
                for n in range(runs[run, 0] + k, runs[run, 1]):
                    # What was left backwards stands where the series of the order before had it.
                    f, b = forward[n], backward[n - 1]
                    across += f * b
                    power += f * f + b * b
            reflection = 2.0 * across / power if power > 0.0 else 0.0
            for i in range(k - 1):
                found[k, j, i] = found[k - 1, j, i] - reflection * found[k - 1, j, k - 2 - i]
            found[k, j, k - 1] = reflection
            variances[k, j] = max(variances[k - 1, j] * (1.0 - reflection * reflection), least)
            for run in range(runs.shape[0]):
                for n in range(runs[run, 1] - 1, runs[run, 0] + k - 1, -1):
                    f, b = forward[n], backward[n - 1]
                    forward[n], backward[n] = f - reflection * b, b - reflection * f
    return found, variances
