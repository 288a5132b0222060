"""Signals that are late: whole topics stamped later, or columns of a table that stand some rows further down."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from ferryid.ingest.log import Series
from ferryid.types import Nanoseconds
from ferryid.validation.recorded.log import RecordedLog, usual_step_s

UNEVEN = 0.02
"""Share of the rows of a table that may be off its step, if rows are to stand for times."""
OFF = 0.1
"""By how much of a step such a row is off it."""


def topics_of(log: RecordedLog, columns: Collection[str]) -> dict[str, bool]:
    """Return the topics of some columns, and whether each holds others too."""
    topics: dict[str, set[str]] = {}
    for name, topic in log.topics.items():
        topics.setdefault(topic, set()).add(name)
    return {topic: bool(names - set(columns)) for topic, names in topics.items() if names & set(columns)}


def cannot_be_late(log: RecordedLog, columns: Collection[str]) -> str:
    """Return why columns cannot be moved by a time, as the end of a sentence; empty where they can."""
    for topic, shared in topics_of(log, columns).items():
        if not shared:
            continue
        steps = np.diff(log.times(topic))
        if not len(steps) or np.mean(np.abs(steps / usual_step_s(log, topic) - 1.0) > OFF) > UNEVEN:
            return f"{topic} holds other signals too, and its rows are not evenly spaced"
    return ""


def possible_delay_s(log: RecordedLog, columns: Collection[str], seconds: float) -> float:
    """Return the delay next to one [s] by which columns can be late: of whole rows where others stand in their table."""
    shared = [usual_step_s(log, topic) for topic, mixed in topics_of(log, columns).items() if mixed]
    return round(max(1, round(seconds / shared[0])) * shared[0], 9) if shared else seconds


def late(log: RecordedLog, columns: Collection[str], seconds: float) -> RecordedLog:
    """Return a recording in which columns are late by a time [s], of `possible_delay_s`."""
    series, clock = dict(log.series), dict(log.clock)
    for topic, shared in topics_of(log, columns).items():
        if shared:
            rows = round(seconds / usual_step_s(log, topic))
            series[topic], clock[topic] = _behind(log, topic, columns, rows)
        else:
            later = round(seconds * 1e9)
            stamp = series[topic].stamp_ns
            series[topic] = replace(
                series[topic],
                receive_ns=series[topic].receive_ns + later,
                stamp_ns=None if stamp is None else stamp + later,
            )
            clock[topic] = clock[topic] + later
    return replace(log, series=series, clock=clock)


def _behind(log: RecordedLog, topic: str, columns: Collection[str], rows: int) -> tuple[Series, Nanoseconds]:
    """Return a table in which columns stand so many rows further down, without its first rows."""
    series, n = log.series[topic], len(log.series[topic].receive_ns)
    moved = log.fields(topic, columns)
    values = {path: one[: n - rows] if path in moved else one[rows:] for path, one in series.columns.items()}
    stamp = None if series.stamp_ns is None else series.stamp_ns[rows:]
    made = replace(series, receive_ns=series.receive_ns[rows:], stamp_ns=stamp, columns=values)
    return made, log.clock[topic][rows:]
