"""A recording as it is: raw series of the mapped topics, what they measure, and the clock that they are on."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from ferryid.cached import cached_property
from ferryid.diagnose.data import read_measurements, window_lengths
from ferryid.diagnose.inference import EstimationProblem, estimation_problem, prior_force_model, windows
from ferryid.effects.force_model import Measurements
from ferryid.ingest import open_log
from ferryid.ingest.clocks import repair_all
from ferryid.ingest.log import Series
from ferryid.types import Floats, Nanoseconds
from ferryid.validation.recorded.signal_values import with_columns
from ferryid.vessel import actuator_columns
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import canonical_columns, convert, select

MESSAGES, FOLDER, TABLE = "messages", "folder", "table"
"""How a log is kept: messages of topics, a folder of CSV files, one table."""
NAVIGATION = ("x", "y", "psi", "phi", "theta", "u", "v", "r", "vel_N", "vel_E")
"""Columns that the navigation gives."""


@dataclass(frozen=True, eq=False)
class RecordedLog:
    """A recording, n rows of measurements.

    Attributes
    ----------
    path
        Where it lies.
    profile
        The vessel.
    kind
        `MESSAGES`, `FOLDER` or `TABLE`.
    series
        Raw fields of every mapped topic.
    measurements
        What it measures, as a diagnosis reads it.
    t0_ns
        Time of the measurements' first row [ns].
    clock
        Time of every raw row of a topic on the clock of the measurements [ns], shape (messages,).
    """

    path: str
    profile: Profile
    kind: str
    series: Mapping[str, Series]
    measurements: Measurements
    t0_ns: int
    clock: Mapping[str, Nanoseconds]

    @property
    def duration_s(self) -> float:
        """Length of the measurements [s]."""
        return float(self.measurements.t[-1])

    @cached_property
    def topics(self) -> Mapping[str, str]:
        """Topic of every canonical column."""
        return {name: topic for topic, one in self.series.items() for name in convert(self.profile, one)}

    @cached_property
    def columns(self) -> Mapping[str, Floats]:
        """Canonical columns at the times of their own topics."""
        return {name: values for one in self.series.values() for name, values in convert(self.profile, one).items()}

    @cached_property
    def roles(self) -> Mapping[tuple[str, str], str]:
        """Column of each role of each actuator that its force is made of."""
        return actuator_columns(self.profile, self.columns)[0]

    @cached_property
    def acceleration(self) -> Floats:
        """Slope of the velocities [m/s², m/s², rad/s²], shape (n, 3)."""
        return np.asarray(np.gradient(self.measurements.nu, self.measurements.step_s, axis=0))

    def times(self, topic: str) -> Floats:
        """Return the times of a topic's rows since the measurements' first row [s]."""
        return np.asarray((self.clock[topic] - self.t0_ns) * 1e-9)

    def at(self, column: str, t: Floats) -> Floats:
        """Return a canonical column at other times [s], linear in between; angles take the short way."""
        topic = self.topics[column]
        times, values = self.times(topic), self.columns[column]
        known = np.flatnonzero(np.isfinite(values))
        known = known[np.argsort(times[known], kind="stable")]
        if known.size == 0:
            return np.full(len(t), np.nan)
        values = values[known]
        if column == "psi" or column.startswith(("alpha_", "delta_")):
            values = np.unwrap(values)
        return np.asarray(np.interp(t, times[known], values))

    def motion_at(self, t: Floats) -> tuple[Floats, Floats]:
        """Return position with heading and velocities at other times [s], shape (len(t), 3) each."""
        measured = self.measurements
        eta, nu = (
            np.column_stack([np.interp(t, measured.t, one) for one in rows.T]) for rows in (measured.eta, measured.nu)
        )
        return eta, nu

    def fields(self, topic: str, columns: Collection[str]) -> set[str]:
        """Return the raw fields of a topic that canonical columns are made of."""
        return {
            path
            for signal in self.profile.signals
            if signal.topic.strip("/") == topic.strip("/") and set(canonical_columns(signal)) & set(columns)
            for path in signal.fields
        }

    def changed(self, columns: Mapping[str, Floats]) -> RecordedLog:
        """Return it with other values in canonical columns, shape of their topics' rows."""
        series = dict(self.series)
        for topic in {self.topics[name] for name in columns}:
            mine = {name: values for name, values in columns.items() if self.topics[name] == topic}
            series[topic] = with_columns(self.profile, series[topic], mine)
        return replace(self, series=series)


def read_log(path: str, profile: Profile) -> RecordedLog:
    """Read a recording.

    Parameters
    ----------
    path
        A file or folder; parts of one recording joined by ``+``.
    profile
        The vessel.

    Raises
    ------
    FerryIdError
        For a log that a diagnosis cannot use.
    """
    measurements, survey = read_measurements(path, profile)
    reader = open_log(path, profile.table)
    series = reader.read(select(profile, reader.topics, path, reader.losses).wanted)
    tables = all(topic.encoding == "table" for topic in reader.topics)
    kind = MESSAGES if not tables else TABLE if set(series) == {"table"} else FOLDER
    clock = {}
    for topic, (time_ns, rows, _) in repair_all(series).items():
        # Rows that are left out for their times keep those that they have: no diagnosis sees them.
        clock[topic] = series[topic].receive_ns.copy()
        clock[topic][rows] = time_ns
    return RecordedLog(path, profile, kind, series, measurements, survey.t0_ns, clock)


@cache
def cached_log(path: str, profile_path: str) -> RecordedLog:
    """Return `read_log` with the profile of a name or file, read once in a process."""
    from ferryid.vessel import load_profile

    return read_log(path, load_profile(profile_path))


@cache
def cached_problem(path: str, profile_path: str) -> EstimationProblem:
    """Return the estimation problem of a recording as it was, with the noise that the hull alone leaves."""
    measurements = cached_log(path, profile_path).measurements
    found = windows(measurements, *window_lengths(measurements.profile))
    return estimation_problem(found, *prior_force_model(found.measurements, measurements.profile))


def usual_step_s(log: RecordedLog, topic: str) -> float:
    """Return the median distance of a topic's rows [s]."""
    times = sorted(log.times(topic).tolist())
    return float(np.median([b - a for a, b in pairwise(times)])) if len(times) > 1 else float("inf")


def name_of_log(path: str) -> str:
    """Return the name of a log's file or folder for messages."""
    return Path(path.partition("+")[0]).name
