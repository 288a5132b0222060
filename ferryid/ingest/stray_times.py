"""Single times that are wrong in an otherwise continuous sequence: a bit flip, an unset stamp, a clock read half-way."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from ferryid.types import Flags, Ints, Nanoseconds

STEP_NS = 1_000_000_000
_PERIODS = 10.0
"""A step forward beyond this many usual periods, and a second, may come of a wrong time."""
_FEWEST = 8
_SHORT, _SHORT_SHARE = 3, 0.01
"""At either end at most so many rows, or this share of all, are strays; more are a clock that was set."""
_MOST = 0.2
"""Largest share of strays, in one run and in all: beyond it a clock was set, or no order is left to judge by."""
_STRETCHES = 16
"""Stretches of a clock that was set are searched for strays if they hold more rows than this part of all."""
_BEYOND_NS = 3600 * STEP_NS
"""Rows at either end are strays only if further away than this, and than the rest is long; nearer, they follow a gap."""


def stray_times(times: Nanoseconds) -> tuple[Flags, Flags]:
    """Return which rows have a time that contradicts the order of the others, and which were written late.

    The longest chain of rows whose times rise, in the order of the file, is right; rows between those of the chain are
    strays. Rows before its first and after its last are strays if they are few or all have one far time, else a clock
    was set there. Rows that fit into a gap elsewhere are no strays but were written late. The sequence is cut at
    outlying steps only, and the chain links whole pieces: rows less than a second out of order stay with those around.

    Parameters
    ----------
    times
        Times in the order of the file [ns], shape (n,).

    Returns
    -------
    tuple of ndarray of bool
        Strays and late rows, each of shape (n,).
    """
    count = len(times)
    stray, late = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    if count < _FEWEST:
        return stray, late
    # Differences of far times leave 64 bits; as floating point they are exact enough to be compared with a second.
    steps = np.diff(times.astype(np.float64))
    if steps.min() >= -STEP_NS and steps.max() <= _BEYOND_NS:
        return stray, late
    usual = float(np.median(np.abs(steps)))
    outlying = (steps < -STEP_NS) | (steps > max(STEP_NS, _PERIODS * usual))
    if np.count_nonzero(outlying) > 0.5 * count:
        return stray, late
    stretches = [(0, count)]
    while stretches:
        start, stop = stretches.pop()
        part = slice(start, stop)
        first, last = _mark(times[part], outlying[start : stop - 1], stray[part], late[part], usual)
        # A clock that was set: what lies before and after has an order of its own. At most so many stretches hold this.
        if (last - first) * _STRETCHES > count:
            ends = ((start, start + first), (start + last, stop))
            stretches += [(a, b) for a, b in ends if b - a >= _FEWEST and not (stray | late)[a:b].any()]
    return stray, late


def _mark(times: Nanoseconds, outlying: Flags, stray: Flags, late: Flags, usual: float) -> tuple[int, int]:
    """Mark the strays and late rows of one stretch in place; return where the chain of right rows starts and stops."""
    count = len(times)
    starts = np.concatenate([[0], np.flatnonzero(outlying) + 1])
    stops = np.append(starts[1:], count)
    lowest, highest = np.minimum.reduceat(times, starts), np.maximum.reduceat(times, starts)
    sizes = stops - starts
    # A time that stands still is no clock, and many rows with it are worth no more than one.
    still = (lowest == highest) & (sizes >= _FEWEST)
    short = max(_SHORT, int(_SHORT_SHARE * count))
    usable = np.ones(len(starts), dtype=bool)
    chain = _longest_chain(starts, stops, lowest, highest, usable)
    # Times before or after all others rise too; those far from the bulk of the chain are left out, and it is searched anew.
    rows = np.cumsum(sizes[chain])
    core = chain[(rows > short) & (rows - sizes[chain] < rows[-1] - short) & ~still[chain]]
    if len(core):
        low, high = int(lowest[core].min()), int(highest[core].max())
        far = max(_BEYOND_NS, high - low)
        limits = np.iinfo(np.int64)
        usable = (lowest >= max(low - far, limits.min)) & (highest <= min(high + far, limits.max))
        if not usable.all():
            chain = _longest_chain(starts, stops, lowest, highest, usable)
    first, last = int(starts[chain[0]]), int(stops[chain[-1]])
    outside = np.ones(len(starts), dtype=bool)
    outside[chain] = False
    found = np.repeat(outside, sizes)
    if np.count_nonzero(found[first:last]) > _MOST * (last - first):
        return 0, count
    unset = np.repeat(still & ~usable, sizes)
    if first > short:
        found[:first] = unset[:first]
    if count - last > short:
        found[last:] = unset[last:]
    # Rows of another stretch, neither right nor stray, say nothing about the gaps of this one.
    late |= _late(times, found, times[first:last][~found[first:last]], usual)
    stray |= found & ~late
    return first, last


def _longest_chain(starts: Ints, stops: Ints, lowest: Ints, highest: Ints, usable: Flags) -> Ints:
    """Return the pieces of the chain with the most rows: none begins over a second before the end of the one before.

    Between two pieces at most the share `_MOST` of all rows is passed over, so that the chain does not change from one
    run of a clock to another.
    """
    pieces = len(starts)
    order = np.argsort(highest, kind="stable")
    place = np.empty(pieces, dtype=np.int64)
    place[order] = np.arange(pieces)
    ends, rank = highest[order].tolist(), place.tolist()
    begins, froms, tos, wanted = lowest.tolist(), starts.tolist(), stops.tolist(), usable.tolist()
    most = max(_SHORT, int(_MOST * tos[-1]))
    # Per piece rows * pieces + number, in a tree of maxima over the pieces in the order of their ends.
    tree = [-1] * (2 * pieces)
    previous, rows = [-1] * pieces, [0] * pieces
    oldest = 0
    for piece in range(pieces):
        while froms[piece] - tos[oldest] > most:
            _put(tree, pieces + rank[oldest], -1)
            oldest += 1
        if not wanted[piece]:
            continue
        best, left, right = -1, pieces, pieces + bisect_right(ends, begins[piece] + STEP_NS)
        while left < right:
            if left & 1:
                best = max(best, tree[left])
                left += 1
            if right & 1:
                right -= 1
                best = max(best, tree[right])
            left >>= 1
            right >>= 1
        rows[piece] = tos[piece] - froms[piece]
        if best >= 0:
            previous[piece] = best % pieces
            rows[piece] += best // pieces
        _put(tree, pieces + rank[piece], rows[piece] * pieces + piece)
    # Of equal chains the one that ends earliest: a single time in the future is no better than the last row.
    last = max(range(pieces), key=lambda piece: (rows[piece], -rank[piece]))
    chain = []
    while last >= 0:
        chain.append(last)
        last = previous[last]
    return np.array(chain[::-1], dtype=np.int64)


def _put(tree: list[int], node: int, value: int) -> None:
    tree[node] = value
    while node > 1:
        node >>= 1
        largest = max(tree[2 * node], tree[2 * node + 1])
        if tree[node] == largest:
            return
        tree[node] = largest


def _late(times: Nanoseconds, outside: Flags, right: Nanoseconds, usual: float) -> Flags:
    """Return which of the rows outside the chain fit into a gap of the right rows: they were written late."""
    late = np.zeros(len(times), dtype=bool)
    rest = np.sort(right)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], outside, [False]]).astype(np.int8)))
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        first, last = int(times[start:stop].min()), int(times[start:stop].max())
        place = int(np.searchsorted(rest, first))
        fits = 0 < place < len(rest) and int(rest[place]) > last
        # Blocks may change places; a single row ahead of its time is in the place that another stray left.
        later = stop - start > 1 or start == 0 or first < int(times[start - 1])
        if fits and later and int(rest[place]) - int(rest[place - 1]) >= (last - first) + 1.5 * usual:
            late[start:stop] = True
    return late
