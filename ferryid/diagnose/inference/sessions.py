"""Which logs of a campaign are near in time, so that the weather of one is likely to be that of the other."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.signals.order_of_time import dated, in_order


def start_ns(log: AveragedLog) -> int:
    """Return when a log begins, as its clock says."""
    return log.screened.measured.survey.t0_ns


def in_time(logs: Sequence[AveragedLog]) -> tuple[int, ...]:
    """Return the places of logs in order of time, as `in_order` does."""
    return in_order([start_ns(one) for one in logs])


def sessions(logs: Sequence[AveragedLog]) -> tuple[int, ...]:
    """Return a number for each log, the same for logs of one session; empty where the times of all of them are no dates.

    A session ends where no log begins within `INFERENCE.session_gap_h` of the end of those before. A log without a date is
    near in time to no other, as far as is known: it is a session of its own.
    """
    placed = [i for i, one in enumerate(logs) if dated(start_ns(one))]
    if not placed:
        return ()
    found, session, end = [-1] * len(logs), -1, 0.0
    for i in sorted(placed, key=lambda i: start_ns(logs[i])):
        start_h = start_ns(logs[i]) / 3.6e12
        if session < 0 or start_h - end > INFERENCE.session_gap_h:
            session, end = session + 1, start_h
        end = max(end, start_h + float(logs[i].windows.measurements.t[-1]) / 3600.0)
        found[i] = session
    for i in [i for i, one in enumerate(logs) if not dated(start_ns(one))]:
        session += 1
        found[i] = session
    return tuple(found)
