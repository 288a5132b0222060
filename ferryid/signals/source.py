"""One stream before it goes on a grid: wild, stale and stuck samples taken out, its usual period, what counts as a gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.quality import VELOCITY, clean, is_actuator, is_load, is_order, stale, stuck
from ferryid.signals.stream import Stream

Floats = NDArray[np.float64]
Nanoseconds = NDArray[np.int64]

GAP_PERIODS = 3.0
GAP_LEAST_S = 0.5
"""A stretch without samples is a gap when longer than three periods of its stream and than this [s]."""

STUCK_PERIODS = 10.0
"""A velocity that repeats itself for longer than a gap and than this many periods was not measured meanwhile."""


@dataclass(frozen=True)
class Source:
    """One stream, cleaned: times [ns], columns, usual period, longest interval that is bridged [s]."""

    topic: str
    time_ns: Nanoseconds
    columns: Mapping[str, Floats]
    period_s: float
    bridge_s: float
    on_change: bool


def source_of(stream: Stream, repairs: list[str]) -> Source:
    time_ns = np.asarray(stream.time_ns)
    time_s = (time_ns - time_ns[0]) * 1e-9
    period = _usual_period(time_s)
    on_change = _on_change(time_s, stream.columns)
    bridge = max(GAP_PERIODS * period, GAP_LEAST_S)
    columns: dict[str, Floats] = {}
    for name, raw in stream.columns.items():
        columns[name], quality = clean(name, time_s, raw)
        repairs.extend(quality.sentences())
    old = stale(time_s, stream.columns, bridge)
    if old.any():
        for values in columns.values():
            values[old] = np.nan
        repairs.append(
            f"{stream.topic}: {int(old.sum())} of {old.size} messages repeat an old measurement for more than "
            f"{bridge:.2f} s; taken as missing."
        )
    frozen = max(bridge, STUCK_PERIODS * period)
    for name in VELOCITY:
        if name in columns and (same := stuck(time_s, stream.columns[name], frozen) & ~old).any():
            columns[name][same] = np.nan
            repairs.append(
                f"{name}: {int(same.sum())} of {same.size} samples repeat an old one to the last digit for more than "
                f"{frozen:.2f} s; taken as missing."
            )
    interval = np.diff(time_s)
    gaps = interval > bridge
    if interval.size and all(is_load(name) for name in columns):
        repairs.append(f"{stream.topic}: each value holds until the next, at most for {interval.max():.1f} s.")
    elif interval.size and on_change:
        repairs.append(
            f"{stream.topic}: published when it changes; each value holds until the next, "
            f"at most for {interval.max():.1f} s."
        )
    elif gaps.any():
        repairs.append(
            f"{stream.topic}: {int(gaps.sum())} gaps longer than {bridge:.2f} s, {interval[gaps].sum():.1f} s in all; "
            "not bridged."
        )
    return Source(stream.topic, time_ns, columns, period, bridge, on_change)


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
        within = interval <= max(GAP_PERIODS * period, GAP_LEAST_S)
        if not within.any():
            break
        shorter = float(interval[within].mean())
        if shorter == period:
            break
        period = shorter
    return period


def _on_change(time_s: Floats, columns: Mapping[str, Floats]) -> bool:
    """True for a payload, and actuator streams that are irregular and whose messages (nearly) all say something new."""
    if all(is_load(name) for name in columns):
        return True
    if not all(is_actuator(name) or is_order(name) for name in columns) or time_s.size < 3:
        return False
    interval = np.diff(time_s)
    irregular = float(np.mean(interval > GAP_PERIODS * np.median(interval)))
    new = np.zeros(interval.size, dtype=bool)
    for values in columns.values():
        new |= np.diff(values) != 0.0
    return irregular > 0.1 and float(new.mean()) > 0.9
