"""Screening of the sensors: the second stage of a diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ferryid.diagnose.checks import SensorFinding, examine
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
    """

    measured: MeasuredLog
    measurements: Measurements
    sensors: tuple[SensorFinding, ...]


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
