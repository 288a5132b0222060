"""Screening of the sensors: the second stage of a diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ferryid.diagnose.checks import SensorFinding, examine, examine_together
from ferryid.diagnose.data.measurements import MeasuredLog
from ferryid.effects.force_model import Measurements


@dataclass(frozen=True)
class ScreenedLog:
    """A log whose sensors were checked against each other.

    Attributes
    ----------
    measured
        As it was measured.
    measurements
        Without the sensors' errors.
    sensors
        These.
    notes
        In what it differs from the other logs of its campaign, as sentences.
    """

    measured: MeasuredLog
    measurements: Measurements
    sensors: tuple[SensorFinding, ...]
    notes: tuple[str, ...] = ()


def screen_sensors(log: MeasuredLog, progress: Callable[[str], None]) -> ScreenedLog:
    """Find the sensors' errors in a log, and correct them.

    Raises
    ------
    FerryIdError
        Where signals contradict each other, so that nothing can be learnt from the log.
    """
    progress("checking the sensors against each other")
    sensors, measurements = examine(log.measurements)
    return ScreenedLog(log, measurements, sensors)


def screen_together(logs: Sequence[ScreenedLog], copies: Sequence[bool]) -> tuple[ScreenedLog, ...]:
    """Return the logs of one vessel with what several of them show of their sensors pooled over all of them.

    Parameters
    ----------
    logs
        Each screened by itself.
    copies
        Which of them hold the motion of another.
    """
    examined = examine_together([one.measured.measurements for one in logs], [one.sensors for one in logs], copies)
    return tuple(
        ScreenedLog(log.measured, one.measurements, tuple(one.findings), tuple(one.notes))
        if one.otherwise or one.notes or any(each.doubt for each in one.findings)
        else log
        for log, one in zip(logs, examined, strict=True)
    )
