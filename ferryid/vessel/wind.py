"""Wind load on the parts above water, Blendermann's form: thesis (2.15)-(2.18), corrected."""

from __future__ import annotations

import math

import numpy as np

from ferryid.types import Floats
from ferryid.vessel.frames import to_body
from ferryid.vessel.profile import WindAreas

AIR_DENSITY = 1.225
"""Density of air [kg/m³]."""


def wind_force(
    areas: WindAreas, wind_ne: Floats, psi: Floats, nu: Floats, *, air_density: float = AIR_DENSITY
) -> Floats:
    """Return the wind load, shape (n, 3) [N, N, N·m].

    Parameters
    ----------
    areas
        Wind areas and coefficients.
    wind_ne
        True wind north and east, where the air goes to [m/s], shape (n, 2).
    psi
        Heading [rad], shape (n,).
    nu
        Velocities over ground, shape (n, 3).
    air_density
        [kg/m³].
    """
    nu = np.asarray(nu, dtype=np.float64)
    wind_ne = np.asarray(wind_ne, dtype=np.float64)
    u_w, v_w = to_body(wind_ne[..., 0], wind_ne[..., 1], np.asarray(psi, dtype=np.float64))
    return relative_wind_force(areas, nu[..., 0] - u_w, nu[..., 1] - v_w, air_density=air_density)


def relative_wind_force(areas: WindAreas, u_rw: Floats, v_rw: Floats, *, air_density: float = AIR_DENSITY) -> Floats:
    """Return the wind load, shape (n, 3) [N, N, N·m], at velocities relative to the air [m/s], shape (n,) each.

    With the angle of attack ``γ = -atan2(v_rw, u_rw)`` and ``d = 1 - δ/2 (1 - CD_l/CD_t) sin²2γ`` the coefficients are
    ``C_X = -CD_l,AF cos γ / d``, ``C_Y = CD_t sin γ / d`` and ``C_N = (S_L/L - 0.18 (|γ| - π/2)) C_Y``; sine and cosine are
    ratios of the velocities.
    """
    square = u_rw * u_rw + v_rw * v_rw
    speed = np.sqrt(square)
    cd_l = areas.CD_l_AF * areas.frontal_m2 / areas.lateral_m2
    sin_2gamma = 2.0 * u_rw * v_rw / np.maximum(square, np.finfo(np.float64).tiny)
    denominator = 1.0 - 0.5 * areas.delta * (1.0 - cd_l / areas.CD_t) * (sin_2gamma * sin_2gamma)
    pressure = -0.5 * air_density * speed / denominator
    load = np.empty((*np.shape(square), 3))
    load[..., 0] = areas.CD_l_AF * areas.frontal_m2 * pressure * u_rw
    load[..., 1] = areas.CD_t * areas.lateral_m2 * pressure * v_rw
    arm = areas.S_L_m + 0.18 * areas.length_m * (0.5 * math.pi - np.arctan2(np.abs(v_rw), u_rw))
    load[..., 2] = arm * load[..., 1]
    return load


def relative_wind_slope(areas: WindAreas, u_rw: Floats, v_rw: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the wind load of `relative_wind_force`, and its derivatives by the velocities relative to the air.

    Shapes (n, 3) each, the load in [N, N, N·m], its derivatives by `u_rw` and by `v_rw` [N·s/m, N·s/m, N·s]. In still air,
    where the load is of second order, they are zero.
    """
    square = np.maximum(u_rw * u_rw + v_rw * v_rw, np.finfo(np.float64).tiny)
    cd_l = areas.CD_l_AF * areas.frontal_m2 / areas.lateral_m2
    oblique = 0.5 * areas.delta * (1.0 - cd_l / areas.CD_t)
    u_share, v_share = u_rw / square, v_rw / square
    sin_2gamma = 2.0 * u_rw * v_share
    denominator = 1.0 - oblique * (sin_2gamma * sin_2gamma)
    pressure = -0.5 * AIR_DENSITY * np.sqrt(square) / denominator
    # Of the logarithm of the pressure: that of the speed, and that of the denominator, as the angle turns.
    turning = 4.0 * oblique * sin_2gamma * (v_rw * v_share - u_rw * u_share) / denominator
    by_u = pressure * (u_share + turning * v_share)
    by_v = pressure * (v_share - turning * u_share)
    ahead, aside = areas.CD_l_AF * areas.frontal_m2, areas.CD_t * areas.lateral_m2
    reach = 0.18 * areas.length_m
    arm = areas.S_L_m + reach * (0.5 * math.pi - np.arctan2(np.abs(v_rw), u_rw))
    load, slope_u, slope_v = (np.empty((*np.shape(square), 3)) for _ in range(3))
    load[..., 0], load[..., 1] = ahead * pressure * u_rw, aside * pressure * v_rw
    slope_u[..., 0], slope_u[..., 1] = ahead * (pressure + u_rw * by_u), aside * v_rw * by_u
    slope_v[..., 0], slope_v[..., 1] = ahead * u_rw * by_v, aside * (pressure + v_rw * by_v)
    load[..., 2] = arm * load[..., 1]
    slope_u[..., 2] = arm * slope_u[..., 1] + reach * np.abs(v_share) * load[..., 1]
    slope_v[..., 2] = arm * slope_v[..., 1] - reach * np.sign(v_rw) * u_share * load[..., 1]
    return load, slope_u, slope_v
