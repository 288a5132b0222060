"""Inflow loss: thrust falls with the water's velocity into the propeller."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ferryid.compiled import compiled
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.equations_of_motion import relative
from ferryid.effects.force_model import ForceModel, Measurements, check_actuators, flow_along_vessel, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the share lost per m/s."""
    return (Parameter("per_mps", "s/m", 0.2, -0.2, 2.0),)


@touches("parts", "flow")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Take ``k V_a`` off each force, V_a the velocity of the thruster through the water along its own push."""
    measurements = force_model.measurements
    check_actuators(force_model)
    places = np.array([one.position_m for one in measurements.profile.actuators]).reshape(-1, 2)
    parts, nu = map(np.ascontiguousarray, (force_model.parts, measurements.nu))
    return force_model.replaced(parts=_with_loss(parts, nu, flow_along_vessel(force_model), places, float(p[0])))


@compiled
def _with_loss(parts: Floats, nu: Floats, flow: Floats, places: Floats, per_mps: float) -> Floats:
    out = parts.copy()
    for i in range(parts.shape[0]):
        u, v, r = relative(i, nu, flow)
        for k in range(places.shape[0]):
            X, Y = parts[i, k, 0], parts[i, k, 1]
            size = math.sqrt(X * X + Y * Y)
            along = (X * (u - r * places[k, 1]) + Y * (v + r * places[k, 0])) / (size if size > 0.0 else 1.0)
            left = 1.0 - min(max(per_mps * along, -1.0), 1.0)
            out[i, k, 0], out[i, k, 1], out[i, k, 2] = left * X, left * Y, left * parts[i, k, 2]
    return out


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a loss: an open-water curve has the inflow in it, as has the thrust on the shaft."""
    with_inflow = all(
        one.thrust is not None and one.thrust.kind == "open_water" for one in measurements.profile.actuators
    )
    return "the open-water curves of all propellers have the inflow in them" if with_inflow else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    share = 100.0 * values["per_mps"]
    return f"Thrust {'falls' if share >= 0.0 else 'rises'} by {abs(share):.0f} % per m/s of water flowing into the propellers."


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
