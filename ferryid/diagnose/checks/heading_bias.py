"""Heading bias: the course over ground that positions give is turned from the one that heading and body velocity give.

A current cannot do that, both are over ground. A receiver that resolves its own velocity over ground with the biased heading
hides the bias from this check; see `ferryid.effects.heading_bias`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import degrees, radians

import numpy as np

from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding, mapped
from ferryid.diagnose.checks.kinematics import ANGLE, SIZE, Kinematics, kinematics
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.vessel.parse_signals import WORLD_FRAMES
from ferryid.vessel.profile import Profile
from ferryid.vessel.units import factor


def find(measurements: Measurements) -> SensorFinding | None:
    """Return the heading's bias against the velocity's axes, positive where the heading measured is too large."""
    found = kinematics(measurements)
    if found is None or not found.found(ANGLE, np.radians(CHECKS.least_angle_deg)):
        return None
    angle = _angle(found)
    values = {"angle": angle.value}
    return SensorFinding(
        "heading_bias",
        {"angle": angle},
        says_of(values),
        lambda measured: corrected(measured, values),
        found.evidence(ANGLE),
    )


def says_of(values: Mapping[str, float]) -> str:
    """Return to which side the heading is off, as a sentence."""
    side = "clockwise" if values["angle"] > 0.0 else "anticlockwise"
    return (
        f"The heading is {abs(values['angle']):.1f} deg too far {side} of the axes in which the velocity was measured."
    )


def corrected(measured: Measurements, values: Mapping[str, float]) -> Measurements:
    """Return measurements whose heading is without the bias."""
    return replace(measured, eta=measured.eta - np.array([0.0, 0.0, radians(values["angle"])]))


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the bias however small; see `find`."""
    found = kinematics(measurements, (ANGLE,))
    return {} if found is None else {"angle": _angle(found)}


def in_profile(profile: Profile, values: Mapping[str, float]) -> str:
    """Return the line that takes the bias off the heading as it is mapped."""
    signal = mapped(profile, "heading")
    if signal is None:
        return ""
    turned = values["angle"] if signal.frame == "ENU" else -values["angle"]
    key, unit = ("offset_deg", "deg") if signal.unit == "quaternion" else ("offset", signal.unit)
    return f"{key} = {signal.offset + radians(turned) / factor(unit, 'angle'):.4g} in [signals.heading]"


def hidden(profile: Profile) -> bool:
    """Return whether the velocity is recorded along north and east: the heading resolved it, and its error leaves no trace."""
    velocity = mapped(profile, "velocity")
    return velocity is not None and velocity.frame in WORLD_FRAMES


def _angle(found: Kinematics) -> Estimate:
    return found.solution.estimate(ANGLE, "deg", degrees(1.0))


CHECK = Check(
    "heading_bias",
    "Heading against course over ground",
    find,
    50,
    estimate,
    Lasting(0.0, degrees(SIZE[ANGLE]), lambda _: CHECKS.least_angle_deg, says_of, corrected),
    in_profile,
    hidden,
)
