"""Inflow loss: thrust falls with the water's velocity into the propeller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements, body_current
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the share lost per m/s."""
    return (Parameter("per_mps", "s/m", 0.2, -0.2, 2.0),)


def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Take ``k V_a`` off each force, V_a the velocity of the thruster through the water along its own push."""
    measurements = force_model.measurements
    u_c, v_c = body_current(force_model)
    u, v, r = measurements.nu.T
    parts = force_model.parts.copy()
    for k, actuator in enumerate(measurements.profile.actuators):
        x, y = actuator.position_m
        X, Y = force_model.parts[:, k, 0], force_model.parts[:, k, 1]
        size = np.hypot(X, Y)
        along = (X * (u - u_c - r * y) + Y * (v - v_c + r * x)) / np.where(size > 0.0, size, 1.0)
        parts[:, k] *= (1.0 - np.clip(p[0] * along, -1.0, 1.0))[:, None]
    return replace(force_model, parts=parts)


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a loss: an open-water curve has the inflow in it, as has the thrust on the shaft."""
    with_inflow = all(
        one.thrust is not None and one.thrust.kind == "open_water" for one in measurements.profile.actuators
    )
    return "the open-water curves of all propellers have the inflow in them" if with_inflow else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    return f"Thrust falls by {100.0 * values['per_mps']:.0f} % per m/s of water flowing into the propellers."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's loss."""
    return {"thrusters": {"inflow_loss_per_mps": values["per_mps"]}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return force times inflow, of all thrusters together."""
    j = AXES.index(axis)
    # A hundredth of the loss, so that nothing is clipped.
    lost = force_model.parts.sum(axis=1) - apply(force_model, np.array([0.01]), instance).parts.sum(axis=1)
    unit = "N·m·m/s" if axis == "yaw" else "N·m/s"
    return f"inflow speed times {axis} {'moment' if axis == 'yaw' else 'force'} of the thrusters [{unit}]", lost[
        :, j
    ] / 0.01


EFFECT = Effect(
    "thrust_inflow_loss",
    "Inflow loss",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    vessel=True,
    regressor=regressor,
    negligible=EFFECTS.least_inflow,
    by_row=True,
)
