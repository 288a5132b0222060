"""Wind: Blendermann's load of an air flow that is steady over ground.

Areas and shape of the superstructure tell the load on a vessel to some ten per cent, and its moment worse. How much more or
less it is on each axis is fitted beside the flow and not told: without it, the axis that is measured best would tell the wind
by the coefficient that is known worst.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2, degrees, hypot, sqrt
from typing import Any

import numpy as np

from ferryid.effects.effect import Choice, Effect, Parameter, Residual, Turbulence, Values, span
from ferryid.effects.force_model import ForceModel, Measurements, touches, wind_load, wind_load_by_row
from ferryid.effects.hull_spread import hull_model_spread
from ferryid.effects.linear_evidence import hull_jacobian, profiled_loss
from ferryid.effects.thresholds import EFFECTS
from ferryid.effects.wording import bearing
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

COEFFICIENTS = {"C_X": 0.1, "C_Y": 0.1, "C_N": 0.3}
"""Factors on the load along each axis, and how far off the profile's are believed to be."""
SPEEDS_MPS, BEARINGS = (0.0, 1.5, 3.0, 6.0, 12.0), 12
"""Winds among which the likeliest is where a search begins: as a load goes with the square of the speed, and a controller leans
against it, a wind from the other side may be likelier than none, and than all between."""

MEAN_WEIGHTS = np.array([1.0 / 3.0, *[1.0 / 6.0] * 4])
"""Of the loads of a wind as it is on average and in the four gusts of `mean_load`."""
MEAN_GUSTS = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
KEPT = 8
"""Loads of winds that are kept beside the measurements."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the wind's components, where the air goes to, and factors on its load."""
    return (
        Parameter("north", "m/s", 4.0, -30.0, 30.0),
        Parameter("east", "m/s", 4.0, -30.0, 30.0),
        *(Parameter(name, "-", size, 0.2, 3.0, neutral=1.0) for name, size in COEFFICIENTS.items()),
    )


def choose(force_model: ForceModel, prior_hull: Floats, residual: Residual) -> Choice:
    """Return the parameters with the wind to begin with."""
    parameters = parameters_of(force_model.measurements.profile)
    angles = np.arange(BEARINGS) * 2.0 * np.pi / BEARINGS
    winds = [
        np.array([speed * np.cos(angle), speed * np.sin(angle)])
        for speed in SPEEDS_MPS
        for angle in (angles if speed > 0.0 else angles[:1])
    ]
    J, e = hull_jacobian(force_model, prior_hull, residual, np.flatnonzero(prior_hull).tolist())
    calm = residual(force_model)
    left = np.column_stack([e + residual(apply(force_model, wind, None)) - calm for wind in winds])
    sizes = np.array([one.size for one in parameters[:2]])
    away = np.array([float(np.sum((wind / sizes) ** 2)) for wind in winds])
    spread = hull_model_spread(force_model.measurements.profile)
    best = winds[int(np.argmin(profiled_loss(J, left, spread) + 0.5 * away))]
    begun = (replace(one, start=float(at)) for one, at in zip(parameters[:2], best, strict=True))
    return Choice((*begun, *parameters[2:]), 0.0)


@touches("external", "air", "air_factors", "gust_std")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Add the wind's load, less that of still air, which is there already; every row may have a wind of its own."""
    measurements = force_model.measurements
    if measurements.profile.wind is None:
        return force_model
    p = np.asarray(p, dtype=np.float64)
    air, factors = p[..., :2], p[..., 2:] if p.shape[-1] > 2 else np.ones(3)
    external = mean_load(measurements, air, force_model.gust_std) - measurements.air_load
    external *= factors
    external += force_model.external
    return force_model.replaced(external=external, air=air, air_factors=factors)


def unreported(measurements: Measurements, p: Floats) -> frozenset[str]:
    """Return what is fitted so that the rest comes out right, and is of no interest itself."""
    return frozenset(COEFFICIENTS)


def mean_load(measurements: Measurements, air: Floats, gust_std: float) -> Floats:
    """Return what a wind, shape (2,) or (n, 2), loads the vessel with on average [N, N, N·m], shape (n, 3).

    A load that goes with the square of the speed is larger in gusts: the mean over a normal distribution, by Gauss's and
    Hermite's rule of three points along north and east each. The loads used last are kept: most steps of a fit move other
    effects, and fits of one search begin alike.
    """
    key = (air.tobytes(), gust_std)
    loads = measurements.wind_loads
    known = loads.pop(key, None)
    if known is None:
        known = _mean_load(measurements, air, gust_std)
        # A list at once: threads share the loads.
        for oldest in list(loads)[: 1 - KEPT]:
            loads.pop(oldest, None)
    loads[key] = known
    return known


def _mean_load(measurements: Measurements, air: Floats, gust_std: float) -> Floats:
    away, weights = np.zeros((1, 2)), np.ones(1)
    if gust_std != 0.0:
        away, weights = sqrt(3.0) * gust_std * MEAN_GUSTS, MEAN_WEIGHTS
    if air.ndim > 1:
        return wind_load_by_row(measurements, air, away, weights)
    return wind_load(measurements, air + away, weights)


def cannot(measurements: Measurements) -> str:
    """Say why the measurements cannot show a wind."""
    if measurements.wind is not None:
        return "the wind was measured and is part of the model"
    return "the profile has no wind areas" if measurements.profile.wind is None else ""


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence: where it blows from, as in weather reports, and where to, as in results."""
    north, east = values["north"], values["east"]
    towards = degrees(atan2(east, north)) % 360.0
    return f"A steady wind of {hypot(north, east):.1f} m/s from {bearing(towards + 180.0)} blew towards {bearing(towards)}."


def scenario(values: Values, instance: str | None) -> dict[str, Any]:
    """Return the scenario's wind."""
    return {"environment": {"wind": {"north_mps": values["north"], "east_mps": values["east"], **span(values)}}}


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the heading: what is constant over ground turns with it."""
    return "heading [deg]", np.asarray(np.degrees(force_model.measurements.psi) % 360.0)


EFFECT = Effect(
    "wind",
    "Steady wind",
    parameters_of,
    apply,
    says,
    scenario,
    cannot=cannot,
    choose=choose,
    onset=True,
    unreported=unreported,
    regressor=regressor,
    formula_error=EFFECTS.load_error,
    of_log=("north", "east"),
    turbulence=Turbulence(EFFECTS.wind_turbulence, EFFECTS.least_wind_std, EFFECTS.wind_length),
    absent_in=("tank",),
    common_in=("pond", "harbour", "sea"),
    by_row=True,
    acts_last=True,
)
