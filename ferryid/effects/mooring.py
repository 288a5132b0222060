"""Mooring: a spring from the vessel to a point, with a stiffness of its own along north and east: a line, or a quay touched."""

from __future__ import annotations

from math import cos, inf, sin
from typing import Any

import numpy as np

from ferryid.effects.effect import Effect, Parameter, Values, span
from ferryid.effects.force_model import ForceModel, Measurements, touches
from ferryid.effects.simulated import Simulated
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import amount
from ferryid.types import Floats
from ferryid.vessel.frames import to_body
from ferryid.vessel.profile import Profile


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return stiffness and place; a spring of moderate size swings the vessel in a minute or two."""
    stiff = profile.hull.mass_kg * 0.004
    return (
        # Without a spring its place has no meaning.
        Parameter("stiffness_north", "N/m", stiff, 0.0, 1e3 * stiff, start=0.3 * stiff),
        Parameter("stiffness_east", "N/m", stiff, 0.0, 1e3 * stiff, start=0.3 * stiff),
        Parameter("north", "m", 20.0, -1e4, 1e4),
        Parameter("east", "m", 20.0, -1e4, 1e4),
    )


@touches("external")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Add the spring's pull on the body origin."""
    measurements = force_model.measurements
    cosine, sine = measurements.pointing
    north, east = -p[0] * (measurements.eta[:, 0] - p[2]), -p[1] * (measurements.eta[:, 1] - p[3])
    external = force_model.external.copy()
    external[:, 0] += cosine * north + sine * east
    external[:, 1] += cosine * east - sine * north
    return force_model.replaced(external=external)


def load(
    p: Floats, t: float, x: float, y: float, psi: float, u: float, v: float, r: float, u_r: float, v_r: float
) -> tuple[float, float, float]:
    """Return the spring's pull on the body origin [N, N, N·m] for the simulator; see `ferryid.effects.simulated.Simulated`."""
    north, east = -p[0] * (x - p[2]), -p[1] * (y - p[3])
    c, s = cos(psi), sin(psi)
    return c * north + s * east, c * east - s * north, 0.0


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a mooring."""
    return "" if np.isfinite(measurements.eta[measurements.usable, :2]).all() else "the log has no position"


def doubt_where(values: Values, measurements: Measurements) -> str:
    """Return that the pull hardly changed with the place, which is what holds like a spring, as the end of a sentence."""
    t = measurements.t
    rows = measurements.usable & (t >= values.get("onset", -inf)) & (t <= values.get("offset", inf))
    away = measurements.eta[rows, :2] - [values.get("north", 0.0), values.get("east", 0.0)]
    pull = away * [values.get("stiffness_north", 0.0), values.get("stiffness_east", 0.0)]
    if not len(pull):
        return ""
    mean = float(np.hypot(*pull.mean(axis=0)))
    change = float(np.sqrt(pull.var(axis=0).sum()))
    if change >= EFFECTS.least_pull_change * mean:
        return ""
    return (
        f"its pull is {amount(mean)} N on average and changes by {amount(change)} N where the vessel was: a wind, a current "
        "and the drift of waves push like that, too"
    )


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    return (
        f"Something holds the vessel like a spring of {amount(values['stiffness_north'])} N/m (north) and "
        f"{amount(values['stiffness_east'])} N/m (east) from {values['north']:.0f} m north, {values['east']:.0f} m east: a "
        "mooring line or a tow."
    )


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's mooring."""
    spring = {
        "north_m": values["north"],
        "east_m": values["east"],
        "stiffness_north_Npm": values["stiffness_north"],
        "stiffness_east_Npm": values["stiffness_east"],
        **span(values),
    }
    return {"environment": {"mooring": spring}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return how far the vessel is from the point, along the axis."""
    eta = force_model.measurements.eta
    ahead, aside = to_body(eta[:, 0] - p[2], eta[:, 1] - p[3], eta[:, 2])
    if axis == "sway":
        return "place from the mooring, to starboard [m]", aside
    return "place from the mooring, ahead [m]", ahead


EFFECT = Effect(
    "mooring",
    "Mooring",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    doubt_where=doubt_where,
    onset=True,
    regressor=regressor,
    formula_error=EFFECTS.load_error,
    simulated=Simulated(load),
    rare_in=("tank", "pond", "sea"),
    common_in=("harbour",),
    acts_last=True,
)
