"""Times of a table that were written with too few digits, so that rows share the time of others.

Three digits are hundredths of a second at first, tenths from 10 s on, and whole seconds from 100 s on: of an even log of seven
rows a second, six of seven would be left out. Rows that lie evenly within the rounding of every time are put back; nothing else
is, as rows may share a time because they were written twice, or one by each of several sensors.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ferryid.counts import counted, verb
from ferryid.ingest.log import Column
from ferryid.types import Flags, Floats, Nanoseconds

_SHARED = 0.1
"""Share of the rows that repeat a time from which on rounding is asked for."""
_STEPS = 8
"""Steps of the times in a row of which the rounding is the largest common divisor."""
_MOST = 0.5
"""Share of the rows that repeat a time whose values tell that they are no rows of their own."""
_SECOND_NS = 1e9


def unrounded(times: Nanoseconds, columns: Iterable[Column] = ()) -> tuple[Nanoseconds, str]:
    """Return times of rows that lie evenly, where that is what was rounded, and what to say of it.

    Parameters
    ----------
    times
        Times of a table in the order of its rows [ns], shape (n,).
    columns
        What the rows hold, shape (n,) each.

    Returns
    -------
    tuple
        Strictly rising times, or those given; and a sentence, empty where times are not that coarse.
    """
    steps = np.diff(times)
    fresh = np.concatenate([[True], steps > 0])
    repeats = len(times) - int(np.count_nonzero(fresh))
    if repeats < _SHARED * len(times) or np.any(steps < 0):
        return times, ""
    distinct = times[fresh]
    same, other = _compared(columns, len(times))
    again = steps == 0
    # A row that was written twice holds the same, and the next one does not; what is held between samples shows in both.
    if len(distinct) <= 2 * _STEPS or np.mean(same[again]) > max(_MOST, 2.0 * np.mean(same[~again])):
        return times, ""
    rows = f"{repeats} of {counted(len(times), 'row')} {verb(repeats, 'repeats')}"
    if np.mean(other[again]) > _MOST:
        why = "they fill other columns, as rows of several sensors do. Fix: write those of one time as one row"
        return times, f"{rows} the time of another and are left out: {why}"
    rounding = _rounding(distinct)[np.cumsum(fresh) - 1]
    start, period = _line(times, rounding)
    even = start + period * np.arange(len(times))
    within = bool(np.all(np.abs(times - times[0] - even) <= 0.55 * rounding + 0.5 * period))
    coarse = rounding[1:][again]
    if np.median(coarse) < period:
        return times, ""
    size = _sizes(coarse)
    what = f"{rows} the time of another, as times that are rounded to {size} s do"
    pace = f"evenly {period / _SECOND_NS:.4g} s apart ({_SECOND_NS / period:.3g} Hz)"
    counts = np.diff(np.flatnonzero(np.concatenate([fresh, [True]])))[1:-1]
    if within and counts.min() < counts.max():
        moved = float(np.abs(times - times[0] - even).max()) / _SECOND_NS
        return (
            times[0] + np.rint(even).astype(np.int64),
            f"{what}: all rows are put {pace}, at most {moved:.2g} s from their times, which fits the rounding of each",
        )
    doubt = f"they may lie {pace}, or have been written twice" if within else "the rows do not lie evenly"
    return times, f"{what}, and are left out: {doubt}. Fix: write the times with more digits"


def _compared(columns: Iterable[Column], count: int) -> tuple[Flags, Flags]:
    """Return which rows after the first hold the same as the row before, and which fill other columns, shape (n - 1,) each."""
    same, other, known = (np.full(max(count - 1, 0), start) for start in (True, False, False))
    for column in columns:
        known[:] = True
        missing = column != column
        one = column[1:] == column[:-1]
        same &= one | (missing[1:] & missing[:-1])
        other |= missing[1:] != missing[:-1]
    return same & known, other


def _rounding(distinct: Nanoseconds) -> Floats:
    """Return what each of rising times is rounded to [ns]: the divisor of the steps behind it or before it, shape (n,)."""
    windows = np.lib.stride_tricks.sliding_window_view(np.diff(distinct), _STEPS)
    divisor = np.gcd.reduce(windows, axis=1).astype(np.float64)
    ahead = np.concatenate([divisor, np.full(_STEPS, divisor[-1])])
    behind = np.concatenate([np.full(_STEPS, divisor[0]), divisor])
    return np.asarray(np.maximum(ahead, behind))


def _line(times: Nanoseconds, rounding: Floats) -> tuple[float, float]:
    """Return start, from the first time on, and period [ns] of rows that lie evenly, the more by a time the finer it is."""
    row = np.arange(len(times), dtype=np.float64)
    columns = np.column_stack([np.ones_like(row), row]) / rounding[:, None]
    start, period = np.linalg.lstsq(columns, (times - times[0]) / rounding, rcond=None)[0]
    return float(start), float(period)


def _sizes(rounding: Floats) -> str:
    low, high = (f"{size / _SECOND_NS:.3g}" for size in (rounding.min(), rounding.max()))
    return low if low == high else f"{low} to {high}"
