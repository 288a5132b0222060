"""Fields of a log on one grid, smoothed, for comparing them with each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.draft.thresholds import DRAFT
from ferryid.errors import FerryIdError
from ferryid.ingest.clocks import repair_all
from ferryid.ingest.log import Reader, Series
from ferryid.signals.time_ranges import spans_of
from ferryid.types import Flags, Floats, TimeRanges
from ferryid.vessel.field_words import unit_of_name, words_of
from ferryid.vessel.frames import local_north_east, yaw_of_quaternion

GRID_HZ = 5.0
MOST_ROWS = 20_000
SMOOTHED_S = 1.5
_SMOOTHED_PERIODS = 5.0


@dataclass(frozen=True)
class Samples:
    """Fields of a log at their own times.

    Attributes
    ----------
    times_s
        By topic, from the first row of any [s].
    columns
        By topic and field, as recorded.
    grid_s
        Times of the grid [s], shape (n,).
    start_ns
        Time of the first row [ns].
    used
        True on the rows of the grid that count, shape (n,); None for all.
    """

    times_s: Mapping[str, Floats]
    columns: Mapping[tuple[str, str], Floats]
    grid_s: Floats
    start_ns: int
    used: Flags | None = None

    def has(self, topic: str, fields: Sequence[str]) -> bool:
        """Tell whether fields are there, and one of them changes (a quaternion of yaw has two that do not)."""
        if not all((topic, path) in self.columns for path in fields):
            return False
        changing = [np.unique(self.columns[topic, path]).size > 1 for path in fields]
        return any(changing) if len(fields) == 4 else all(changing)

    def raw(self, topic: str, path: str) -> Floats:
        """Return a field as recorded, shape (m,)."""
        return self.columns[topic, path]

    def counts(self, topic: str) -> Flags:
        """True on the rows of a topic that are used, shape (m,)."""
        times = self.times_s[topic]
        if self.used is None:
            return np.ones(times.shape, dtype=bool)
        return np.asarray(self.used[np.clip(np.searchsorted(self.grid_s, times), 0, self.used.size - 1)])

    def on_grid(self, topic: str, values: Floats, *, held: bool = False) -> Floats:
        """Return values of a topic on the grid, NaN outside of it and across gaps."""
        times = self.times_s[topic]
        known = np.isfinite(values)
        times, values = times[known], values[known]
        if times.size < 2:
            return np.full(self.grid_s.shape, np.nan)
        if held:
            place = np.clip(np.searchsorted(times, self.grid_s, side="right") - 1, 0, times.size - 1)
            out = np.asarray(values[place], dtype=np.float64)
        else:
            out = np.interp(self.grid_s, times, values)
            after = np.clip(np.searchsorted(times, self.grid_s), 1, times.size - 1)
            wide = times[after] - times[after - 1] > 10.0 * float(np.median(np.diff(times)))
            out[wide] = np.nan
        outside = (self.grid_s < times[0]) | (self.grid_s > times[-1])
        out[outside] = np.nan
        if self.used is not None:
            out[~self.used] = np.nan
        return out

    def smooth(self, values: Floats, topic: str) -> Floats:
        """Return a moving mean over a window that suits the rate of a topic."""
        period = float(np.median(np.diff(self.times_s[topic])))
        step = float(self.grid_s[1] - self.grid_s[0])
        rows = max(1, round(max(SMOOTHED_S, _SMOOTHED_PERIODS * period) / step)) | 1
        kernel = np.ones(rows) / rows
        return np.convolve(values, kernel, mode="same") if rows < values.size else values

    def slope(self, values: Floats, topic: str) -> Floats:
        """Return the slope of smoothed values [per s]."""
        return np.asarray(np.gradient(self.smooth(values, topic), self.grid_s))


def read_samples(reader: Reader, wanted: Mapping[str, Sequence[str]], log: str, ranges: TimeRanges = ()) -> Samples:
    """Read fields of a log and put their times on one clock; with `ranges` what lies in them is used alone.

    Raises
    ------
    FerryIdError
        Where none of them holds two rows, and for a range outside the log.
    """
    series: dict[str, Series] = {}
    for topic, fields in wanted.items():
        try:
            series |= reader.read({topic: tuple(dict.fromkeys(fields))})
        except FerryIdError:
            # What cannot be read maps nothing.
            continue
    repaired = repair_all(series)
    times = {topic: time_ns for topic, (time_ns, rows, _) in repaired.items() if len(rows) > 1}
    if not times:
        raise FerryIdError(
            f"{log}: no topic that could be a pose, a velocity or an actuator holds two rows. Fix: use a longer log"
        )
    start, end_ns = min(int(one[0]) for one in times.values()), max(int(one[-1]) for one in times.values())
    spans = spans_of(log, start, end_ns, ranges)
    columns = {}
    for topic in times:
        rows = repaired[topic][1]
        for path, values in series[topic].columns.items():
            if values.dtype.kind in "fiub":
                columns[topic, path] = np.asarray(values, dtype=np.float64)[rows]
    times_s = {topic: np.asarray((one - start) * 1e-9, dtype=np.float64) for topic, one in times.items()}
    end = max(float(one[-1]) for one in times_s.values())
    count = int(min(max(end * GRID_HZ, 2.0), MOST_ROWS))
    grid = np.linspace(0.0, end, count)
    if spans:
        inside = [(grid >= (a - start) * 1e-9) & (grid <= (b - start) * 1e-9) for a, b in spans]
        return Samples(times_s, columns, grid, start, np.logical_or.reduce(inside))
    return Samples(times_s, columns, grid, start)


def geodetic_unit(samples: Samples, topic: str, fields: Sequence[str]) -> str:
    """Return the unit of a latitude and a longitude: what never leaves a turn in radians is in radians."""
    latitude, longitude = (np.abs(samples.raw(topic, path)) for path in fields)
    return "rad" if np.nanmax(latitude) <= 0.5 * np.pi and np.nanmax(longitude) <= np.pi else "deg"


def metres(samples: Samples, topic: str, fields: Sequence[str]) -> tuple[Floats, Floats]:
    """Return north and east of latitudes and longitudes [m]."""
    latitude, longitude = (samples.raw(topic, path).copy() for path in fields)
    lost = (latitude == 0.0) & (longitude == 0.0)
    turn = 1.0 if geodetic_unit(samples, topic, fields) == "rad" else np.pi / 180.0
    latitude[lost] = longitude[lost] = np.nan
    north, east = np.full(latitude.shape, np.nan), np.full(latitude.shape, np.nan)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    north[known], east[known] = local_north_east(latitude[known] * turn, longitude[known] * turn)
    return north, east


def angle_unit(samples: Samples, topic: str, fields: Sequence[str]) -> str:
    """Return the unit of a heading: by its name, or by its size."""
    stated = unit_of_name(fields[0], "angle")
    if stated:
        return stated
    words = set(words_of(fields[0])) | set(words_of(topic))
    if words & {"deg", "degrees", "degree"}:
        return "deg"
    values = samples.raw(topic, fields[0])
    known = values[np.isfinite(values)]
    return "deg" if known.size and float(np.quantile(np.abs(known), 0.99)) > DRAFT.most_rad else "rad"


def yaw(samples: Samples, topic: str, fields: Sequence[str], unit: str) -> Floats:
    """Return a heading as recorded [rad], continuous."""
    if len(fields) == 4:
        angle = yaw_of_quaternion(*(samples.raw(topic, path) for path in fields))
    else:
        angle = samples.raw(topic, fields[0]) * (np.pi / 180.0 if unit == "deg" else 1.0)
    angle = np.asarray(angle, dtype=np.float64).copy()
    known = np.isfinite(angle)
    angle[known] = np.unwrap(angle[known])
    return angle
