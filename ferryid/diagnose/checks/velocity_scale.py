"""Velocity scale: velocities measured in another unit, or by an instrument that reads too much or too little."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.kinematics import SCALE, kinematics
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements

UNITS = {
    1.0 / 0.514444: "knots read as m/s",
    0.514444: "m/s read as knots",
    3.6: "km/h read as m/s",
    1.0 / 3.6: "m/s read as km/h",
}
"""Factors of mistaken units, measured over true."""


def find(measurements: Measurements) -> SensorFinding | None:
    """Return the factor, measured over true, where speed over ground is not what positions give."""
    found = kinematics(measurements)
    if found is None or not found.found(SCALE, CHECKS.least_scale):
        return None
    factor = found.solution.estimate(SCALE, "-")
    narrow = factor.high - factor.low < CHECKS.unit_width * factor.value
    unit = [(value, text) for value, text in UNITS.items() if narrow and factor.low <= value <= factor.high]
    right = unit[0][0] if unit else factor.value
    scale = np.array([right, right, 1.0])

    def correct(measured: Measurements) -> Measurements:
        return replace(measured, nu_raw=measured.nu_raw / scale, nu=measured.nu / scale)

    return SensorFinding(
        "velocity_scale",
        {"factor": factor},
        f"The speed measured is {factor.value:.3f} times that of the positions{': ' + unit[0][1] if unit else ''}.",
        correct,
        found.evidence(SCALE),
    )


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the factor however near to 1; see `find`."""
    found = kinematics(measurements, (SCALE,))
    return {} if found is None else {"factor": found.solution.estimate(SCALE, "-")}


CHECK = Check("velocity_scale", "Position against integrated velocity", find, 40, estimate)
