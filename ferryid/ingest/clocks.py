"""Which clock a topic is put on, and everything that is wrong with it: offset, drift, jitter, resets, order, gaps.

A message carries up to two times: when the recorder received it, and the sender's stamp. The stamp is free of transport
jitter and therefore preferred wherever it behaves like a clock. All topics of one log end up on one time base, the
recorder's: stamps whose clock is off by more than a second (never set, another time zone) are shifted onto it as a
whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.ingest.log import Column, Series
from ferryid.ingest.many_rows import of_each
from ferryid.ingest.rounded_times import unrounded
from ferryid.ingest.stamp_clock import CONSTANT_OFFSET_NS, SECOND_NS, STEP_NS, ClockFacts, compare_clocks, spread_sample
from ferryid.ingest.stray_times import stray_times
from ferryid.types import Nanoseconds

Rows = NDArray[np.int64]

_GAP_PERIODS = 3.0
_SHORTEST_GAP_NS = 200_000_000
_QUARTER_HOUR_NS = 900 * SECOND_NS


@dataclass(frozen=True)
class ClockReport:
    """What was found and done about the time of one topic.

    Attributes
    ----------
    source
        ``"stamp"`` or ``"receive"``: the clock that the rows are on. The time column of a table counts as the latter.
    count
        Rows kept.
    rate_hz
        Rows per second outside gaps; NaN for fewer than two rows.
    offset_s
        Median of receive time minus stamp [s]; NaN without stamps.
    drift_ppm
        How much faster the recorder's clock runs than the stamps [ppm]; NaN where it cannot be told.
    jitter_s
        Robust standard deviation of receive time minus stamp about its line, or without stamps of the period [s].
    resets
        Times that either clock was set: lasting steps of receive time against stamp, or of time backwards.
    out_of_order
        Rows that came after a later one; sorted into place.
    duplicates
        Rows with the time of an earlier row; left out.
    dropped
        Rows left out in all: duplicates, strays, and stretches on the far side of a reset of the only clock.
    replaced
        Rows whose stamp was zero or a stray and was replaced by receive time less the median offset.
    shift_s
        What was added to the stamps to bring them to the recorder's time base [s].
    gaps
        Start and end [ns] of every stretch without rows, longer than three periods and 0.2 s.
    notes
        Sentences for the user.
    strays
        Rows left out because their time contradicts that of the rows before and after.
    """

    source: str
    count: int
    rate_hz: float
    offset_s: float
    drift_ppm: float
    jitter_s: float
    resets: int
    out_of_order: int
    duplicates: int
    dropped: int = 0
    replaced: int = 0
    shift_s: float = 0.0
    gaps: tuple[tuple[int, int], ...] = ()
    notes: tuple[str, ...] = ()
    strays: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Return the report for JSON: tuples as lists, NaN as None."""
        plain = asdict(self)
        for name in ("rate_hz", "offset_s", "drift_ppm", "jitter_s"):
            if not np.isfinite(plain[name]):
                plain[name] = None
        plain["gaps"] = [list(gap) for gap in self.gaps]
        plain["notes"] = list(self.notes)
        return plain

    @staticmethod
    def from_dict(plain: Mapping[str, Any]) -> ClockReport:
        """Build a report from `to_dict`'s output."""
        values = dict(plain)
        for name in ("rate_hz", "offset_s", "drift_ppm", "jitter_s"):
            values[name] = float("nan") if values[name] is None else float(values[name])
        values["gaps"] = tuple((int(start), int(end)) for start, end in values["gaps"])
        values["notes"] = tuple(values["notes"])
        return ClockReport(**values)


def repair_all(series: Mapping[str, Series]) -> dict[str, tuple[Nanoseconds, Rows, ClockReport]]:
    """Repair all topics of one log such that stamps of one sender stay as far apart as they were.

    Topics whose clock offsets lie within a second of one another come from one sender's clock: all are shifted by the
    smallest of their offsets, which holds the least latency. Otherwise each topic is brought to the recorder's time base by
    its own offset.

    Returns
    -------
    dict
        By topic: strictly rising times [ns], shape (m,); the indices of the rows kept, in that order, shape (m,); the report.
    """
    each = of_each(
        lambda one: _one_topic(one.receive_ns, one.stamp_ns, one.time_column, one.columns),
        series.values(),
        sum(len(one.receive_ns) for one in series.values()),
    )
    found = dict(zip(series, each, strict=True))
    stamped = sorted(
        (report.offset_s, topic)
        for topic, (_, _, report) in found.items()
        if report.source == "stamp" and _base_shift(report.offset_s) != 0
    )
    shifts = dict.fromkeys(found, 0)
    first = float("nan")
    for offset_s, topic in stamped:
        if not offset_s - first < CONSTANT_OFFSET_NS * 1e-9:
            first = offset_s
        shifts[topic] = _base_shift(first)
    return {topic: _shifted(*found[topic], shifts[topic]) for topic in found}


def _base_shift(offset_s: float) -> int:
    """Shift [ns] that brings stamps with this median offset to the recorder's time base, 0 for plain latency."""
    if not np.isfinite(offset_s):
        return 0
    offset = round(offset_s * SECOND_NS)
    if abs(offset) <= CONSTANT_OFFSET_NS:
        return 0
    zone = round(offset / _QUARTER_HOUR_NS) * _QUARTER_HOUR_NS
    # Two clocks that are right but written in different time zones: what remains is latency, and is kept.
    return zone if zone != 0 and 0 <= offset - zone < SECOND_NS // 2 else offset


def _shifted(
    time_ns: Nanoseconds, rows: Rows, report: ClockReport, shift_ns: int
) -> tuple[Nanoseconds, Rows, ClockReport]:
    if report.source != "stamp" or shift_ns == 0:
        return time_ns, rows, report
    zone = " (a time zone?)" if shift_ns % _QUARTER_HOUR_NS == 0 else ""
    side = "behind" if shift_ns > 0 else "ahead of"
    span = _span_text(abs(shift_ns))
    note = f"the sender's clock is {span} {side} the recorder's{zone}: stamps are shifted onto the recorder's"
    gaps = tuple((start + shift_ns, end + shift_ns) for start, end in report.gaps)
    return (
        time_ns + np.int64(shift_ns),
        rows,
        replace(report, shift_s=shift_ns / SECOND_NS, gaps=gaps, notes=(*report.notes, note)),
    )


def _span_text(nanoseconds: int) -> str:
    seconds = nanoseconds / SECOND_NS
    if seconds < 600:
        return f"{seconds:.3f} s"
    if seconds < 172_800:
        return f"{seconds / 3600:.4g} h"
    return f"{seconds / 86_400:.6g} days"


def _one_topic(
    receive_ns: Nanoseconds,
    stamp_ns: Nanoseconds | None,
    time_column: str = "",
    columns: Mapping[str, Column] | None = None,
) -> tuple[Nanoseconds, Rows, ClockReport]:
    """Repair one topic, its stamps not yet shifted to the recorder's base."""
    receive = np.ascontiguousarray(receive_ns, dtype=np.int64)
    if stamp_ns is None:
        if not time_column:
            return _ordered(receive, "receive", ("no header: receive times only",), drop_far_side=True)
        receive, rounded = unrounded(receive, (columns or {}).values())
        notes = (f'times are those of its time column "{time_column}"', *filter(None, [rounded]))
        return _ordered(receive, "receive", notes, drop_far_side=True)
    stamp = np.ascontiguousarray(stamp_ns, dtype=np.int64)
    reason, notes, stamp, facts = compare_clocks(receive, stamp)
    if reason:
        return _ordered(receive, "receive", (f"{reason}: receive times are used", *notes), facts, drop_far_side=True)
    astray = int(np.count_nonzero(stray_times(receive)[0]))
    if astray:
        notes = (
            *notes,
            f"{astray} of {len(receive)} receive times contradict those of the rows before and after: stamps are used",
        )
    return _ordered(stamp, "stamp", notes, facts)


def _ordered(
    times: Nanoseconds,
    source: str,
    notes: tuple[str, ...],
    facts: ClockFacts | None = None,
    *,
    drop_far_side: bool = False,
) -> tuple[Nanoseconds, Rows, ClockReport]:
    """Sort the rows, leave out repeated times, find gaps, and write the report."""
    facts = facts or ClockFacts()
    told = list(notes)
    count = len(times)
    rows = np.arange(count, dtype=np.int64)
    resets = facts.resets
    steps = np.diff(times)
    lowest = int(steps.min(initial=1))
    strays = 0
    stray, late = stray_times(times) if drop_far_side else (np.zeros(count, dtype=bool),) * 2
    if stray.any():
        strays = int(np.count_nonzero(stray))
        told.append(
            f"{strays} of {counted(count, 'row')} left out, first row {int(np.argmax(stray)) + 1}: the time "
            "contradicts that of the "
            "rows before and after"
        )
        rows, times, late = rows[~stray], times[~stray], late[~stray]
        steps = np.diff(times)
        lowest = int(steps.min(initial=1))
    if lowest < -STEP_NS and drop_far_side:
        start, stop, backward = _longest_stretch(times, late)
        if stop - start < len(times):
            resets += backward
            far = len(times) - (stop - start)
            told.append(
                f"time jumps back {counted(backward, 'time')}, the clock was set or several runs follow one another: only the "
                f"longest stretch of {counted(stop - start, 'row')} is used, {counted(far, 'row')} {verb(far, 'is')} left out"
            )
            rows, times = rows[start:stop], times[start:stop]
            steps = np.diff(times)
            lowest = int(steps.min(initial=1))
    out_of_order = duplicates = 0
    if lowest < 0:
        out_of_order = int(np.count_nonzero(times < np.maximum.accumulate(times)))
        order = np.argsort(times, kind="stable")
        rows, times = rows[order], times[order]
        steps = np.diff(times)
        lowest = int(steps.min(initial=1))
    if lowest == 0:
        fresh = np.concatenate(([True], steps > 0))
        duplicates = len(times) - int(np.count_nonzero(fresh))
        rows, times = rows[fresh], times[fresh]
        steps = np.diff(times)
    gaps, period, varies = _gaps(times, steps)
    silent = sum(end - start for start, end in gaps)
    spoken = len(times) - 1 - len(gaps)
    span = int(times[-1] - times[0]) - silent if len(times) > 1 else 0
    if varies:
        told.append("the period varies: gaps are counted against the longer of its periods")
    jitter = facts.jitter_s
    if not np.isfinite(jitter) and len(steps) > 1:
        sample = spread_sample(steps)
        jitter = 1.4826 * float(np.median(np.abs(sample - period))) / SECOND_NS
    report = ClockReport(
        source=source,
        count=len(times),
        rate_hz=spoken / (span / SECOND_NS) if span > 0 and spoken > 0 else float("nan"),
        offset_s=facts.offset_s,
        drift_ppm=facts.drift_ppm,
        jitter_s=jitter,
        resets=resets,
        out_of_order=out_of_order,
        duplicates=duplicates,
        dropped=count - len(times),
        replaced=facts.replaced,
        gaps=gaps,
        notes=tuple(told),
        strays=strays,
    )
    return times, rows, report


def _gaps(times: Nanoseconds, steps: Nanoseconds) -> tuple[tuple[tuple[int, int], ...], float, bool]:
    """Stretches without rows, the usual period [ns], and whether the period varies too much to be one."""
    if len(steps) == 0:
        return (), float("nan"), False
    sample = spread_sample(steps)
    period = float(np.median(sample))
    limit = max(_GAP_PERIODS * period, _SHORTEST_GAP_NS)
    varies = len(sample) >= 20 and bool(np.mean(sample > limit) > 0.05)
    if varies:
        limit = max(_GAP_PERIODS * float(np.quantile(sample, 0.95)), _SHORTEST_GAP_NS)
    places = np.flatnonzero(steps > limit)
    return tuple((int(times[place]), int(times[place + 1])) for place in places), period, varies


def _longest_stretch(times: Nanoseconds, late: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Start and stop of the longest stretch without a lasting jump back, and how many such jumps there are.

    Rows written late are no jump back; they belong to the stretch around them.
    """
    whole = len(times)
    places = np.append(np.flatnonzero(~late), whole)
    places[0] = 0
    times = times[~late]
    backward = np.flatnonzero(np.diff(times) < -STEP_NS)
    highest = np.maximum.accumulate(times)
    # A jump back lasts unless later rows soon rise past what came before; a single late row does so at once.
    lasting = [int(p) + 1 for p in backward if int(np.max(times[p + 1 : p + 4])) < int(highest[p])]
    if not lasting:
        return 0, whole, 0
    edges = [0, *lasting, len(times)]
    lengths = np.diff(edges)
    best = int(np.argmax(lengths))
    return int(places[edges[best]]), int(places[edges[best + 1]]), len(lasting)
