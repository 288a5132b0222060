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
    wind_ne = np.asarray(wind_ne, dtype=np.float64)
    nu = np.asarray(nu, dtype=np.float64)
    u_w, v_w = to_body(wind_ne[..., 0], wind_ne[..., 1], np.asarray(psi, dtype=np.float64))
    u_rw, v_rw = nu[..., 0] - u_w, nu[..., 1] - v_w
    pressure = 0.5 * air_density * (u_rw**2 + v_rw**2)
    c_x, c_y, c_n = wind_coefficients(areas, -np.arctan2(v_rw, u_rw))
    return np.stack(
        [
            pressure * c_x * areas.frontal_m2,
            pressure * c_y * areas.lateral_m2,
            pressure * c_n * areas.lateral_m2 * areas.length_m,
        ],
        axis=-1,
    )


def wind_coefficients(areas: WindAreas, gamma: Floats) -> tuple[Floats, Floats, Floats]:
    """Return ``C_X, C_Y, C_N`` of the angle of attack `gamma` [rad], 0 from ahead, negative from starboard."""
    gamma = np.asarray(gamma, dtype=np.float64)
    cd_l = areas.CD_l_AF * areas.frontal_m2 / areas.lateral_m2
    denominator = 1.0 - 0.5 * areas.delta * (1.0 - cd_l / areas.CD_t) * np.sin(2.0 * gamma) ** 2
    c_x = -areas.CD_l_AF * np.cos(gamma) / denominator
    c_y = areas.CD_t * np.sin(gamma) / denominator
    c_n = (areas.S_L_m / areas.length_m - 0.18 * (np.abs(gamma) - 0.5 * math.pi)) * c_y
    return c_x, c_y, c_n
