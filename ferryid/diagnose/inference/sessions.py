"""Which logs of a campaign are near in time, so that the weather of one is likely to be that of the other."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE

CLOCK_SET_NS = 946_684_800_000_000_000
"""The year 2000: earlier times are those of clocks that were not set."""


def start_ns(log: AveragedLog) -> int:
    """Return when a log begins, as its clock says."""
    return log.screened.measured.survey.t0_ns


def dated(logs: Sequence[AveragedLog]) -> bool:
    """Return whether the times of all logs are dates."""
    return all(start_ns(one) >= CLOCK_SET_NS for one in logs)


def sessions(logs: Sequence[AveragedLog]) -> tuple[int, ...]:
    """Return a number for each log, the same for logs of one session; empty where their times are no dates.

    A session ends where no log begins within `INFERENCE.session_gap_h` of the end of those before.
    """
    if not dated(logs):
        return ()
    found, session, end = [0] * len(logs), -1, 0.0
    for i in sorted(range(len(logs)), key=lambda i: start_ns(logs[i])):
        start_h = start_ns(logs[i]) / 3.6e12
        if session < 0 or start_h - end > INFERENCE.session_gap_h:
            session, end = session + 1, start_h
        end = max(end, start_h + float(logs[i].windows.measurements.t[-1]) / 3600.0)
        found[i] = session
    return tuple(found)
