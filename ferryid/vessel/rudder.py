"""Rudder behind a propeller: the MMG standard method (Yasukawa & Yoshimura 2015, J. Mar. Sci. Technol. 20, 37-52)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ferryid.types import Floats


def inflow_speed(u: Floats, wake_fraction: float) -> Floats:
    """Return the speed of the water into the propeller [m/s]; the hull's wake slows it only when going ahead."""
    return np.where(u > 0.0, 1.0 - wake_fraction, 1.0) * u


def rudder_force(
    rudder: Mapping[str, float],
    delta_rad: Floats,
    thrust_n: Floats,
    nu: Floats,
    *,
    diameter_m: float,
    wake_fraction: float,
    water_density: float,
) -> Floats:
    """Return the force of a rudder on the hull.

    The flow into the rudder follows momentum theory: ``8 K_T/(pi J²) = 8 T/(rho pi D² u_P²)``, so that a measured
    thrust serves as well as one from ``K_T(J)``, and the form stays finite at rest. Where the propeller does not
    push ahead there is no slipstream; where the flow comes from astern the normal force turns with it.

    Parameters
    ----------
    rudder
        ``area_m2, x_m, f_alpha, a_H, x_H_m, t_R, epsilon, kappa, eta, gamma_R, gamma_R_minus, l_R_m`` as named by
        MMG, lengths in metres from the body origin. `eta` is the propeller diameter over the rudder height,
        `gamma_R_minus` the flow straightening where the effective inflow angle beta_R is negative.
    delta_rad
        Rudder angle, positive turns the vessel to starboard going ahead [rad], shape (n,).
    thrust_n
        Thrust of the propeller before deduction [N], shape (n,).
    nu
        Velocities through the water, shape (n, 3) [m/s, m/s, rad/s].
    diameter_m, wake_fraction, water_density
        Of the propeller [m], [-] and [kg/m³].

    Returns
    -------
    tau
        ``[-(1 - t_R) F_N sin d, -(1 + a_H) F_N cos d, -(x_R + a_H x_H) F_N cos d]``, shape (n, 3) [N, N, N·m].
    """
    u_p = inflow_speed(nu[:, 0], wake_fraction)
    push = np.maximum(thrust_n, 0.0) * 8.0 / (water_density * math.pi * diameter_m**2)
    behind = u_p + rudder["kappa"] * (np.sqrt(u_p**2 + push) - np.abs(u_p))
    # Slipstream and free stream act on the shares eta and 1 - eta of the span (MMG eq. 25), each with its own sign.
    mean_square = rudder["eta"] * behind * np.abs(behind) + (1.0 - rudder["eta"]) * u_p * np.abs(u_p)
    u_r = rudder["epsilon"] * np.sign(mean_square) * np.sqrt(np.abs(mean_square))
    across = -(nu[:, 1] + rudder["l_R_m"] * nu[:, 2])
    v_r = np.where(across >= 0.0, rudder["gamma_R"], rudder["gamma_R_minus"]) * across
    attack = delta_rad - np.arctan2(v_r, u_r)
    normal = 0.5 * water_density * rudder["area_m2"] * rudder["f_alpha"] * (u_r**2 + v_r**2) * np.sin(attack)
    lift = normal * np.cos(delta_rad)
    return np.stack(
        [
            -(1.0 - rudder["t_R"]) * normal * np.sin(delta_rad),
            -(1.0 + rudder["a_H"]) * lift,
            -(rudder["x_m"] + rudder["a_H"] * rudder["x_H_m"]) * lift,
        ],
        axis=-1,
    )
