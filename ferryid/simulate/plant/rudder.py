"""Rudder behind a propeller: the MMG standard method, as in `ferryid.vessel.rudder`, for compiled code."""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt

from ferryid.compiled import borrowing
from ferryid.simulate.plant.hull import Force
from ferryid.types import Floats
from ferryid.vessel.profile import Actuator
from ferryid.vessel.thrusters import FRESH_WATER

NAMES = (
    "area_m2",
    "f_alpha",
    "x_m",
    "a_H",
    "x_H_m",
    "t_R",
    "epsilon",
    "kappa",
    "eta",
    "gamma_R",
    "gamma_R_minus",
    "l_R_m",
)
COLUMNS = len(NAMES) + 2


def rudder_row(actuator: Actuator) -> tuple[float, ...]:
    """Return the rudder's numbers in the order of `NAMES`, then propeller diameter [m] and water density [kg/m³]."""
    inflow = actuator.inflow
    numbers = [float(actuator.rudder[name]) for name in NAMES]
    return (*numbers, float(inflow["diameter_m"]), float(inflow.get("water_density", FRESH_WATER)))


@borrowing
def rudder_load(row: Floats, delta: float, thrust: float, u_p: float, v: float, r: float) -> Force:
    """Return the force of a rudder on the hull [N, N, N·m].

    Parameters
    ----------
    row
        From `rudder_row`.
    delta
        Rudder angle, positive turns the vessel to starboard going ahead [rad].
    thrust
        Thrust of the propeller before deduction [N].
    u_p
        Speed of the water into the propeller [m/s].
    v, r
        Sway through the water [m/s] and yaw rate [rad/s].

    References
    ----------
    Yasukawa & Yoshimura (2015), J. Mar. Sci. Technol. 20, 37-52.
    """
    area, f_alpha, x_R, a_H, x_H, t_R = row[0], row[1], row[2], row[3], row[4], row[5]
    epsilon, kappa, eta, D, density = row[6], row[7], row[8], row[12], row[13]
    push = max(thrust, 0.0) * 8.0 / (density * pi * D * D)
    behind = u_p + kappa * (sqrt(u_p * u_p + push) - abs(u_p))
    mean_square = eta * behind * abs(behind) + (1.0 - eta) * u_p * abs(u_p)
    u_R = epsilon * sqrt(abs(mean_square))
    if mean_square < 0.0:
        u_R = -u_R
    across = -(v + row[11] * r)
    v_R = (row[9] if across >= 0.0 else row[10]) * across
    normal = 0.5 * density * area * f_alpha * (u_R * u_R + v_R * v_R) * sin(delta - atan2(v_R, u_R))
    lift = normal * cos(delta)
    return -(1.0 - t_R) * normal * sin(delta), -(1.0 + a_H) * lift, -(x_R + a_H * x_H) * lift
