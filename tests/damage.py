"""A simulated log of ten minutes, and gaps and faults put into it, for tests of what every command does with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.simulate.trial import Simulation

Columns = Mapping[str, NDArray[Any]]
NAVIGATION, THRUSTER = "/navigation/odometry", "/thruster1/state"
_HEADING = "pose.pose.orientation"
SURGE, SWAY, YAW_RATE = "twist.twist.linear.x", "twist.twist.linear.y", "twist.twist.angular.z"
X, Y = "pose.pose.position.x", "pose.pose.position.y"


@cache
def ten_minutes() -> Simulation:
    """Return the bundled four-corner trial, without camera and inertial sensor."""
    made = simulate(load_scenario("four-corner"))
    streams = tuple(stream for stream in made.streams if "camera" not in stream.topic and "imu" not in stream.topic)
    return replace(made, streams=streams)


def silent(made: Simulation, topic: str, gaps: Sequence[tuple[float, float]]) -> Simulation:
    """Return a trial without the messages of a topic inside gaps, given by start and length [s]."""
    streams = []
    for stream in made.streams:
        if stream.topic == topic:
            kept = ~inside(stream.stamp_ns, gaps)
            stream = replace(
                stream,
                stamp_ns=stream.stamp_ns[kept],
                receive_ns=stream.receive_ns[kept],
                columns={name: values[kept] for name, values in stream.columns.items()},
            )
        streams.append(stream)
    return replace(made, streams=tuple(streams))


def paused(made: Simulation, at_s: float, seconds: float) -> Simulation:
    """Return a trial in which every clock goes on later from a time on, as when a recorder rested."""
    streams = []
    for stream in made.streams:
        first = made.streams[0].stamp_ns[0]
        late = (stream.stamp_ns - first > at_s * 1e9) * np.int64(seconds * 1e9)
        streams.append(replace(stream, stamp_ns=stream.stamp_ns + late, receive_ns=stream.receive_ns + late))
    return replace(made, streams=tuple(streams))


def changed(
    made: Simulation, gaps: Sequence[tuple[float, float]], edit: Callable[[Columns, Any], Columns]
) -> Simulation:
    """Return a trial whose navigation is edited on the rows inside gaps: `edit` takes columns and flags."""
    streams = tuple(
        replace(one, columns={**one.columns, **edit(one.columns, inside(one.stamp_ns, gaps))})
        if one.topic == NAVIGATION
        else one
        for one in made.streams
    )
    return replace(made, streams=streams)


def without_heading(made: Simulation, gaps: Sequence[tuple[float, float]]) -> Simulation:
    """Return a trial whose heading is not a number inside gaps."""

    def edit(columns: Columns, rows: NDArray[np.bool_]) -> Columns:
        return {name: np.where(rows, np.nan, v) for name, v in columns.items() if name.startswith(_HEADING)}

    return changed(made, gaps, edit)


def turned(columns: Columns, rows: NDArray[np.bool_]) -> Columns:
    """Turn the heading of some rows by 180°."""
    return turned_by(180.0)(columns, rows)


def turned_by(degrees: float) -> Callable[[Columns, NDArray[np.bool_]], Columns]:
    """Return an edit that turns the heading of some rows about the vertical: q becomes (0, 0, sin a/2, cos a/2) q."""
    sine, cosine = np.sin(np.radians(degrees) / 2), np.cos(np.radians(degrees) / 2)

    def edit(columns: Columns, rows: NDArray[np.bool_]) -> Columns:
        x, y, z, w = (columns[f"{_HEADING}.{name}"] for name in "xyzw")
        after = {
            "x": cosine * x - sine * y,
            "y": cosine * y + sine * x,
            "z": cosine * z + sine * w,
            "w": cosine * w - sine * z,
        }
        return {f"{_HEADING}.{name}": np.where(rows, after[name], columns[f"{_HEADING}.{name}"]) for name in "xyzw"}

    return edit


def stuck(names: Sequence[str], value: float) -> Callable[[Columns, NDArray[np.bool_]], Columns]:
    """Return an edit that writes one value for some columns on some rows."""
    return lambda columns, rows: {name: np.where(rows, value, columns[name]) for name in names}


def moved(by_m: float) -> Callable[[Columns, NDArray[np.bool_]], Columns]:
    """Return an edit that moves the position of some rows."""
    return lambda columns, rows: {X: columns[X] + by_m * rows}


def zeros(columns: Columns, rows: NDArray[np.bool_]) -> Columns:
    """Write zeros for the position of some rows."""
    return {name: np.where(rows, 0.0, columns[name]) for name in (X, Y)}


def repeated(columns: Columns, rows: NDArray[np.bool_]) -> Columns:
    """Repeat the last pose before some rows."""
    return held_at_its_last("pose.pose")(columns, rows)


def scaled(name: str, factor: float) -> Callable[[Columns, NDArray[np.bool_]], Columns]:
    """Return an edit that multiplies a column on some rows."""
    return lambda columns, rows: {name: np.where(rows, factor * columns[name], columns[name])}


def held_at_its_last(prefix: str) -> Callable[[Columns, NDArray[np.bool_]], Columns]:
    """Return an edit that repeats the last value before some rows in the columns whose names begin so."""

    def edit(columns: Columns, rows: NDArray[np.bool_]) -> Columns:
        last = np.maximum.accumulate(np.where(rows, 0, np.arange(rows.size)))
        return {name: values[last] for name, values in columns.items() if name.startswith(prefix)}

    return edit


def inside(stamp_ns: NDArray[np.int64], gaps: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """Return which times lie inside gaps, given by start and length [s] from the first one."""
    t = (stamp_ns - stamp_ns[0]) * 1e-9
    rows = np.zeros(t.size, dtype=bool)
    for start, length in gaps:
        rows |= (t > start) & (t < start + length)
    return rows


def written(made: Simulation, path: Path) -> Path:
    """Write a trial as a log."""
    write_log(made, path)
    return path
