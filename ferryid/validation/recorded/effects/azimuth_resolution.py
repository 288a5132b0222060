"""Azimuth encoders of a coarse step."""

from __future__ import annotations

from math import degrees, radians, sqrt

import numpy as np

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import drives
from ferryid.validation.recorded.effects.azimuth_offset import turning
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog
from ferryid.vessel.frames import wrap


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a step [deg]."""
    return Truth("azimuth_resolution", None, {"step": size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Round the recorded angles; what acted is the angle as it was."""
    step, found = radians(truth.values["step"]), drives(log)
    columns = {name: log.columns[name] for name in (found[one].turn for one in turning(log))}
    return Concealed(log.changed({name: step * np.round(wrap(values) / step) for name, values in columns.items()}))


CONCEALMENT = Concealment(
    "azimuth_resolution",
    ACTUATOR,
    "deg",
    "The recorded angles of all thrusters that turn are rounded to a step.",
    lambda log: (0.3, 20.0),
    sample,
    conceal,
    lambda log: "" if turning(log) else "no thruster of it turns",
    visible=lambda log: degrees(sqrt(12.0) * CHECKS.least_azimuth_error),
)
