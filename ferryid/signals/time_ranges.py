"""Ranges of time of a log: what ``--from`` and ``--to`` select, and a recording cut to them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.signals.empty_streams import without_empty
from ferryid.signals.order_of_time import dated
from ferryid.signals.quality import is_order
from ferryid.signals.source import on_change
from ferryid.signals.stream import Recording, Stream
from ferryid.types import Floats, Ints, Nanoseconds, TimeRange, TimeRanges
from ferryid.vessel.profile import Profile

_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:\.\d+)?))?")
_MARK = "#t="
"""Between the hash of a log and its ranges, as in the media fragments of W3C."""
_DAY_S = 86400.0
USED = "Used is"
"""How the note on a recording that was cut begins."""


class RangeError(FerryIdError):
    """A range that a log does not have: a fault of the options, whatever the log holds."""


Spans = tuple[tuple[int, int], ...]
"""First and last time of each range [ns], in order and apart."""


def parse_ranges(starts: str | None, ends: str | None) -> TimeRanges:
    """Return the ranges of ``--from`` and ``--to``: one time or several with commas, the first start with the first end.

    Raises
    ------
    FerryIdError
        For what is no time, and starts and ends that are not equally many.
    """
    firsts, lasts = _times("--from", starts), _times("--to", ends)
    if not firsts and not lasts:
        return ()
    firsts, lasts = firsts or [None] * len(lasts), lasts or [None] * len(firsts)
    if len(firsts) != len(lasts) or (len(firsts) > 1 and None in (*firsts, *lasts)):
        raise FerryIdError(
            f"--from {starts or ''} --to {ends or ''}: every range needs its start and its end, found "
            f"{len([one for one in firsts if one])} and {len([one for one in lasts if one])}. "
            "Fix: give as many to one as to the other, as in --from 60,900 --to 300,1200"
        )
    return tuple(zip(firsts, lasts, strict=True))


def _times(option: str, text: str | None) -> list[str | None]:
    if text is None or not text.strip():
        return []
    pieces = [piece.strip() for piece in text.split(",")]
    for piece in pieces:
        if not _is_time(piece):
            raise FerryIdError(
                f"{option} {text}: {piece!r} is no time. Fix: give seconds from the start of the log (60), seconds before its "
                "end (-60), or a clock time in UTC (14:30:05 or 2024-05-17T14:30:05)"
            )
    return list(pieces)


def _is_time(piece: str) -> bool:
    if _seconds(piece) is not None or _CLOCK.fullmatch(piece):
        return True
    return _date(piece) is not None


def _seconds(piece: str) -> float | None:
    try:
        value = float(piece)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _date(piece: str) -> datetime | None:
    try:
        date = datetime.fromisoformat(piece)
    except ValueError:
        return None
    return date.replace(tzinfo=UTC) if date.tzinfo is None else date.astimezone(UTC)


def cut(recording: Recording, profile: Profile, ranges: TimeRanges) -> Recording:
    """Return a recording with what lies in the ranges alone; itself where none is given.

    Seconds count from the first sample of any mapped signal, or where negative from the last. A value that holds until the
    next, such as an order, is there from the start of a range on. What is cut out between ranges is a gap like any other.

    Parameters
    ----------
    recording
        The whole log.
    profile
        Says which signals are needed.
    ranges
        As `parse_ranges` returns them.

    Raises
    ------
    RangeError
        For a range outside the log or that ends before it begins, and a clock time of a log whose times are counted from its
        start.
    FerryIdError
        Where a needed signal has no value in the ranges.
    """
    if not ranges:
        return recording
    spans = spans_of(recording.name, recording.start_ns, recording.end_ns, ranges)
    shown = _shown(spans, recording.start_ns)
    kept = {topic: _cut_stream(stream, spans) for topic, stream in recording.streams.items()}
    part = without_empty(replace(recording, streams=kept), profile, f" in {shown}", "widen --from and --to")
    length_s = (recording.end_ns - recording.start_ns) * 1e-9
    return replace(
        part,
        sha256=f"{recording.sha256}{_MARK}{_fragment(spans, recording.start_ns)}",
        notes=(f"{USED} {shown} of {length_s:.1f} s, as asked for (--from, --to).", *recording.notes),
    )


def spans_of(log: str, start: int, end: int, ranges: TimeRanges) -> Spans:
    """Return the ranges of a log between two times [ns] as times, those that overlap as one.

    Raises
    ------
    RangeError
        As `cut`.
    """
    found = []
    for asked in ranges:
        first = _placed(log, (start, end), asked[0], start, start)
        last = _placed(log, (start, end), asked[1], end, max(first, start))
        if last < start or first > end:
            raise RangeError(
                f"{log}: the range {_words(asked)} is outside the log, which is {(end - start) * 1e-9:.1f} s long"
                f"{_clock(start, end)}. Fix: correct --from and --to"
            )
        if first >= last:
            why = "is empty" if first == last else "ends before it begins"
            raise RangeError(
                f"{log}: the range {_words(asked)} {why}, found {_relative(first, start)} to "
                f"{_relative(last, start)} of the log. Fix: correct --from and --to"
            )
        found.append((max(first, start), min(last, end)))
    merged: list[tuple[int, int]] = []
    for first, last in sorted(found):
        if merged and first <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(last, merged[-1][1])
        else:
            merged.append((first, last))
    return tuple(merged)


def _placed(log: str, whole: tuple[int, int], time: str | float | None, default: int, after: int) -> int:
    """Return a time of a range [ns]; a time of day is the first one at or after `after`."""
    start, end = whole
    text = "" if time is None else str(time)
    if not text:
        return default
    if (seconds := _seconds(text)) is not None:
        # Minus zero is the end.
        return (end if math.copysign(1.0, seconds) < 0.0 else start) + round(seconds * 1e9)
    date, clock = _date(text), _CLOCK.fullmatch(text)
    if not dated(start) and (date or clock):
        raise RangeError(
            f"{log}: its times are counted from its start, so that {text} is at no place in it. "
            "Fix: give --from and --to in seconds"
        )
    if clock is not None:
        hours, minutes, rest = (float(one or 0.0) for one in clock.groups())
        of_day = hours * 3600.0 + minutes * 60.0 + rest
        midnight = after - after % round(_DAY_S * 1e9)
        placed = midnight + round(of_day * 1e9)
        # Before midnight and after it are one trial.
        return placed if placed >= after - 1_000_000_000 else placed + round(_DAY_S * 1e9)
    if date is None:
        raise RangeError(f"--from, --to: {text!r} is no time. Fix: give seconds, or a clock time in UTC")
    return round((date - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(microseconds=1)) * 1000


def _cut_stream(stream: Stream, spans: Spans) -> Stream:
    time_ns = np.asarray(stream.time_ns)
    held = len(time_ns) > 0 and on_change(stream)
    rows: list[int] = []
    times: list[Nanoseconds] = []
    begins: list[int] = []
    for first, last in spans:
        begin, stop = np.searchsorted(time_ns, [first, last + 1])
        inside = time_ns[begin:stop]
        if held and begin > 0 and (begin == len(time_ns) or time_ns[begin] > first):
            # The value that holds when the range begins.
            begin -= 1
            inside = np.concatenate(([first], inside))
        if stop > begin:
            begins.append(len(rows))
        rows.extend(range(int(begin), int(stop)))
        times.append(np.asarray(inside, dtype=np.int64))
    at = np.asarray(rows, dtype=np.int64)
    joined = np.concatenate(times)
    receive = joined if stream.receive_ns is stream.time_ns else np.asarray(stream.receive_ns)[at]
    gaps = tuple(gap for gap in stream.clock.gaps if any(gap[0] < last and gap[1] > first for first, last in spans))
    return Stream(
        stream.topic,
        joined,
        {name: _column(name, np.asarray(values), at, begins) for name, values in stream.columns.items()},
        replace(stream.clock, count=len(at), gaps=gaps),
        receive,
    )


def _column(name: str, values: Floats, rows: Ints, begins: Sequence[int]) -> Floats:
    """Return a column on some rows; an order that was written before a range begins, as it changed then, holds there."""
    kept = np.array(values[rows])
    for first in begins if is_order(name) else ():
        if not np.isfinite(kept[first]):
            earlier = np.flatnonzero(np.isfinite(values[: rows[first]]))
            if earlier.size:
                kept[first] = values[earlier[-1]]
    return kept


def content_of(sha256: str) -> str:
    """Return the hash of a log's content, without the ranges behind that of a recording that was cut."""
    return sha256.partition(_MARK)[0]


def ranges_of(sha256: str) -> tuple[tuple[float, float], ...]:
    """Return the ranges of a recording by its hash, first and last second from the log's start; none of a whole log."""
    text = sha256.partition(_MARK)[2]
    pairs = (one.split(",") for one in text.split(";") if one)
    return tuple((float(first), float(last)) for first, last in pairs)


def shares_data(one: str, other: str) -> bool:
    """Tell by their hashes whether two recordings hold some of the same data of one log."""
    if content_of(one) != content_of(other):
        return False
    mine, theirs = ranges_of(one), ranges_of(other)
    if not mine or not theirs:
        return True
    return any(a < d and c < b for a, b in mine for c, d in theirs)


def _fragment(spans: Spans, start_ns: int) -> str:
    return ";".join(f"{(a - start_ns) * 1e-9:.3f},{(b - start_ns) * 1e-9:.3f}" for a, b in spans)


def _shown(spans: Spans, start_ns: int) -> str:
    return " and ".join(f"{(a - start_ns) * 1e-9:.1f} to {(b - start_ns) * 1e-9:.1f} s" for a, b in spans)


def _words(asked: TimeRange) -> str:
    first, last = ("" if one is None else str(one) for one in asked)
    return f"from {first or 'the start'} to {last or 'the end'}"


def _relative(time_ns: int, start_ns: int) -> str:
    return f"{(time_ns - start_ns) * 1e-9:.1f} s"


def _clock(start_ns: int, end_ns: int) -> str:
    """Return the clock times of a log's start and end in brackets; nothing for one whose times count from its start."""
    if not dated(start_ns):
        return ""
    first, last = (f"{np.datetime64(one // 10**9, 's')}Z" for one in (start_ns, end_ns))
    return f" ({first} to {last})"


def as_text(ranges: Sequence[TimeRange]) -> str:
    """Return ranges as one text, which differs where they do; empty for none."""
    return ";".join(f"{'' if a is None else a},{'' if b is None else b}" for a, b in ranges)
