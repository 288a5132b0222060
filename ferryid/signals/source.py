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
    for part, rows in _parts(stream):
        # Rows of a table without an order are no gap of it where each order that is written is another one.
        written = all(is_order(name) for name in part.columns) and 1 < rows.sum() < rows.size and _as_it_changes(rows)
        source = source_of(part, written=written and _says_new(part.columns))
        if written and source.on_change:
            source = replace(source, remarks=(_held_for(part, stream), *source.remarks))
        elif not rows.all():
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
    of which hardly any two values lie on neighbouring rows, or whose values lie apart at regular times, is one of these; so is
    an order that is written when it changes. Other columns stay together, whatever they lack: a sensor that fails has gaps.
    """
    return tuple(part for part, _ in _parts(stream))


def _parts(stream: Stream) -> list[tuple[Stream, Flags]]:
    """Return the parts of `at_own_rates`, each with the rows that it has, shape (n,)."""
    time_s = np.asarray((stream.time_ns - stream.time_ns[:1]) * 1e-9, dtype=np.float64)
    every = np.ones(time_s.size, dtype=bool)
    columns: dict[bytes, list[str]] = {}
    rows: dict[bytes, Flags] = {}
    for name, values in stream.columns.items():
        finite: Flags = np.isfinite(values)
        for other in next((pair for pair in _TOGETHER if name in pair), ()):
            finite = finite | np.isfinite(stream.columns.get(other, values))
        if is_load(name) or not _at_own_rate(name, finite, time_s):
            finite = every
        columns.setdefault(finite.tobytes(), []).append(name)
        rows.setdefault(finite.tobytes(), finite)
    if len(columns) < 2 and all(one.all() for one in rows.values()):
        return [(stream, every)]
    return [
        (
            replace(
                stream,
                time_ns=stream.time_ns[rows[key]],
                columns={name: stream.columns[name][rows[key]] for name in names},
                receive_ns=stream.receive_ns[rows[key]],
            ),
            rows[key],
        )
        for key, names in columns.items()
    ]


def _at_own_rate(name: str, finite: Flags, time_s: Floats) -> bool:
    """Return whether a column with values on some rows, shape (n,), has them at a rate of its own."""
    rows = np.flatnonzero(finite)
    if not 1 < rows.size < finite.size:
        return False
    apart = np.diff(rows)
    usually_apart = bool(np.median(apart) >= SIGNALS.rows_apart)
    if is_order(name):
        return usually_apart or _as_it_changes(finite)
    weather = name.startswith(_WEATHER)
    slowest_s = SIGNALS.slowest_weather_s if weather else SIGNALS.slowest_sensor_s
    often = float(np.median(np.diff(time_s[rows]))) <= slowest_s
    # Two values are what is left of an anemometer that fails.
    if not often or (weather and rows.size < SIGNALS.fewest_weather_values):
        return False
    # Of a sensor that fails, values are left on neighbouring rows too, or at irregular times.
    few_neighbours = bool(np.quantile(apart, SIGNALS.neighbouring_share) >= SIGNALS.rows_apart)
    return few_neighbours or (usually_apart and _regular(np.diff(time_s[rows])))


def _regular(apart: Floats) -> bool:
    """Return whether most distances between values, shape (n,), are about the usual one."""
    low, high = SIGNALS.regular_range
    usual = float(np.median(apart))
    return float(np.mean((apart > low * usual) & (apart < high * usual))) >= SIGNALS.regular_share


def _as_it_changes(finite: Flags) -> bool:
    """Return whether an order in some rows of a table, shape (n,), is missing from the others as it is the same there.

    Either its values lie apart at irregular times, or it often rests, and no rest is most of all, as where a recorder fails.
    """
    rows = np.flatnonzero(finite)
    apart = np.diff(rows)
    usual = float(np.median(apart))
    # It is held to the end of the table.
    rests = np.append(apart, finite.size - rows[-1])
    rests = rests[rests > SIGNALS.gap_periods * usual]
    often = rests.size >= SIGNALS.fewest_rests and 2 * int(rests.max()) <= int(rests.sum())
    return often or (usual >= SIGNALS.rows_apart and not _regular(apart.astype(np.float64)))


def _held_for(part: Stream, table: Stream) -> str:
    """Return for how long the orders of a part are held, to the end of their table, as a sentence."""
    longest_s = float(np.diff(np.append(part.time_ns, table.time_ns[-1:])).max()) * 1e-9
    return (
        f"{table.topic}: {', '.join(part.columns)} {verb(len(part.columns), 'has')} a value in {part.time_ns.size} of "
        f"{counted(table.time_ns.size, 'row')}: taken as written when it changes; each value holds until the next, at most "
        f"for {longest_s:.1f} s."
    )


def source_of(stream: Stream, *, written: bool = False) -> Source:
    """Take implausible, stale and stuck samples out of a stream, and find what counts as a gap in it.

    `written` is True of orders that are known to be written when they change.
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
    unchanged = written or _on_change(time_s, stream.columns)
    interval = np.diff(time_s)
    gaps = interval > bridge
    if interval.size and all(is_load(name) for name in columns):
        remarks.append(f"{stream.topic}: each value holds until the next, at most for {interval.max():.1f} s.")
    elif interval.size and unchanged and not written:
        remarks.append(
            f"{stream.topic}: published when it changes; each value holds until the next, "
            f"at most for {interval.max():.1f} s."
        )
    elif gaps.any() and not unchanged:
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
