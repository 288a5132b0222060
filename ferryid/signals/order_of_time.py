"""The order in which logs were recorded, where their clocks say it."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.signals.thresholds import SIGNALS


def dated(start_ns: int) -> bool:
    """Return whether a time [ns since 1970] is a date: not counted from the start of a log, nor by a clock that was not set."""
    return start_ns >= SIGNALS.epoch_ns


def in_order(starts_ns: Sequence[int]) -> tuple[int, ...]:
    """Return the places of logs in order of their beginnings [ns since 1970].

    They stay in the order in which they were given where the times of some are no dates, and where logs begin at once.
    """
    places = range(len(starts_ns))
    return tuple(sorted(places, key=lambda i: starts_ns[i]) if all(map(dated, starts_ns)) else places)
