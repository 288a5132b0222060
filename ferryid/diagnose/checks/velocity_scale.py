"""Velocity scale: velocities measured in another unit, or by an instrument that reads too much or too little."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding, rescaled
from ferryid.diagnose.checks.kinematics import SCALE, SIZE, kinematics
from ferryid.diagnose.checks.spans import least_off
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
    if found is None or not found.found(SCALE, least_off(measurements.step_s, CHECKS.least_scale)):
        return None
    factor = found.solution.estimate(SCALE, "-")
    narrow = factor.high - factor.low < CHECKS.unit_width * factor.value
    unit = [(value, text) for value, text in UNITS.items() if narrow and factor.low <= value <= factor.high]
    right = {"factor": unit[0][0] if unit else factor.value}
    says = says_of({"factor": factor.value})
    return SensorFinding(
        "velocity_scale",
        {"factor": factor},
        f"{says.removesuffix('.')}: {unit[0][1]}." if unit else says,
        lambda measured: corrected(measured, right),
        found.evidence(SCALE),
        doubt=_not_in_proportion(factor),
    )


def _not_in_proportion(factor: Estimate) -> str:
    """Return that velocities are no multiple of what positions give, as the end of a sentence; empty where they are."""
    half = 0.5 * (factor.high - factor.low) / factor.value
    if half <= CHECKS.scale_known:
        return ""
    return f"the factor is known to {100.0 * half:.0f} % of itself only: the velocities are not in proportion to the positions'"


def says_of(values: Mapping[str, float]) -> str:
    """Return the factor, as a sentence."""
    return f"The speed measured is {values['factor']:.3f} times that of the positions."


def corrected(measured: Measurements, values: Mapping[str, float]) -> Measurements:
    """Return measurements whose velocity is divided by a factor."""
    scale = np.array([values["factor"], values["factor"], 1.0])
    return replace(measured, nu_raw=measured.nu_raw / scale, nu=measured.nu / scale)


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the factor however near to 1; see `find`."""
    found = kinematics(measurements, (SCALE,))
    return {} if found is None else {"factor": found.solution.estimate(SCALE, "-")}


CHECK = Check(
    "velocity_scale",
    "Position against integrated velocity",
    find,
    40,
    estimate,
    Lasting(1.0, float(SIZE[SCALE]), lambda _: CHECKS.least_scale, says_of, corrected),
    lambda profile, values: rescaled(profile, "velocity", values["factor"]),
)
