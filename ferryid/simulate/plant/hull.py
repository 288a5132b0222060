"""The bare hull in three degrees of freedom: mass, Coriolis terms and damping, as plain numbers for compiled code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

from ferryid.compiled import borrowing
from ferryid.simulate.sections import Fouling
from ferryid.vessel.profile import Hull

Force: TypeAlias = tuple[float, float, float]
"""Surge, sway force [N] and yaw moment about the body origin [N·m], FRD."""

State: TypeAlias = tuple[float, float, float, float, float, float]
"""North, east [m], heading [rad, not wrapped], surge, sway [m/s], yaw rate [rad/s]; all over ground."""

Hydrodynamics: TypeAlias = tuple[float, ...]
"""M (5) in the order of `MASS`, then the 21 damping coefficients in the order of `DAMPING`."""

MASS = ("m11", "m22", "m23", "m32", "m33")
MASS_PLACES = ((0, 0), (1, 1), (1, 2), (2, 1), (2, 2))

DAMPING = (
    *("X_u", "X_|u|u", "X_uuu", "Y_v", "Y_|v|v", "Y_|r|v", "Y_vvv", "Y_r", "Y_|v|r", "Y_|r|r"),
    *("N_v", "N_|v|v", "N_|r|v", "N_r", "N_|v|r", "N_|r|r", "N_rrr"),
    *("Y_uv", "Y_ur", "N_uv", "N_ur"),
)


def hydrodynamics(hull: Hull, delta: float = 1.0, sigma: float = 1.0) -> Hydrodynamics:
    """Return the hull's coefficients as one flat tuple, with M and C scaled by `delta` and D by `sigma`.

    References
    ----------
    Aurlien (2021), (4.2)-(4.4).
    """
    mass = tuple(delta * float(hull.M[place]) for place in MASS_PLACES)
    return (*mass, *(sigma * float(hull.D.get(name, 0.0)) for name in DAMPING))


def perturbed(hull: Hull, factors: Mapping[str, float]) -> Hull:
    """Return the hull with coefficients multiplied by `factors`, by their names in `MASS` and `DAMPING`."""
    M = hull.M.copy()
    for name, place in zip(MASS, MASS_PLACES, strict=True):
        M[place] *= factors.get(name, 1.0)
    return replace(hull, M=M, D={name: value * factors.get(name, 1.0) for name, value in hull.D.items()})


def fouled(hull: Hull, fouling: Fouling) -> Hull:
    """Return the hull with its damping of second order multiplied: ``X_|u|u``, ``Y_|v|r``, ``N_|r|r`` and the like."""
    factors = {"X": fouling.surge, "Y": fouling.sway, "N": fouling.yaw}
    return replace(hull, D={name: value * (factors[name[0]] if "|" in name else 1.0) for name, value in hull.D.items()})


@borrowing
def coriolis_load(m11: float, m22: float, m23: float, u: float, v: float, r: float) -> Force:
    """Return C(nu) nu [N, N, N·m]; `m23` is the mean of m23 and m32.

    References
    ----------
    Aurlien (2021), (2.8)-(2.11), with the sign of (2.8) restored.
    """
    c13 = -m22 * v - m23 * r
    c23 = m11 * u
    return c13 * r, c23 * r, -c13 * u - c23 * v


@borrowing
def damping_load(p: Hydrodynamics, u: float, v: float, r: float) -> Force:
    """Return D(nu) nu [N, N, N·m] for velocities through the water [m/s, m/s, rad/s]; (2.12)-(2.14), and lift."""
    au, av, ar = abs(u), abs(v), abs(r)
    X = -(p[5] + p[6] * au + p[7] * u * u) * u
    Y = -(p[8] + p[9] * av + p[10] * ar + p[11] * v * v) * v - (p[12] + p[13] * av + p[14] * ar) * r
    N = -(p[15] + p[16] * av + p[17] * ar) * v - (p[18] + p[19] * av + p[20] * ar + p[21] * r * r) * r
    return X, Y - (p[22] * v + p[23] * r) * u, N - (p[24] * v + p[25] * r) * u


@borrowing
def hull_load(p: Hydrodynamics, u: float, v: float, r: float) -> Force:
    """Return C(nu) nu + D(nu) nu [N, N, N·m] for velocities through the water [m/s, m/s, rad/s]."""
    C = coriolis_load(p[0], p[1], 0.5 * (p[2] + p[3]), u, v, r)
    D = damping_load(p, u, v, r)
    return C[0] + D[0], C[1] + D[1], C[2] + D[2]


@borrowing
def required_force(p: Hydrodynamics, u_dot: float, v_dot: float, r_dot: float, u: float, v: float, r: float) -> Force:
    """Return M nu_dot + C nu + D nu [N, N, N·m]: what a motion through still water takes, (2.3)."""
    X, Y, N = hull_load(p, u, v, r)
    return X + p[0] * u_dot, Y + p[1] * v_dot + p[2] * r_dot, N + p[3] * v_dot + p[4] * r_dot
