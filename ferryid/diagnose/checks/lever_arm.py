"""Lever arm: positions of an antenna against velocities of another point.

Which of the two is the body origin is not for kinematics to say. Where both belong to the antenna, they agree and this check
is silent; see `ferryid.effects.lever_arm`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding, mapped
from ferryid.diagnose.checks.kinematics import SIZE, Kinematics, X, Y, kinematics
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.vessel.frames import to_world
from ferryid.vessel.profile import Profile


def least_m(measurements: Measurements) -> float:
    """Return the least lever arm along an axis that is worth a name [m]."""
    length = measurements.profile.hull.length_m
    return max(CHECKS.least_arm_m, CHECKS.least_arm_share * length) if np.isfinite(length) else CHECKS.least_arm_m


def find(measurements: Measurements) -> SensorFinding | None:
    """Return where positions were measured, seen from where velocities were."""
    found = kinematics(measurements)
    if found is None:
        return None
    least = least_m(measurements)
    if not (found.found(X, least) or found.found(Y, least)):
        return None
    x, y = _place(found)
    values = {"x": x.value, "y": y.value}
    return SensorFinding(
        "lever_arm",
        {"x": x, "y": y},
        says_of(values),
        lambda measured: corrected(measured, values),
        found.evidence(X if abs(x.value) >= abs(y.value) else Y),
    )


def says_of(values: Mapping[str, float]) -> str:
    """Return where positions were measured, as a sentence."""
    x, y = values["x"], values["y"]
    ends = ("ahead" if x >= 0.0 else "astern", "to starboard" if y >= 0.0 else "to port")
    return f"Positions belong to a point {abs(x):.2f} m {ends[0]} and {abs(y):.2f} m {ends[1]} of where velocities do."


def corrected(measured: Measurements, values: Mapping[str, float]) -> Measurements:
    """Return measurements whose positions are those of the point where velocities were measured."""
    one = np.ones(len(measured.t))
    arm = np.column_stack([*to_world(values["x"] * one, values["y"] * one, measured.psi), 0.0 * one])
    return replace(measured, eta=measured.eta - arm)


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the place however near; see `find`."""
    found = kinematics(measurements, (X, Y))
    return {} if found is None else dict(zip("xy", _place(found), strict=True))


def in_profile(profile: Profile, values: Mapping[str, float]) -> str:
    """Return the line that carries positions to where the velocities were measured."""
    signal = mapped(profile, "position")
    if signal is None:
        return ""
    x, y = signal.mount_m[0] + values["x"], signal.mount_m[1] + values["y"]
    return f"mount_m = [{x:.2f}, {y:.2f}] in [signals.position] (if the velocity is that of the body origin)"


def _place(found: Kinematics) -> tuple[Estimate, Estimate]:
    return found.solution.estimate(X, "m"), found.solution.estimate(Y, "m")


CHECK = Check(
    "lever_arm",
    "Position against velocity in turns",
    find,
    60,
    estimate,
    Lasting(0.0, float(SIZE[X]), least_m, says_of, corrected),
    in_profile,
)
