"""Single times that are wrong in an otherwise continuous sequence: a bit flip, an unset stamp, a clock read half-way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.log import Nanoseconds

Flags = NDArray[np.bool_]

STEP_NS = 1_000_000_000
_PERIODS = 10.0
"""A step beyond this many usual periods, and a second, may come of a wrong time."""
_FEWEST = 8
_SHORT, _SHORT_SHARE = 3, 0.01
"""At most so many rows, or this share of all, are strays; more are a clock that was set."""
_MOST = 0.2
"""With a larger share of strays no sequence is left that could tell which times are right."""
_BEYOND_NS = 3600 * STEP_NS
"""Rows at either end are strays only if further away than this, and than the rest is long; nearer, they follow a gap."""


def stray_times(times: Nanoseconds) -> Flags:
    """Return which rows have a time that contradicts the order of the rows before and after them.

    Rows are strays where a few of them lie outside the time between the rows before and after, which do follow each
    other. Rows that were written late and fit into a gap elsewhere are none, nor are stretches of a clock that was set.

    Parameters
    ----------
    times
        Times in the order of the file [ns], shape (n,).

    Returns
    -------
    ndarray of bool
        Shape (n,).
    """
    count = len(times)
    stray = np.zeros(count, dtype=bool)
    if count < _FEWEST:
        return stray
    # Differences of far times leave 64 bits; as floating point they are exact enough to be compared with a second.
    steps = np.diff(times.astype(np.float64))
    if steps.min() >= -STEP_NS and steps.max() <= _BEYOND_NS:
        return stray
    usual = float(np.median(np.abs(steps)))
    edges = np.flatnonzero(np.abs(steps) > max(STEP_NS, _PERIODS * usual)) + 1
    bounds = [0, *edges.tolist(), count]
    short = max(_SHORT, int(_SHORT_SHARE * count))
    pieces = list(pairwise(bounds))
    long = [stop - start > short for start, stop in pieces]
    if not any(long):
        return stray
    kept = np.concatenate([times[start:stop] for (start, stop), whole in zip(pieces, long, strict=True) if whole])
    span = max(_BEYOND_NS, int(kept.max()) - int(kept.min()))
    following = _next_starts(times, pieces, long)
    before: int | None = None
    for (start, stop), whole, after in zip(pieces, long, following, strict=True):
        first, last = int(times[start:stop].min()), int(times[start:stop].max())
        if whole or not _contradicts(first, last, before, after, span):
            before = int(times[stop - 1])
        else:
            stray[start:stop] = True
    if np.count_nonzero(stray) > _MOST * count:
        return np.zeros(count, dtype=bool)
    return _without_late(times, stray, usual) if stray.any() else stray


def _next_starts(times: Nanoseconds, pieces: list[tuple[int, int]], long: list[bool]) -> list[int | None]:
    """Return for each piece the time at which the next long one begins; None where there is none."""
    following: list[int | None] = []
    after: int | None = None
    for (start, _), whole in zip(reversed(pieces), reversed(long), strict=True):
        following.append(after)
        after = int(times[start]) if whole else after
    return following[::-1]


def _contradicts(first: int, last: int, before: int | None, after: int | None, span: int) -> bool:
    if before is not None and after is not None:
        return after >= before - STEP_NS and not (before - STEP_NS <= first and last <= after + STEP_NS)
    if after is not None:
        return last > after + STEP_NS or after - last > span
    if before is not None:
        return first < before - STEP_NS or first - before > span
    return False


def _without_late(times: Nanoseconds, stray: Flags, usual: float) -> Flags:
    """Return the strays without those that fit into a gap of the others: they were written late."""
    rest = np.sort(times[~stray])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stray, [False]]).astype(np.int8)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        first, last = int(times[start:stop].min()), int(times[start:stop].max())
        place = int(np.searchsorted(rest, first))
        fits = 0 < place < len(rest) and int(rest[place]) > last
        if fits and int(rest[place]) - int(rest[place - 1]) >= (last - first) + 1.5 * usual:
            stray[start:stop] = False
    return stray
