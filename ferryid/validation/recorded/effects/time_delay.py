"""Navigation that is late: its rows are stamped later, or stand beside actuators of a later row in one table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.ingest.log import Series
from ferryid.types import Nanoseconds
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.log import NAVIGATION, RecordedLog, usual_step_s

UNEVEN = 0.02
"""Share of the rows of a table that may be off its step, if rows are to stand for times."""


def navigation_topics(log: RecordedLog) -> dict[str, bool]:
    """Return the topics of the navigation, and whether each holds other signals too."""
    topics: dict[str, set[str]] = {}
    for name, topic in log.topics.items():
        topics.setdefault(topic, set()).add(name)
    return {topic: bool(names - set(NAVIGATION)) for topic, names in topics.items() if names & set(NAVIGATION)}


def cannot(log: RecordedLog) -> str:
    """Return why rows cannot be moved by a time."""
    for topic, shared in navigation_topics(log).items():
        if shared and uneven(log, topic) > UNEVEN:
            return f"{topic} holds navigation and actuators, and its rows are not evenly spaced"
    return ""


def uneven(log: RecordedLog, topic: str) -> float:
    """Return the share of a topic's rows whose distance is not the usual one."""
    steps = np.diff(log.times(topic))
    return float(np.mean(np.abs(steps / usual_step_s(log, topic) - 1.0) > 0.1)) if len(steps) else 1.0


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a delay [s]; of whole rows where navigation and actuators share a table."""
    shared = [usual_step_s(log, topic) for topic, mixed in navigation_topics(log).items() if mixed]
    seconds = max(1, round(size / shared[0])) * shared[0] if shared else size
    return Truth("time_delay", None, {"seconds": round(seconds, 9)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the navigation be late."""
    seconds = truth.values["seconds"]
    series, clock = dict(log.series), dict(log.clock)
    for topic, shared in navigation_topics(log).items():
        if not shared:
            later = round(seconds * 1e9)
            series[topic] = delayed(series[topic], later)
            clock[topic] = clock[topic] + later
            continue
        rows = round(seconds / usual_step_s(log, topic))
        series[topic], clock[topic] = _behind(log, topic, rows)
    return Concealed(replace(log, series=series, clock=clock))


def delayed(series: Series, later_ns: int) -> Series:
    """Return a topic whose rows are stamped and received later by a time [ns]."""
    stamp = None if series.stamp_ns is None else series.stamp_ns + later_ns
    return replace(series, receive_ns=series.receive_ns + later_ns, stamp_ns=stamp)


def _behind(log: RecordedLog, topic: str, rows: int) -> tuple[Series, Nanoseconds]:
    """Return a table whose navigation stands so many rows further down, without its first rows."""
    series, n = log.series[topic], len(log.series[topic].receive_ns)
    paths = {
        path
        for signal in log.profile.signals
        if signal.quantity in ("position", "heading", "velocity", "yaw_rate", "roll", "pitch")
        for path in signal.fields
    }
    columns = {path: values[: n - rows] if path in paths else values[rows:] for path, values in series.columns.items()}
    stamp = None if series.stamp_ns is None else series.stamp_ns[rows:]
    made = replace(series, receive_ns=series.receive_ns[rows:], stamp_ns=stamp, columns=columns)
    return made, log.clock[topic][rows:]


CONCEALMENT = Concealment(
    "time_delay",
    SENSOR,
    "s",
    "Positions, heading and velocities are stamped later; in one table with the actuators, by whole rows.",
    lambda log: (0.05, 2.0),
    sample,
    conceal,
    cannot,
)
