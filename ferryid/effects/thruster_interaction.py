"""Thruster interaction: a thruster loses force while another's wake points at it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ferryid.compiled import compiled
from ferryid.effects.actuator_force import along
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements, check_actuators, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import thrust

SQUARINGS = 4
"""How often the cosine of the angle beside the wake is squared: of its power of 16 half of the loss is left at 17 degrees."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the loss in a full wake that points straight at a thruster."""
    return (Parameter("fraction", "-", 0.2, 0.0, 1.0),)


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Take the loss off, which grows with the root of the force behind the wake as a jet's speed does."""
    actuators = force_model.measurements.profile.actuators
    check_actuators(force_model)
    places = np.array([one.position_m for one in actuators]).reshape(-1, 2)
    most = np.empty((len(force_model.parts), len(actuators)))
    for j in range(len(actuators)):
        most[:, j] = _full(force_model, j)
    parts = np.ascontiguousarray(force_model.parts)
    return force_model.replaced(parts=_with_loss(parts, places, most, float(p[0])))


@compiled
def _with_loss(parts: Floats, places: Floats, most: Floats, fraction: float) -> Floats:
    out = parts.copy()
    for i in range(parts.shape[0]):
        for j in range(places.shape[0]):
            X, Y = parts[i, j, 0], parts[i, j, 1]
            size = max(math.sqrt(X * X + Y * Y), 1e-9)
            push = math.sqrt(min(size / most[i, j], 1.0))
            for k in range(places.shape[0]):
                dx, dy = places[k, 0] - places[j, 0], places[k, 1] - places[j, 1]
                apart = math.sqrt(dx * dx + dy * dy)
                if apart > 0.0:
                    wake = max(-(X * dx + Y * dy) / (size * apart), 0.0)
                    # By squaring: a twentieth of the time.
                    for _ in range(SQUARINGS):
                        wake *= wake
                    left = 1.0 - fraction * wake * push
                    out[i, k, 0] *= left
                    out[i, k, 1] *= left
                    out[i, k, 2] *= left
    return out


def _full(force_model: ForceModel, j: int) -> Floats:
    """Return the most that a thruster can push, ahead or astern as it does [N], shape (n,); the log's most without a curve."""
    actuator, n = force_model.measurements.profile.actuators[j], len(force_model.parts)
    if actuator.thrust is None or actuator.thrust.kind == "open_water":
        return np.full(n, max(float(np.hypot(force_model.parts[:, j, 0], force_model.parts[:, j, 1]).max()), 1e-9))
    factor = 60.0 if actuator.thrust.input_unit == "rps" else 1.0
    astern, ahead = np.maximum(np.abs(thrust(actuator.thrust, factor * np.array(actuator.thrust.valid))[0]), 1e-9)
    return np.asarray(actuator.count * np.where(along(force_model, j) < 0.0, astern, ahead))


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
