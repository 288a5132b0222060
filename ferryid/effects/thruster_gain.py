"""Thruster gain: one thruster gives more or less force than its curve says, from the start or from a time on.

Of a vessel without a hull model nobody knows how strong a thruster is at any time: a factor on its masses and damping does the
same. What is known is that its force changed, and by how much: there a step has a level on either side.

A rudder behind a propeller feels the thrust that acts: its force changes by what the slipstream does, and not by the factor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values, span
from ferryid.effects.force_model import ForceModel, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Floats
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import force_at, rudder_behind

LEAST_LEVEL = 1e-3
"""Share of the usual thrust below which it is taken as that share."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the factor on the force."""
    return (Parameter("factor", "-", 0.2, 0.0, 3.0, neutral=1.0, attainable=frozenset({0.0})),)


def parameters_of_step(profile: Profile) -> tuple[Parameter, ...]:
    """Return the factor in the span of a step on the force at other times, and that on the thrust curve then."""
    (factor,) = parameters_of(profile)
    return factor, replace(factor, name="otherwise")


@touches("parts")
def apply_step(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the thrust of the thruster by both."""
    return apply(force_model, p[:1] * p[1:], instance)


@touches("parts")
def otherwise(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the thrust of the thruster as at other times."""
    return apply(force_model, p[1:], instance)


def parameters_by_level(profile: Profile) -> tuple[Parameter, ...]:
    """Return the factor at the usual thrust, and the power of the thrust that multiplies it."""
    return *parameters_of(profile), Parameter("power", "-", 0.3, -1.0, 1.0)


@touches("parts")
def apply_by_level(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the thrust of the thruster by a power of it: a curve that rises faster or more slowly than the profile's."""
    measurements = force_model.measurements
    k = measurements.names.index(str(instance))
    thrust = np.hypot(*force_model.parts[:, k, :2].T)
    if measurements.rudders is not None and measurements.profile.actuators[k].rudder:
        thrust = measurements.rudders[:, k, 0]
    usual = float(np.sqrt(np.mean(thrust[measurements.usable] ** 2)))
    if usual == 0.0:
        return _multiplied(force_model, p[0], k)
    # Of no thrust a power below zero has no value, and nothing comes of it either way.
    level = np.maximum(np.abs(thrust) / usual, LEAST_LEVEL)
    return _multiplied(force_model, p[0] * level ** p[1], k)


def instances(profile: Profile) -> tuple[str | None, ...]:
    """Return the actuators."""
    return tuple(actuator.name for actuator in profile.actuators)


@touches("parts")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the thrust of the thruster."""
    return _multiplied(force_model, p[0], force_model.measurements.names.index(str(instance)))


def _multiplied(force_model: ForceModel, factor: Floats, k: int) -> ForceModel:
    """Return a force model with the thrust of one of its actuators multiplied by a factor, one for all rows or shape (n,)."""
    measurements = force_model.measurements
    parts, actuator = force_model.parts.copy(), measurements.profile.actuators[k]
    if measurements.rudders is None or not actuator.rudder:
        parts[:, k] *= np.reshape(factor, (-1, 1))
        return force_model.replaced(parts=parts)
    thrust, helm = measurements.rudders[:, k].T
    flow = 0.0 if measurements.current is None else current_in_body(measurements.current, measurements.psi)
    nu = measurements.nu - flow
    kept = 1.0 - actuator.inflow.get("thrust_deduction", 0.0)
    ahead = force_at(actuator, (factor - 1.0) * kept * thrust, actuator.angle_rad)
    steered = rudder_behind(actuator, helm, factor * thrust, nu) - rudder_behind(actuator, helm, thrust, nu)
    parts[:, k] += actuator.count * (ahead + steered)
    return force_model.replaced(parts=parts)


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    compared = "of its thrust curve" if "otherwise" not in values else "that it gives at other times"
    # A factor that is not zero is no "0 %".
    share = "less than 1 %" if 0.0 < values["factor"] < 0.005 else f"{100.0 * values['factor']:.0f} %"
    return f"{instance} gives {share} of the force {compared}."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's fault."""
    fault = {"thruster": instance, "factor": values["factor"], **span(values)}
    return {"thrusters": {"faults": [fault]}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the thruster's own force."""
    k = force_model.measurements.names.index(str(instance))
    j = AXES.index(axis)
    return f"{instance}'s own {axis} {'moment [N·m]' if axis == 'yaw' else 'force [N]'}", force_model.parts[:, k, j]


GAIN = Effect(
    "thruster_gain",
    "Thruster force",
    parameters_of,
    apply,
    says,
    scenario,
    instances=instances,
    onset=True,
    vessel=True,
    scales=True,
    regressor=regressor,
    formula_error=EFFECTS.definition_error,
    passing_size=lambda profile: EFFECTS.passing_gain,
    by_row=True,
)
BY_LEVEL = replace(GAIN, parameters_of=parameters_by_level, apply=apply_by_level, onset=False)
STEP = replace(GAIN, parameters_of=parameters_of_step, apply=apply_step, otherwise=otherwise, by_level=BY_LEVEL)
EFFECT = replace(GAIN, step=STEP, by_level=BY_LEVEL)
