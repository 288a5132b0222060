"""How a vector of one field agrees with that of another."""

from __future__ import annotations

import numpy as np

from ferryid.draft.thresholds import DRAFT
from ferryid.types import Flags, Floats


def explained(first: Floats, second: Floats, x: Floats, y: Floats) -> tuple[float, float, float]:
    """Return which share of a measured vector another explains, how many times as large it is, and how second parts correlate.

    The vector is a velocity and the other the slope of a position, which is the noisier: how large the velocity is of it comes
    from the regression of the slope on the velocity, as where a log is checked. The other regression takes noise for size.
    """
    rows = np.isfinite(first + second + x + y)
    rows &= usual(np.hypot(x, y), rows)
    if np.count_nonzero(rows) < DRAFT.fewest_rows:
        return 0.0, 1.0, 0.0
    both = float(x[rows] @ x[rows] + y[rows] @ y[rows])
    gain = float(first[rows] @ x[rows] + second[rows] @ y[rows]) / both if both > 0.0 else 0.0
    if gain <= 0.0:
        return 0.0, 1.0, 0.0
    error = np.hypot(first - x * gain, second - y * gain)
    rows &= error <= np.quantile(error[rows], 0.95)
    total = float(np.sum(first[rows] ** 2 + second[rows] ** 2))
    share = 1.0 - float(np.sum(error[rows] ** 2)) / total if total > 0.0 else 0.0
    both = float(first[rows] @ x[rows] + second[rows] @ y[rows])
    return share, total / both if both > 0.0 else gain, correlation(second[rows], y[rows])


def usual(size: Floats, rows: Flags) -> Flags:
    """True where a speed is not that of a jump of the position."""
    usual = float(np.quantile(size[rows], 0.9)) if rows.any() else np.inf
    return np.asarray(size <= DRAFT.jump * max(usual, 1e-9))


def correlation(a: Floats, b: Floats) -> float:
    rows = np.isfinite(a + b)
    if np.count_nonzero(rows) < DRAFT.fewest_rows or np.ptp(a[rows]) == 0.0 or np.ptp(b[rows]) == 0.0:
        return 0.0
    return float(np.corrcoef(a[rows], b[rows])[0, 1])
