"""Feedforward: the force that a model holds the desired motion to take, under measured wind, current and payload."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, isnan, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.errors import FerryIdError
from ferryid.models.forces import Estimator, acting_estimator, scale_hull
from ferryid.models.store import load_file
from ferryid.regression.bases import DIMENSIONS, LEAST_SPEED_MPS
from ferryid.simulate.plant.hull import Hydrodynamics, hydrodynamics, required_force
from ferryid.simulate.plant.wind import Areas, areas_of, wind_load
from ferryid.types import Floats, Ints
from ferryid.vessel.parse_hull import rigid_mass
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.models import Model
    from ferryid.simulate.scenario import Scenario

Pair = tuple[float, float]
Triple = tuple[float, float, float]

FACTORS = (*DIMENSIONS, "1")
"""What terms are products of, in the order of `_factors`; terms of fewer than `MOST` factors are filled up with ones."""
MOST = 3


class Feedforward(NamedTuple):
    """``F_P = F_0 + theta' phi + intercept``, (3.3), as numbers.

    Attributes
    ----------
    rigid, water
        Rigid body of the hull, which moves over ground, and its added mass and damping, which move through the water.
    areas
        Wind areas of the model's vessel; all zero where it leaves the wind to theta.
    weather, flow, load
        Whether measured wind, current and payload are used.
    zeta
        Factor on the measured force, (4.5).
    factors
        Places in `FACTORS` of the factors of each of K terms, shape (K, 3).
    theta
        Coefficients, shape (K, 3).
    intercept
        [N, N, N·m].
    half
        Half the hull's length [m], 0 where no term is an integral along it.
    """

    rigid: Hydrodynamics
    water: Hydrodynamics
    areas: Areas
    weather: bool
    flow: bool
    load: bool
    zeta: float
    factors: Ints
    theta: Floats
    intercept: Triple
    half: float


def build_feedforward(scenario: Scenario, profile: Profile, model: Model | None) -> Feedforward:
    """Return the feedforward of ``[controller]``.

    Without a model it is the profile's hull scaled by delta and sigma, which knows no wind, current or payload; (2.23).

    Parameters
    ----------
    scenario, profile
        The trial and its vessel.
    model
        Takes the place of the model file that the scenario names.

    Raises
    ------
    FerryIdError
        When the model cannot be read, is of another vessel, or needs wind or current that the scenario does
        not measure.
    """
    control, sensors = scenario.controller, scenario.sensors
    if model is None and control.model:
        model = load_file(scenario.file(control.model))
    if model is None:
        return feedforward_of(Estimator(profile, {"delta": control.delta, "sigma": control.sigma}))
    estimated = acting_estimator(model)
    if estimated.profile.name != profile.name:
        raise FerryIdError(
            f"{scenario.where}: the controller's model {model.name}@{model.version} belongs to {estimated.profile.name}, found "
            f"the vessel {profile.name}. Fix: fit a model of this vessel, or simulate the other"
        )
    for needed, rate_hz, what in (
        (estimated.basis is not None and estimated.basis.needs_wind, sensors.wind_rate_hz, "wind"),
        (estimated.basis is not None and estimated.basis.needs_current, sensors.current_rate_hz, "current"),
    ):
        if needed and rate_hz == 0.0:
            raise FerryIdError(
                f"{scenario.where}: the controller's model {model.name}@{model.version} needs measured {what}, found "
                f"{what}_rate_hz = 0. Fix: set {what}_rate_hz in [sensors], or use a model of a basis without {what}"
            )
    return feedforward_of(
        estimated,
        weather=sensors.wind_rate_hz > 0.0,
        flow=sensors.current_rate_hz > 0.0,
        load=sensors.payload_rate_hz > 0.0,
    )


def feedforward_of(
    estimated: Estimator, *, weather: bool = False, flow: bool = False, load: bool = False
) -> Feedforward:
    """Return a model as numbers; `weather`, `flow` and `load` say whether wind, current and payload are measured."""
    hull = scale_hull(estimated.profile.hull, estimated.scale)
    rigid = replace(hull, M=rigid_mass(hull.mass_kg, hull.x_g_m, hull.inertia_z), D={})
    functions = () if estimated.basis is None else estimated.basis.functions
    factors = [[FACTORS.index(name) for name in (*term.factors, "1", "1")[:MOST]] for term in functions]
    theta = np.zeros((0, 3)) if estimated.theta is None else estimated.theta
    intercept = np.zeros(3) if estimated.intercept is None else estimated.intercept
    return Feedforward(
        rigid=hydrodynamics(rigid),
        water=hydrodynamics(replace(hull, M=hull.M - rigid.M)),
        areas=areas_of(estimated.profile.wind),
        weather=weather,
        flow=flow,
        load=load,
        zeta=float(estimated.scale.get("zeta", 1.0)),
        factors=np.array(factors, dtype=np.int64).reshape(-1, MOST),
        theta=np.array(theta, dtype=np.float64),
        intercept=(float(intercept[0]), float(intercept[1]), float(intercept[2])),
        half=0.0 if estimated.basis is None or isnan(estimated.basis.length_m) else 0.5 * estimated.basis.length_m,
    )


@borrowing
def ahead_of(
    model: Feedforward, nu_dot: Triple, nu: Triple, psi: float, wind: Pair, current: Pair, payload: Pair
) -> Triple:
    """Return the force that a motion takes [N, N, N·m]; (4.6) with the desired motion.

    Measured wind and current are those over ground, so that the flow past the hull is the one of the desired motion: taken
    at the measured motion, the model's damping would become a feedback that takes damping away.

    Parameters
    ----------
    model
        From `feedforward_of`.
    nu_dot, nu
        Desired acceleration and velocity over ground, body frame.
    psi
        Measured heading [rad].
    wind, current
        Velocity of air and water over ground, north and east [m/s]; not looked at where the model does without.
    payload
        Mass [kg] and its place forward of the body origin [m].
    """
    u, v, r = nu
    c, s = cos(psi), sin(psi)
    u_c, v_c, u_w, v_w = 0.0, 0.0, 0.0, 0.0
    if model.flow:
        u_c, v_c = c * current[0] + s * current[1], c * current[1] - s * current[0]
    if model.weather:
        u_w, v_w = c * wind[0] + s * wind[1], c * wind[1] - s * wind[0]
    X, Y, N = required_force(model.rigid, nu_dot[0], nu_dot[1], nu_dot[2], u, v, r)
    # An irrotational current turns with the body: nu_c_dot = [r v_c, -r u_c, 0].
    W = required_force(model.water, nu_dot[0] - r * v_c, nu_dot[1] + r * u_c, nu_dot[2], u - u_c, v - v_c, r)
    X, Y, N = X + W[0], Y + W[1], N + W[2]
    if model.weather:
        A = wind_load(model.areas, u - u_w, v - v_w)
        X, Y, N = X - A[0], Y - A[1], N - A[2]
    if model.load:
        m, x = payload
        sway = m * (nu_dot[1] + x * nu_dot[2] + u * r)
        X, Y, N = X + m * (nu_dot[0] - v * r - x * r * r), Y + sway, N + x * sway
    X, Y, N = X / model.zeta, Y / model.zeta, N / model.zeta
    X, Y, N = X + model.intercept[0], Y + model.intercept[1], N + model.intercept[2]
    if len(model.theta) == 0:
        return X, Y, N
    values = _factors(nu_dot, nu, (u - u_w, v - v_w), (u - u_c, v - v_c), model.half)
    for k in range(len(model.theta)):
        term = values[model.factors[k, 0]] * values[model.factors[k, 1]] * values[model.factors[k, 2]]
        X += model.theta[k, 0] * term
        Y += model.theta[k, 1] * term
        N += model.theta[k, 2] * term
    return X, Y, N


@borrowing
def _factors(nu_dot: Triple, nu: Triple, air: Pair, water: Pair, half: float) -> tuple[float, ...]:
    """Return the values of `FACTORS`; `air` and `water` are the hull's velocity relative to them, along x and y [m/s]."""
    u, v, r = nu
    a, b = air
    c, d = water
    fore, aft = _half_hull(v, v + half * r, half), _half_hull(v, v - half * r, half)
    # V, V cos(gamma), V sin(gamma), 2 V cos(gamma), |V cos(gamma)|, |V sin(gamma)| with gamma = -atan2(v, u).
    return (
        *(nu_dot[0], nu_dot[1], nu_dot[2], u, v, r, abs(u), abs(v), abs(r)),
        *(sqrt(a * a + b * b), a, -b, 2.0 * a, abs(a), abs(b)),
        *(sqrt(c * c + d * d), c, -d, 2.0 * c, abs(c), abs(d)),
        *(-atan2(b, a), -atan2(d, c)),
        *(fore[0], aft[0], fore[1], -aft[1], 1.0),
    )


@borrowing
def _half_hull(v: float, end: float, half: float) -> Pair:
    """Return the two integrals of `ferryid.regression.bases.crossflow_integrals.half_hull` for one state."""
    a, b = abs(v), abs(end)
    both = a + b + LEAST_SPEED_MPS
    even = (v + end) / both * (v * v + a * b + end * end) / 3.0
    crossing = 0.5 * (a * b - v * end) / both
    odd = (b * end - a * v) / 6.0 - crossing * crossing * (end - v) / both / 3.0
    return half * even, 0.5 * half * half * (even + odd)
