"""What a log holds of a profile's signals, whatever it lacks: for a page on a log that was refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.clocks import repair_all
from ferryid.ingest.log import Reader, Topic
from ferryid.report.timeline import Strip, Timeline, Trace
from ferryid.signals.parquet import unit_of
from ferryid.signals.recording import log_name, make_recording, record
from ferryid.signals.stream import Stream
from ferryid.types import Floats, RunContext
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import lacking_signals, survey

ROWS = 20_000
"""Most rows of the drawing's grid."""
HELD = 5.0
"""A line breaks where values are this many times the usual step apart."""
HALF_TURN = 180.0
"""A jump of an angle beyond it is one from end to end of a turn [deg]."""
LARGEST = 1e100
"""Values beyond are drawn at it: no vessel has them, and axes cannot."""
_DEGREES = ("psi", "phi", "theta", "alpha_", "delta_", "wind_from", "r")
_STRIPS = (
    ("position [m]", ("x", "y", "x_d", "y_d")),
    ("heading, roll, pitch [deg]", ("psi", "phi", "theta")),
    ("velocity [m/s]", ("u", "v", "vel_N", "vel_E")),
    ("yaw rate [deg/s]", ("r",)),
    ("speed of rotation [rpm]", ("n_",)),
    ("angle [deg]", ("alpha_", "delta_")),
    ("force of actuators [N]", ("F_",)),
    ("ordered force [N, N, N·m]", ("X_d", "Y_d", "N_d")),
    ("wind [m/s]", ("wind_speed", "wind_N", "wind_E")),
    ("wind from [deg]", ("wind_from",)),
    ("current [m/s]", ("current_",)),
    ("payload [kg]", ("payload_kg",)),
)
"""What is drawn together, by canonical columns; a name that ends in an underscore stands for all that begin so."""
_COLOURS = 6


@dataclass(frozen=True)
class HeldSignal:
    """One signal that the log holds: where it comes from, and what its values are."""

    column: str
    source: str
    rows: int
    rate_hz: float
    least: float
    greatest: float

    @property
    def unit(self) -> str:
        """Unit of the values as they are shown: degrees for angles."""
        if _is(self.column, _DEGREES):
            return "deg/s" if self.column == "r" else "deg"
        return unit_of(self.column)

    @property
    def remark(self) -> str:
        """What is conspicuous: no value, or the same value throughout."""
        if not self.rows or not np.isfinite(self.least):
            return "no value"
        return "constant" if self.least == self.greatest and self.rows > 1 else ""


@dataclass(frozen=True)
class HeldLog:
    """What a log holds.

    Attributes
    ----------
    name, path
        Of the log.
    topics
        All topics.
    signals
        Of the profile, those that are there.
    missing
        Quantity of the profile to the reason why it is not there.
    needed
        Those of them without which the log cannot be used.
    timeline
        The signals over time; None where there is none.
    """

    name: str
    path: str
    topics: tuple[Topic, ...]
    signals: tuple[HeldSignal, ...]
    missing: Mapping[str, str]
    needed: frozenset[str]
    timeline: Timeline | None


def held_log(path: str, profile: Profile, run: RunContext) -> HeldLog:
    """Return what a log holds of the signals of a profile.

    Raises
    ------
    FerryIdError
        For a log that cannot be opened at all.
    """
    reader = open_log(path, profile.table)
    selection = survey(profile, reader.topics, reader.losses)
    streams = _streams(path, reader, profile, run)
    signals = tuple(
        _signal(column, selection.found.get(column, stream.topic), stream, values)
        for stream in streams
        for column, values in stream.columns.items()
    )
    return HeldLog(
        log_name(path),
        path,
        reader.topics,
        signals,
        selection.missing,
        frozenset(signal.quantity for signal in lacking_signals(profile, selection)),
        _timeline(log_name(path), streams),
    )


def _streams(path: str, reader: Reader, profile: Profile, run: RunContext) -> list[Stream]:
    """Return the streams of a recording, or where that is refused, of each topic that can be read."""
    try:
        return [
            one for one in record(path, profile, run.tables, ranges=run.ranges).streams.values() if len(one.time_ns)
        ]
    except FerryIdError:
        selection = survey(profile, reader.topics, reader.losses)
    found = []
    for topic, fields in selection.wanted.items():
        try:
            series = reader.read({topic: fields})
            one = make_recording(
                reader, log_name(path), profile, replace(selection, wanted={topic: fields}), series, repair_all(series)
            )
        except FerryIdError:
            # What cannot be read of one topic is no reason to show none.
            continue
        found += [stream for stream in one.streams.values() if len(stream.time_ns)]
    return found


def _signal(column: str, source: str, stream: Stream, values: Floats) -> HeldSignal:
    good = values[np.isfinite(values)]
    shown = _shown(column, good)
    least, greatest = (float(shown.min()), float(shown.max())) if shown.size else (np.nan, np.nan)
    return HeldSignal(column, source, len(good), stream.clock.rate_hz, least, greatest)


def _is(column: str, names: Sequence[str]) -> bool:
    return any(column.startswith(name) if name.endswith("_") else column == name for name in names)


def _shown(column: str, values: Floats) -> Floats:
    """Return values as they are drawn: angles in degrees, none beyond what can be drawn."""
    shown = np.degrees(values) if _is(column, _DEGREES) else values
    return np.asarray(np.clip(shown, -LARGEST, LARGEST), dtype=np.float64)


def _timeline(name: str, streams: Sequence[Stream]) -> Timeline | None:
    if not streams:
        return None
    start = min(int(one.time_ns[0]) for one in streams)
    times: dict[int, Floats] = {id(one): np.asarray((one.time_ns - start) * 1e-9, dtype=np.float64) for one in streams}
    length = max(float(t[-1]) for t in times.values())
    steps = [float(np.median(np.diff(t))) for t in times.values() if len(t) > 1]
    if length <= 0.0 or not steps:
        return None
    t = np.linspace(0.0, length, min(ROWS, max(int(length / max(min(steps), 1e-3)), 1) + 1))
    columns = {
        column: _unjoined(column, _on(t, times[id(one)], _shown(column, values)))
        for one in streams
        for column, values in one.columns.items()
    }
    strips, drawn = [], set[str]()
    for label, names in _STRIPS:
        there = [column for column in columns if _is(column, names) and column not in drawn]
        drawn |= set(there)
        traces = tuple(
            Trace(
                column,
                columns[column],
                f"c{k % _COLOURS}",
                dash=(6.0, 3.0) if "_cmd" in column or column.endswith("_d") else (),
            )
            for k, column in enumerate(there)
        )
        strips += [Strip(label, traces)] if traces else []
    strips += [
        Strip(column, (Trace(column, values, "c0"),)) for column, values in columns.items() if column not in drawn
    ]
    place = None
    if {"x", "y"} <= set(columns):
        heading = np.radians(columns.get("psi", np.full(len(t), np.nan)))
        place = np.column_stack([columns["x"], columns["y"], heading])
    return Timeline(name, t, tuple(strips), place=place)


def _unjoined(column: str, values: Floats) -> Floats:
    """Return values with no line from one end of a turn to the other."""
    if column != "r" and _is(column, _DEGREES):
        values[1:][np.abs(np.diff(values)) > HALF_TURN] = np.nan
    return values


def _on(t: Floats, own: Floats, values: Floats) -> Floats:
    """Return values at the times of a grid: the last one before, and none where its stream has a gap."""
    before = np.searchsorted(own, t + 1e-9, side="right") - 1
    usual = float(np.median(np.diff(own))) if len(own) > 1 else 0.0
    late = t - own[np.maximum(before, 0)] > HELD * max(usual, float(t[1] - t[0]))
    taken = values[np.maximum(before, 0)]
    return np.where((before < 0) | late, np.nan, taken)
