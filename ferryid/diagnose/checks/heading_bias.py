"""Heading bias: the course over ground that positions give is turned from the one that heading and body velocity give.

A current cannot do that, both are over ground. A receiver that resolves its own velocity over ground with the biased heading
hides the bias from this check; see `ferryid.effects.heading_bias`.
"""

from __future__ import annotations

from dataclasses import replace
from math import degrees

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.kinematics import ANGLE, Kinematics, kinematics
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements


def find(measurements: Measurements) -> SensorFinding | None:
    """Return the heading's bias against the velocity's axes, positive where the heading measured is too large."""
    found = kinematics(measurements)
    if found is None or not found.found(ANGLE, np.radians(CHECKS.least_angle_deg)):
        return None
    angle = _angle(found)
    side = "clockwise" if angle.value > 0.0 else "anticlockwise"
    bias = float(found.solution.values[ANGLE])

    def correct(measured: Measurements) -> Measurements:
        return replace(measured, eta=measured.eta - np.array([0.0, 0.0, bias]))

    return SensorFinding(
        "heading_bias",
        {"angle": angle},
        f"The heading is {abs(angle.value):.1f} deg too far {side} of the axes in which the velocity was measured.",
        correct,
        found.evidence(ANGLE),
    )


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the bias however small; see `find`."""
    found = kinematics(measurements, (ANGLE,))
    return {} if found is None else {"angle": _angle(found)}


def _angle(found: Kinematics) -> Estimate:
    return found.solution.estimate(ANGLE, "deg", degrees(1.0))


CHECK = Check("heading_bias", "Heading against course over ground", find, 50, estimate)
