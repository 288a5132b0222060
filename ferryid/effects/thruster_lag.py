"""Thruster lag: force follows measured speed with a first-order lag, for all thrusters alike."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.recursive_filter import lagged
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the time constant."""
    return (Parameter("time_constant", "s", 0.5, 0.0, 10.0),)


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Let the strength of each thruster lag; its direction is as measured."""
    if p[0] < 1e-3:
        return force_model
    late = partial(lagged, time_constant_s=float(p[0]), step_s=force_model.measurements.step_s)
    parts = force_model.parts.copy()
    for k in range(parts.shape[1]):
        angle = force_model.angles[:, k]
        if np.isfinite(angle).all():
            c, s = np.cos(angle), np.sin(angle)
            along = parts[:, k, 0] * c + parts[:, k, 1] * s
            felt = late(along)
            x, y = force_model.measurements.profile.actuators[k].position_m
            parts[:, k, 0], parts[:, k, 1] = felt * c, felt * s
            parts[:, k, 2] = x * parts[:, k, 1] - y * parts[:, k, 0]
        else:
            parts[:, k] = late(parts[:, k])
    return force_model.replaced(parts=parts)


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    lag_s = values["time_constant"]
    return f"Thrust follows the recorded speeds, or orders where there is no feedback, with a lag of {lag_s:.2f} s."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's lag."""
    return {"thrusters": {"force_lag_s": values["time_constant"]}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return how fast the thrust changes."""
    j = AXES.index(axis)
    rate = np.gradient(force_model.parts[:, :, j].sum(axis=1), force_model.measurements.step_s)
    return f"change of the thrusters' {axis} {'moment [N·m/s]' if axis == 'yaw' else 'force [N/s]'}", rate


EFFECT = Effect(
    "thruster_lag",
    "Thruster lag",
    parameters_of,
    apply,
    says,
    scenario,
    vessel=True,
    out_of_step=True,
    negligible=EFFECTS.least_lag,
    regressor=regressor,
)
