"""Lever arm: position and velocity are those of an antenna that is not at the body origin.

Kinematics cannot tell, as both belong to the antenna; forces can, as the antenna swings round the body origin in turns.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, corrected
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.dimensions import off_hull
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return where the antenna is, ahead and to starboard of the body origin."""
    length = profile.hull.length_m
    half = 0.5 * length if np.isfinite(length) else profile.hull.mass_kg ** (1.0 / 3.0)
    return tuple(Parameter(axis, "m", 0.4 * half, -2.0 * half, 2.0 * half) for axis in ("x", "y"))


def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Move position and velocity to the body origin, for all that depends on them; what is compared stays the antenna's."""
    x, y = float(p[0]), float(p[1])
    if x == 0.0 and y == 0.0:
        return force_model
    measurements = force_model.measurements
    nu, eta, (cos, sin) = measurements.nu.copy(), measurements.eta.copy(), measurements.pointing
    nu[:, 0] += y * measurements.nu[:, 2]
    nu[:, 1] -= x * measurements.nu[:, 2]
    eta[:, 0] -= cos * x - sin * y
    eta[:, 1] -= sin * x + cos * y
    moved = replace(measurements, eta=eta, nu=nu)
    # The heading is the same: its cosine and sine need not be worked out again.
    moved.__dict__["pointing"] = measurements.pointing
    antenna = (force_model.antenna[0] + x, force_model.antenna[1] + y)
    return corrected(force_model, moved).replaced(antenna=antenna)


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    y = values["y"]
    if "x" not in values:
        side = "to starboard" if y >= 0.0 else "to port"
        return (
            f"Position and velocity belong to a point {abs(y):.2f} m {side} of the body origin; how far ahead of it "
            "shows beside a hull model only."
        )
    x = values["x"]
    ends = ("ahead" if x >= 0.0 else "astern", "to starboard" if y >= 0.0 else "to port")
    return f"Position and velocity belong to a point {abs(x):.2f} m {ends[0]} and {abs(y):.2f} m {ends[1]} of the body origin."


def doubt(values: Values, profile: Profile) -> str:
    """Return that the antenna would not be aboard."""
    return off_hull(profile, values.get("x", 0.0), values.get("y", 0.0))


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's antenna."""
    return {"sensors": {"navigation": {"antenna_m": [values.get("x", 0.0), values["y"]]}}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the yaw rate, with which the antenna swings."""
    return "yaw rate [deg/s]", np.degrees(force_model.measurements.nu[:, 2])


EFFECT = Effect(
    "lever_arm",
    "Antenna off the body origin",
    parameters_of,
    apply,
    says,
    scenario,
    vessel=True,
    of_sensor=True,
    sidewise=("y",),
    negligible=EFFECTS.least_arm,
    regressor=regressor,
    changes_hull=True,
    formula_error=EFFECTS.definition_error,
    doubt=doubt,
)
