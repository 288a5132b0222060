"""Astern asymmetry: one actuator gives another share of its thrust curve's force astern than ahead."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ferryid.effects.actuator_force import acts_in, along, force_is_measured, index_of, loss_label, lost, scaled
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements, touches
from ferryid.effects.simulated import Simulated, entry
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the factor on the force astern; ahead the thrust curve holds."""
    return (Parameter("factor", "-", 0.3, 0.0, 3.0, neutral=1.0, attainable=frozenset({0.0})),)


def instances(profile: Profile) -> tuple[str | None, ...]:
    """Return the actuators whose force is not measured itself."""
    return tuple(one.name for one in profile.actuators if not force_is_measured(profile, one))


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Multiply the force of the actuator where it acts astern."""
    k = index_of(force_model, instance)
    return scaled(force_model, k, np.where(along(force_model, k) < 0.0, p[0], 1.0))


def cannot(measurements: Measurements) -> str:
    """Return why the measurements cannot show it of any actuator."""
    return "" if instances(measurements.profile) else "the force of every actuator is measured"


def cannot_be_of(measurements: Measurements, instance: str | None) -> str:
    """Return why the log cannot show it of one actuator: a force one way only is a gain."""
    push = along(measurements, index_of(measurements, instance))[measurements.usable]
    least = EFFECTS.acting_force * float(np.max(np.abs(push), initial=0.0))
    if not acts_in(push < -least):
        return "no actuator ran astern long enough"
    return "" if acts_in(push > least) else "no actuator ran both ahead and astern long enough"


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    return f"{instance} gives {100.0 * values['factor']:.0f} % of the force of its thrust curve astern, and all of it ahead."


def thrust(p: Any, speed: float, force: float) -> float:
    """Return the simulated force of the actuator."""
    return float(p[0]) * force if force < 0.0 else force


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the actuator's force where it acts astern."""
    return loss_label(instance, axis, "astern"), lost(force_model, apply(force_model, np.zeros(1), instance), axis)


EFFECT = Effect(
    "astern_asymmetry",
    "Astern force",
    parameters_of,
    apply,
    says,
    partial(entry, "astern_asymmetry"),
    instances=instances,
    cannot=cannot,
    cannot_be_of=cannot_be_of,
    of_thrust_curve=True,
    vessel=True,
    regressor=regressor,
    formula_error=EFFECTS.definition_error,
    simulated=Simulated(thrust=thrust),
    by_row=True,
)
