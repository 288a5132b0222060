"""Heading bias: the heading is off, and so is the velocity that the navigation resolves along the vessel with it.

Kinematics cannot tell, as the velocity over ground is right; forces can, as thrust and hull keep to the true axes.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, corrected
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return by how much the heading measured is too large, clockwise."""
    return (Parameter("angle", "deg", 4.0, -90.0, 90.0),)


def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Turn heading and velocity to the true axes, for all that depends on them; what is compared stays along those measured."""
    b = radians(float(p[0]))
    if b == 0.0:
        return force_model
    measurements = force_model.measurements
    c, s = cos(b), sin(b)
    u, v, r = measurements.nu.T
    nu = np.column_stack([c * u - s * v, s * u + c * v, r])
    eta = measurements.eta - np.array([0.0, 0.0, b])
    return corrected(force_model, replace(measurements, eta=eta, nu=nu)).replaced(turned=force_model.turned + b)


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    side = "clockwise" if values["angle"] > 0.0 else "anticlockwise"
    return f"The heading is {abs(values['angle']):.1f} deg too far {side}, against the axes of hull and thrusters."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's bias."""
    return {"sensors": {"navigation": {"heading_bias_deg": values["angle"]}}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the thrust along the other axis, some of which seems to act along this one."""
    j, other = (1, "sway") if axis == "surge" else (0, "surge")
    return f"thrusters' {other} force [N]", force_model.parts[:, :, j].sum(axis=1)


EFFECT = Effect(
    "heading_bias",
    "Heading bias",
    parameters_of,
    apply,
    says,
    scenario,
    vessel=True,
    of_sensor=True,
    sidewise=("angle",),
    negligible=EFFECTS.least_heading,
    regressor=regressor,
    formula_error=EFFECTS.definition_error,
)
