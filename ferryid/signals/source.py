"""One stream before it goes on a grid: wild, stale and stuck samples taken out, its usual period, what counts as a gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ferryid.counts import counted, verb
from ferryid.signals.quality import VELOCITY, clean, is_actuator, is_load, is_order, stale, stuck
from ferryid.signals.stream import Stream
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import segments
from ferryid.types import Flags, Floats, Nanoseconds

_TOGETHER = (
    ("x", "y"),
    ("u", "v"),
    ("vel_N", "vel_E"),
    ("wind_speed", "wind_from"),
    ("wind_N", "wind_E"),
    ("current_N", "current_E"),
)
"""Signals that are worked on in pairs, at the same times."""
_WEATHER = ("wind", "current")


@dataclass(frozen=True)
class Held:
    """A stretch in which signals are wrong, mostly as they repeat an old value.

    Attributes
    ----------
    signals
        Canonical names.
    start_ns, end_ns
        Times of the last right sample before and of the first one after [ns].
    reason
        What is wrong, to stand after "because".
    repeats
        True where an old value was repeated.
    """

    signals: tuple[str, ...]
    start_ns: int
    end_ns: int
    reason: str
    repeats: bool = False


@dataclass(frozen=True)
class Source:
    """One stream, cleaned.

    Attributes
    ----------
    topic
        Its name.
    time_ns
        Times [ns], shape (n,).
    columns
        Canonical name to values, shape (n,), NaN where a sample is missing or was taken out.
    period_s, bridge_s
        Usual period, and the longest interval that is interpolated [s].
    on_change
        True where each value holds until the next.
    held
        Stretches that repeat an old measurement.
    taken_out
        What was taken out or is interpolated, as sentences with numbers.
    remarks
        What else was found, and how values are bridged, as sentences.
    """

    topic: str
    time_ns: Nanoseconds
    columns: Mapping[str, Floats]
    period_s: float
    bridge_s: float
    on_change: bool
    held: tuple[Held, ...] = ()
    taken_out: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def sources_of(stream: Stream) -> tuple[Source, ...]:
    """Clean a stream: one source, and more where columns have values at rates of their own; see `at_own_rates`."""
    sources = []
    for part in at_own_rates(stream):
        merged = part.time_ns.size < stream.time_ns.size
        source = source_of(part, merged=merged)
        if merged:
            said = (
                f"{stream.topic}: {', '.join(part.columns)} {'has' if len(part.columns) == 1 else 'have'} a value in "
                f"{part.time_ns.size} of {counted(stream.time_ns.size, 'row')}, "
                f"every {source.period_s:.3g} s: taken as measured at that rate."
            )
            source = replace(source, remarks=(said, *source.remarks))
        sources.append(source)
    return tuple(sources)


def at_own_rates(stream: Stream) -> tuple[Stream, ...]:
    """Return a stream in parts, each of the columns that have their values in the same rows, at the times of these.

    A table that several sensors were merged into has rows in which others than the one that was read have no value. A column
    of which hardly any two values lie on neighbouring rows is one of these; so is an order that some rows lack, as it may be
    written when it changes. Other columns stay together, whatever they lack: a sensor that fails has gaps.
    """
    time_s = np.asarray((stream.time_ns - stream.time_ns[:1]) * 1e-9, dtype=np.float64)
    columns: dict[bytes, list[str]] = {}
    rows: dict[bytes, Flags] = {}
    for name, values in stream.columns.items():
        finite: Flags = np.isfinite(values)
        for other in next((pair for pair in _TOGETHER if name in pair), ()):
            finite = finite | np.isfinite(stream.columns.get(other, values))
        key = finite.tobytes() if not is_load(name) and _at_own_rate(name, finite, time_s) else b""
        columns.setdefault(key, []).append(name)
        rows.setdefault(key, finite)
    if list(columns) in ([], [b""]):
        return (stream,)
    return tuple(
        replace(
            stream,
            time_ns=stream.time_ns[rows[key]] if key else stream.time_ns,
            columns={name: stream.columns[name][rows[key]] if key else stream.columns[name] for name in names},
            receive_ns=stream.receive_ns[rows[key]] if key else stream.receive_ns,
        )
        for key, names in columns.items()
    )


def _at_own_rate(name: str, finite: Flags, time_s: Floats) -> bool:
    """Return whether a column with values on some rows, shape (n,), has them at a rate of its own."""
    rows = np.flatnonzero(finite)
    if not 1 < rows.size < finite.size:
        return False
    if is_order(name):
        return True
    # Of a sensor that fails, values are left on neighbouring rows too.
    own = float(np.quantile(np.diff(rows), SIGNALS.neighbouring_share)) >= SIGNALS.rows_apart
    slowest_s = SIGNALS.slowest_weather_s if name.startswith(_WEATHER) else SIGNALS.slowest_sensor_s
    return own and float(np.median(np.diff(time_s[rows]))) <= slowest_s


def source_of(stream: Stream, *, merged: bool = False) -> Source:
    """Take implausible, stale and stuck samples out of a stream, and find what counts as a gap in it.

    `merged` is True of columns that other rows of their table lack.
    """
    time_ns = np.asarray(stream.time_ns)
    time_s = (time_ns - time_ns[0]) * 1e-9
    period = _usual_period(time_s)
    bridge = _bridge(period)
    columns: dict[str, Floats] = {}
    taken_out: list[str] = []
    remarks: list[str] = []
    for name, raw in stream.columns.items():
        columns[name], quality = clean(name, time_s, raw)
        taken_out += quality.taken_out()
        remarks += quality.remarks()
    held: list[Held] = []
    old = stale(time_s, stream.columns, bridge)
    if old.any():
        for values in columns.values():
            values[old] = np.nan
        held += _stretches(tuple(columns), time_ns, old, f"{stream.topic} repeats an old measurement")
        taken_out.append(
            f"{stream.topic}: {int(old.sum())} of {counted(old.size, 'message')} "
            f"{verb(int(old.sum()), 'repeats')} an old measurement for more than "
            f"{bridge:.2f} s; taken as missing."
        )
    frozen = max(bridge, SIGNALS.stuck_periods * period)
    for name in VELOCITY:
        if name in columns and (same := stuck(time_s, stream.columns[name], frozen) & ~old).any():
            columns[name][same] = np.nan
            held += _stretches((name,), time_ns, same, f"{name} repeats an old value to the last digit")
            taken_out.append(
                f"{name}: {int(same.sum())} of {counted(same.size, 'sample')} "
                f"{verb(int(same.sum()), 'repeats')} an old one to the last digit for more "
                f"than {frozen:.2f} s; taken as missing."
            )
    # Rows of a table without an order are no gap of it where each order that is written is another one.
    written = merged and all(is_order(name) for name in stream.columns) and _says_new(stream.columns)
    unchanged = written or _on_change(time_s, stream.columns)
    interval = np.diff(time_s)
    gaps = interval > bridge
    if interval.size and all(is_load(name) for name in columns):
        remarks.append(f"{stream.topic}: each value holds until the next, at most for {interval.max():.1f} s.")
    elif interval.size and unchanged:
        remarks.append(
            f"{stream.topic}: published when it changes; each value holds until the next, "
            f"at most for {interval.max():.1f} s."
        )
    elif gaps.any():
        remarks.append(
            f"{stream.topic}: {counted(int(gaps.sum()), 'gap')} longer than {bridge:.2f} s, {interval[gaps].sum():.1f} s in "
            "all; not bridged."
        )
    return Source(
        stream.topic, time_ns, columns, period, bridge, unchanged, tuple(held), tuple(taken_out), tuple(remarks)
    )


def _stretches(signals: tuple[str, ...], time_ns: Nanoseconds, wrong: Flags, reason: str) -> list[Held]:
    last = time_ns.size - 1
    return [
        Held(signals, int(time_ns[max(one.start - 1, 0)]), int(time_ns[min(one.stop, last)]), reason, True)
        for one in segments(wrong)
    ]


def _bridge(period_s: float) -> float:
    """Return the longest interval [s] that is interpolated in a stream of this usual period."""
    return max(SIGNALS.gap_periods * period_s, SIGNALS.gap_s)


def _usual_period(time_s: Floats) -> float:
    """Return the mean interval [s] of a stream without its gaps.

    The mean, since messages that are received in bursts leave a median that says nothing.
    """
    interval = np.diff(time_s)
    interval = interval[interval > 0.0]
    if interval.size == 0:
        return 1.0
    period = float(interval.mean())
    for _ in range(5):
        within = interval <= _bridge(period)
        if not within.any():
            break
        shorter = float(interval[within].mean())
        if shorter == period:
            break
        period = shorter
    return period


def on_change(stream: Stream) -> bool:
    """True for a stream whose values hold until the next: of orders, or published when it changes."""
    time_s = (stream.time_ns - stream.time_ns[0]) * 1e-9
    return all(is_order(name) for name in stream.columns) or _on_change(time_s, stream.columns)


def _on_change(time_s: Floats, columns: Mapping[str, Floats]) -> bool:
    """True for a payload, and actuator streams that are irregular and whose messages (nearly) all say something new."""
    if all(is_load(name) for name in columns):
        return True
    if not all(is_actuator(name) or is_order(name) for name in columns) or time_s.size < 3:
        return False
    interval = np.diff(time_s)
    irregular = float(np.mean(interval > SIGNALS.gap_periods * np.median(interval)))
    return irregular > SIGNALS.irregular_share and _says_new(columns)


def _says_new(columns: Mapping[str, Floats]) -> bool:
    """Return whether (nearly) every message says something else than the one before."""
    new = np.any([np.diff(values) != 0.0 for values in columns.values()], axis=0)
    return new.size > 0 and float(new.mean()) > SIGNALS.new_share
