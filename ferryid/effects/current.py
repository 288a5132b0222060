"""Current: water that moves steadily over ground, felt through the relative velocity; it may set in or slacken in the log."""

from __future__ import annotations

from math import atan2, degrees, hypot
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Turbulence, Values, span
from ferryid.effects.force_model import ForceModel, Measurements, touches
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import bearing
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the current's components, where the water goes to."""
    return (Parameter("north", "m/s", 0.2, -3.0, 3.0), Parameter("east", "m/s", 0.2, -3.0, 3.0))


@touches("flow")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Let the water move."""
    flow = np.broadcast_to(p, (len(force_model.measurements.t), 2))
    return force_model.replaced(flow=flow if force_model.flow is None else force_model.flow + flow)


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a current."""
    return "the current was measured and is part of the model" if measurements.current is not None else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    north, east = values["north"], values["east"]
    towards = degrees(atan2(east, north)) % 360.0
    return f"A current of {hypot(north, east):.2f} m/s set towards {bearing(towards)}."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's current."""
    return {"environment": {"current": {"north_mps": values["north"], "east_mps": values["east"], **span(values)}}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the heading: what is constant over ground turns with it."""
    return "heading [deg]", np.asarray(np.degrees(force_model.measurements.psi) % 360.0)


EFFECT = Effect(
    "current",
    "Current",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    onset=True,
    regressor=regressor,
    changes_hull=True,
    negligible=EFFECTS.least_current,
    passing_size=lambda profile: EFFECTS.passing_current,
    of_log=("north", "east"),
    turbulence=Turbulence(EFFECTS.current_turbulence, EFFECTS.least_current_std, EFFECTS.current_length),
    absent_in=("tank",),
    rare_in=("pond",),
    common_in=("sea",),
    by_row=True,
)
