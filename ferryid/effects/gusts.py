"""Gusts: a wind that was found blows now more and now less, on both components alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Process, Processes, Values
from ferryid.effects.force_model import ForceModel, Measurements, wind_load
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

DIFFERENCE_MPS = 0.1
"""Change of the wind by which its load is differentiated [m/s]."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return strength and memory."""
    return (Parameter("std", "m/s", 1.0, 0.0, 15.0), Parameter("time_constant", "s", 8.0, 0.1, 300.0))


def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Let a wind be gusty, which raises its mean load."""
    return force_model.replaced(gust_std=float(p[0]))


def unsteady(force_model: ForceModel) -> Processes:
    """Return the load of a gust to the north and to the east; none in still air, whose load is of second order."""
    measurements = force_model.measurements
    if measurements.profile.wind is None or force_model.air is None:
        return lambda p: ()
    loads, factors = [], 1.0 if force_model.air_factors is None else force_model.air_factors
    for towards in np.eye(2):
        ends = [wind_load(measurements, force_model.air + side * DIFFERENCE_MPS * towards) for side in (1.0, -1.0)]
        loads.append(factors * (ends[0] - ends[1]) / (2.0 * DIFFERENCE_MPS))
    return lambda p: tuple(Process(load, float(p[0]), float(p[1])) for load in loads)


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show gusts."""
    if measurements.wind is not None:
        return "the wind was measured, gusts included"
    return "the profile has no wind areas" if measurements.profile.wind is None else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    lasting_s = values["time_constant"]
    lasting = f"{lasting_s:.0f}" if lasting_s >= 1.0 else f"{lasting_s:.1g}"
    return f"The wind was gusty: {values['std']:.1f} m/s about its mean, a gust lasting some {lasting} s."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's gusts."""
    return {"environment": {"wind": {"gust_std_mps": values["std"], "gust_time_s": values["time_constant"]}}}


EFFECT = Effect(
    "gusts",
    "Gusts",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    unsteady=unsteady,
    about="wind",
    absent_in=("tank",),
)
