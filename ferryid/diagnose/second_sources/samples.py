"""Reading what may be compared: on the log's time base, thinned, angles unwrapped, with what its values show by themselves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.diagnose.checks.spans import RATE_HZ
from ferryid.diagnose.data.measurements import MeasuredLog
from ferryid.diagnose.second_sources.candidates import Candidate
from ferryid.diagnose.second_sources.thresholds import SECOND
from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.clocks import repair_all
from ferryid.ingest.log import Series
from ferryid.signals.quality import clean
from ferryid.signals.stream import Recording
from ferryid.types import Flags, Floats, Nanoseconds
from ferryid.vessel.field_words import words_of
from ferryid.vessel.frames import WGS84_A_M, local_north_east, yaw_of_quaternion

NOT_READ, FEW, CONSTANT, BROKEN, APART, MANY = (
    "could not be read",
    "has too few samples",
    "never changes",
    "has no values that can be used",
    "was not recorded while the vessel was measured",
    "is beyond the number of signals that are compared",
)
"""Why a signal is passed over."""

_TURN = 2.0 * np.pi
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Samples:
    """One signal of one log.

    Attributes
    ----------
    t
        Times from the measurements' first row [s], at least a fifth of a second apart, shape (n,).
    values
        Angles in radians and unwrapped, positions in metres where latitudes, else as recorded, shape (n, k).
    period_s
        Usual interval of the topic itself [s].
    clock
        ``"stamp"`` or ``"receive"``.
    stamps
        Its times as recorded [ns], by which topics of one sender are known.
    quantum
        Step of the values in the unit in which they are compared, 0 where there is none, shape (k,).
    missing, wraps
        Samples without a value, and angles interpolated through a wrap.
    unit
        Of an angle as recorded: ``"deg"``, ``"rad"``, or empty.
    """

    t: Floats
    values: Floats
    period_s: float
    clock: str
    stamps: Nanoseconds
    quantum: Floats
    missing: int = 0
    wraps: int = 0
    unit: str = ""


def read_samples(log: MeasuredLog, wanted: Sequence[Candidate]) -> tuple[dict[Candidate, Samples], Counter[str]]:
    """Read signals of a log, and count those that are passed over by the reason.

    Nothing here stops a diagnosis: a topic that cannot be read is passed over.
    """
    skipped: Counter[str] = Counter()
    profile = log.measurements.profile
    counts = {topic.name: topic.count for topic in log.survey.recording.topics}
    large = [one for one in wanted if counts.get(one.topic, 0) > SECOND.most_messages]
    small = [one for one in wanted if counts.get(one.topic, 0) < SECOND.fewest_samples]
    skipped.update({MANY: len(large), FEW: len(small)})
    wanted = [one for one in wanted if one not in (*large, *small)]
    skipped[MANY] += max(len(wanted) - SECOND.most_signals, 0)
    wanted = wanted[: SECOND.most_signals]
    fields: dict[str, list[str]] = {}
    for one in wanted:
        fields.setdefault(one.topic, []).extend(field for field in one.fields if field not in fields.get(one.topic, ()))
    found: dict[Candidate, Samples] = {}
    try:
        series = open_log(log.path, profile.table).read(fields) if fields else {}
    except FerryIdError:
        skipped[NOT_READ] += len(wanted)
        return found, +skipped
    times = _times(series, log.survey.recording)
    for one in wanted:
        got = _samples(one, series[one.topic], *times[one.topic], log.survey.t0_ns)
        if isinstance(got, str):
            skipped[got] += 1
        else:
            found[one] = got
    return found, +skipped


SLOPE = "slope of the mapped "
"""Topic of what is derived from mapped signals."""


def mapped_slopes(log: MeasuredLog) -> dict[Candidate, Samples]:
    """Return the slopes of the mapped heading and position, where yaw rate and velocity are mapped as well."""
    measured, mapped = log.measurements, log.survey.recording.found
    known, found = measured.usable, dict[Candidate, Samples]()
    wanted = (
        ("heading", "yaw_rate", (2,), "psi" in mapped and "r" in mapped),
        ("position", "velocity", (0, 1), "x" in mapped and bool({"u", "vel_N"} & set(mapped))),
    )
    for source, kind, columns, both in wanted:
        slopes = np.gradient(measured.eta[:, list(columns)], measured.step_s, axis=0)
        # Beside a row that was bridged, the slope is not measured.
        inner = known & np.append(known[1:], False) & np.insert(known[:-1], 0, False) & np.isfinite(slopes).all(axis=1)
        if not both or np.count_nonzero(inner) < SECOND.fewest_samples:
            continue
        t, values = _thinned(measured.t[inner], slopes[inner])
        zero = np.zeros(len(columns))
        found[Candidate(SLOPE + source, (), kind)] = Samples(
            t, values, measured.step_s, "receive", np.empty(0, dtype=np.int64), zero
        )
    return found


def _times(
    series: dict[str, Series], recording: Recording
) -> dict[str, tuple[Nanoseconds, np.ndarray[tuple[int], np.dtype[np.int64]], str]]:
    """Return times, rows and clock of every topic, on the time base that the mapped topics are on."""
    shifts = {
        round(stream.clock.offset_s): stream.clock.shift_s
        for stream in recording.streams.values()
        if stream.clock.source == "stamp" and np.isfinite(stream.clock.offset_s)
    }
    found = {}
    for topic, (time_ns, rows, clock) in repair_all(series).items():
        moved = 0.0
        if clock.source == "stamp" and np.isfinite(clock.offset_s):
            # One sender's clock: all its topics are shifted alike.
            near = [shift for offset, shift in shifts.items() if abs(offset - clock.offset_s) <= 1.0]
            moved = near[0] - clock.shift_s if near else 0.0
        found[topic] = (time_ns + np.int64(round(moved * 1e9)), rows, clock.source)
    return found


def _samples(
    one: Candidate,
    series: Series,
    time_ns: Nanoseconds,
    rows: np.ndarray[tuple[int], np.dtype[np.int64]],
    clock: str,
    t0_ns: int,
) -> Samples | str:
    columns = []
    for field in one.fields:
        column = np.asarray(series.columns[field])
        if column.dtype.kind not in "fiu":
            return BROKEN
        with np.errstate(invalid="ignore"):
            columns.append(np.asarray(column, dtype=np.float64)[rows])
    finite: Flags = np.asarray(np.isfinite(np.column_stack(columns)).all(axis=1))
    missing = int(len(finite) - finite.sum())
    time_s = np.asarray((time_ns - t0_ns) * 1e-9, dtype=np.float64)[finite]
    columns = [column[finite] for column in columns]
    if len(time_s) < SECOND.fewest_samples:
        return BROKEN if missing else FEW
    still = [np.ptp(column) == 0.0 for column in columns]
    # A component that nobody measured would turn and stretch the whole vector.
    if all(still) or (any(still) and one.form != "quaternion"):
        return CONSTANT
    period = float(np.median(np.diff(time_s)))
    quantum = [_quantum(column) for column in columns]
    wraps, unit = 0, ""
    if one.form == "quaternion":
        columns, quantum = [yaw_of_quaternion(*columns)], [0.0]
    elif one.form == "geodetic" or (one.kind == "position" and _are_degrees(columns)):
        placed = _placed(columns)
        if placed is None:
            return BROKEN
        columns, turn = placed
        quantum = [step * turn * WGS84_A_M for step in quantum]
        unit = "deg" if turn < 1.0 else "rad"
    elif one.form == "polar":
        turn, unit = _angle(columns[1], one.fields[1])
        course = columns[1] * turn
        columns, quantum = [columns[0] * np.cos(course), columns[0] * np.sin(course)], [0.0, 0.0]
    elif one.kind == "heading":
        turn, unit = _angle(columns[0], one.fields[0])
        columns, quantum = [columns[0] * turn], [quantum[0] * turn]
    if one.kind == "heading":
        kept = np.isfinite(columns[0])
        if np.count_nonzero(kept) < SECOND.fewest_samples or np.ptp(columns[0][kept]) == 0.0:
            return CONSTANT if kept.any() else BROKEN
        angle, quality = clean("psi", time_s, columns[0])
        wraps, kept = quality.through_wrap, np.isfinite(angle)
        time_s, columns, missing = time_s[kept], [angle[kept]], missing + quality.missing
    t, values = _thinned(time_s, np.column_stack(columns))
    return Samples(t, values, period, clock, time_ns, np.array(quantum), missing, wraps, unit)


def _are_degrees(columns: Sequence[Floats]) -> bool:
    """Return whether what is called a position is latitude and longitude: metres do not stay within a tenth far from zero."""
    spans = [float(np.ptp(column)) for column in columns]
    return all(
        span < SECOND.degrees_extent and abs(float(np.median(column))) > SECOND.degrees_far * span
        for span, column in zip(spans, columns, strict=True)
    )


def _placed(columns: Sequence[Floats]) -> tuple[list[Floats], float] | None:
    """Return metres north and east of latitudes and longitudes, and their unit [rad]; None for what is neither deg nor rad."""
    # A receiver without a fix writes zeros.
    latitude, longitude = (np.where((columns[0] == 0.0) & (columns[1] == 0.0), np.nan, one) for one in columns)
    known = np.isfinite(latitude)
    if not known.any() or np.abs(latitude[known]).max() > 90.0 or np.abs(longitude[known]).max() > 360.0:
        return None
    radians = bool(np.abs(latitude[known]).max() <= 0.5 * np.pi and np.abs(longitude[known]).max() <= np.pi)
    turn = 1.0 if radians else np.pi / 180.0
    return list(local_north_east(latitude * turn, longitude * turn)), turn


def _angle(values: Floats, field: str) -> tuple[float, str]:
    """Return the factor to radians of an angle and its unit, by the field's name or its range."""
    words = set(words_of(field))
    if not words & {"rad", "radians"} and (words & {"deg", "degrees"} or float(np.abs(values).max()) > 1.01 * _TURN):
        return np.pi / 180.0, "deg"
    return 1.0, "rad"


def _quantum(values: Floats) -> float:
    """Return the step that values are multiples of, 0 where they are finer."""
    different = np.unique(values)
    if len(different) < 3 or len(different) > 0.5 * len(values):
        return 0.0
    step = np.diff(different)
    least = float(np.quantile(step, 0.05))
    if least <= 0.0:
        return 0.0
    turns = np.round((values - values[0]) / least)
    # The step to all digits: by the largest multiple of it.
    largest = int(np.argmax(np.abs(turns)))
    exact = float((values[largest] - values[0]) / turns[largest])
    off = np.abs((values - values[0]) / exact - turns)
    return abs(exact) if float(np.mean(off < 0.05)) >= SECOND.on_steps else 0.0


def _thinned(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return means over the intervals of the rate at which windows are made, of a faster signal."""
    known = np.isfinite(values).all(axis=1)
    time_s, values = time_s[known], values[known]
    if len(time_s) == 0:
        return time_s, values
    place = np.floor((time_s - time_s[0]) * RATE_HZ + _ROUNDING).astype(np.int64)
    first = np.flatnonzero(np.diff(place, prepend=-1) > 0)
    number = np.diff(np.append(first, len(place)))
    sums = np.add.reduceat(np.column_stack([time_s, values]), first, axis=0) / number[:, None]
    return sums[:, 0], sums[:, 1:]
