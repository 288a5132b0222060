"""Thruster interaction: a thruster loses force while another's wake points at it."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import thrust

SHARPNESS = 16
"""Power of the cosine of the angle beside the wake: half of the loss is left at 17 degrees."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the loss in a full wake that points straight at a thruster."""
    return (Parameter("fraction", "-", 0.2, 0.0, 1.0),)


def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Take the loss off, which grows with the root of the force behind the wake as a jet's speed does."""
    actuators = force_model.measurements.profile.actuators
    parts = force_model.parts.copy()
    size = np.hypot(force_model.parts[:, :, 0], force_model.parts[:, :, 1])
    pushes = [np.sqrt(np.minimum(size[:, j] / _full(force_model, j, size[:, j]), 1.0)) for j in range(len(actuators))]
    for i, hit in enumerate(actuators):
        for j, source in enumerate(actuators):
            dx, dy = hit.position_m[0] - source.position_m[0], hit.position_m[1] - source.position_m[1]
            apart = hypot(dx, dy)
            if i == j or apart == 0.0:
                continue
            push = force_model.parts[:, j]
            towards = -(push[:, 0] * dx + push[:, 1] * dy) / (np.maximum(size[:, j], 1e-9) * apart)
            parts[:, i] *= (1.0 - p[0] * _in_wake(towards) * pushes[j])[:, None]
    return replace(force_model, parts=parts)


def _in_wake(towards: Floats) -> Floats:
    """Return the cosine of the angle beside the wake to the power of `SHARPNESS`, by squaring: a twentieth of the time."""
    power = np.maximum(towards, 0.0)
    for _ in range(SHARPNESS.bit_length() - 1):
        power *= power
    return power


def _full(force_model: ForceModel, j: int, size: Floats) -> Floats:
    """Return the most that a thruster can push, ahead or astern as it does [N], shape (n,); the log's most without a curve."""
    actuator = force_model.measurements.profile.actuators[j]
    most = np.full(len(size), max(float(size.max()), 1e-9))
    if actuator.thrust is None or actuator.thrust.kind == "open_water":
        return most
    angle = force_model.angles[:, j] if actuator.kind == "azimuth" else np.full(len(size), actuator.angle_rad)
    along = force_model.parts[:, j, 0] * np.cos(angle) + force_model.parts[:, j, 1] * np.sin(angle)
    factor = 60.0 if actuator.thrust.input_unit == "rps" else 1.0
    astern, ahead = thrust(actuator.thrust, factor * np.array(actuator.thrust.valid))[0] * actuator.count
    return np.asarray(np.maximum(np.abs(np.where(along < 0.0, astern, ahead)), 1e-9))


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show it."""
    return "" if len(measurements.names) > 1 else "there is one actuator only"


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    return f"A thruster in the wake of another loses up to {100.0 * values['fraction']:.0f} % of its force."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's interaction."""
    return {"thrusters": {"interaction_fraction": values["fraction"]}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the force of a thruster by how much of a full wake it lies in: the angle alone leaves its direction open."""
    j = AXES.index(axis)
    lost = force_model.parts.sum(axis=1) - apply(force_model, np.array([1.0]), instance).parts.sum(axis=1)
    what, unit = ("moment", "N·m") if axis == "yaw" else ("force", "N")
    return f"{axis} {what} of the thruster in the wake [{unit}]", lost[:, j]


EFFECT = Effect(
    "thruster_interaction",
    "Thruster interaction",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    vessel=True,
    regressor=regressor,
    negligible=EFFECTS.least_wake,
)
