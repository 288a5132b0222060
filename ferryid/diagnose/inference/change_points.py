"""When errors are large: changes of a mean in time."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np

from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.types import Floats

LEVELS = 3
"""Levels of the segmentation."""


def active_intervals(
    times: Floats, strength: Floats, reach_s: float, whole: tuple[float, float], *, steady: bool = False
) -> tuple[tuple[float, float], ...]:
    """Return the intervals [s] in which a strength's mean is large, by binary segmentation at changes of its mean.

    Parameters
    ----------
    times, strength
        Shape (m,).
    reach_s
        Half the length of a window: intervals that are no further apart are one.
    whole
        First and last time of the log, for intervals that never begin or end.
    steady
        True where the strength is that of noise as well, so that only what it has above its calmest interval counts.

    References
    ----------
    Kuiper (1960) for the statistic, Vostrikova (1981) for the segmentation. The standard deviation of the mean is that of
    blocks, since neighbours are correlated.
    """
    # Large squares are rare and heavy: their roots vary less, and of bursts above noise the roots of these.
    judged = np.sign(strength) * np.abs(strength) ** (0.25 if steady else 0.5)
    edges = [0, *sorted(_breaks(judged, 0, len(strength), LEVELS)), len(strength)]
    means = [float(strength[a:b].mean()) for a, b in pairwise(edges)]
    calm = min(means) if steady and len(means) > 1 else 0.0
    top = max(means)
    if top <= calm:
        return ()
    found: list[tuple[float, float]] = []
    for (a, b), mean in zip(pairwise(edges), means, strict=True):
        if mean - calm <= INFERENCE.active_share * (top - calm):
            continue
        start = whole[0] if a == 0 else float(0.5 * (times[a - 1] + times[a]))
        end = whole[1] if b == len(strength) else float(0.5 * (times[b - 1] + times[b]))
        if found and start - found[-1][1] <= reach_s:
            found[-1] = (found[-1][0], end)
        else:
            found.append((start, end))
    return tuple(found)


def _breaks(values: Floats, first: int, end: int, levels: int) -> list[int]:
    n = end - first
    if n < 4 * INFERENCE.interval_windows or levels == 0:
        return []
    part = values[first:end]
    away = np.concatenate([[0.0], np.cumsum(part - part.mean())])
    # From its lowest to its highest point the sum gains most: one of the two ends of what differs, or both.
    cuts = sorted({int(np.argmin(away)), int(np.argmax(away))})
    cuts = [k for k in cuts if INFERENCE.interval_windows <= k <= n - INFERENCE.interval_windows]
    pieces = np.split(part, cuts)
    deviation = _long_deviation(np.concatenate([piece - piece.mean() for piece in pieces]))
    if not cuts or away.max() - away.min() <= INFERENCE.change_statistic * deviation * sqrt(n):
        return []
    ends = [first, *(first + k for k in cuts), end]
    further = [k for a, b in pairwise(ends) for k in _breaks(values, a, b, levels - 1)]
    return [*ends[1:-1], *further]


def _long_deviation(values: Floats) -> float:
    """Return the standard deviation that the sum of many values has per root of their number."""
    size = max(1, round(len(values) ** (1.0 / 3.0)) * 2)
    blocks = len(values) // size
    if blocks < 4:
        return float(values.std())
    means = values[: blocks * size].reshape(blocks, size).mean(axis=1)
    return max(float(means.std() * sqrt(size)), float(values.std()) * 0.5)
