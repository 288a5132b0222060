"""Azimuth offset: one thruster points elsewhere than its encoder reads."""

from __future__ import annotations

from math import radians
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return how far the true angle is ahead of the measured one, clockwise from above."""
    return (Parameter("angle", "deg", 6.0, -60.0, 60.0),)


def instances(profile: Profile) -> tuple[str | None, ...]:
    """Return the azimuth thrusters."""
    return tuple(actuator.name for actuator in profile.actuators if actuator.kind == "azimuth")


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Turn the force of the thruster."""
    k = force_model.measurements.names.index(str(instance))
    x, y = force_model.measurements.profile.actuators[k].position_m
    c, s = np.cos(radians(p[0])), np.sin(radians(p[0]))
    parts, angles = force_model.parts.copy(), force_model.angles.copy()
    X, Y = force_model.parts[:, k, 0], force_model.parts[:, k, 1]
    parts[:, k, 0], parts[:, k, 1] = c * X - s * Y, s * X + c * Y
    parts[:, k, 2] = x * parts[:, k, 1] - y * parts[:, k, 0]
    angles[:, k] += radians(p[0])
    return force_model.replaced(parts=parts, angles=angles)


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    side = "clockwise" if values["angle"] > 0.0 else "counterclockwise"
    return f"{instance} points {abs(values['angle']):.1f} deg further {side} than its encoder reads."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's fault."""
    return {"thrusters": {"faults": [{"thruster": instance, "offset_deg": values["angle"]}]}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the thruster's own force turned by a right angle."""
    k = force_model.measurements.names.index(str(instance))
    x, y = force_model.measurements.profile.actuators[k].position_m
    X, Y = force_model.parts[:, k, 0], force_model.parts[:, k, 1]
    turned = {"surge": -Y, "sway": X, "yaw": x * X + y * Y}[axis]
    return f"{instance}'s force turned by 90° {'[N·m]' if axis == 'yaw' else '[N]'}", turned


EFFECT = Effect(
    "azimuth_offset",
    "Azimuth offset",
    parameters_of,
    apply,
    says,
    scenario,
    instances=instances,
    vessel=True,
    regressor=regressor,
    formula_error=EFFECTS.definition_error,
    by_row=True,
)
