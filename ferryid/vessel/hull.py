"""The hull's equations of motion in three degrees of freedom, (2.3)-(2.14) in their corrected form."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ferryid.types import Floats
from ferryid.vessel.frames import to_body
from ferryid.vessel.parse_hull import rigid_mass
from ferryid.vessel.profile import Hull


def current_in_body(current_ne: Floats, psi: Floats) -> Floats:
    """Return ``nu_c = R^T [V_N, V_E, 0]``, shape (n, 3), of a current [m/s, where the water goes to], shape (n, 2)."""
    current_ne = np.asarray(current_ne, dtype=np.float64)
    surge, sway = to_body(current_ne[..., 0], current_ne[..., 1], np.asarray(psi, dtype=np.float64))
    return np.stack([surge, sway, np.zeros_like(surge)], axis=-1)


def inverse_dynamics(hull: Hull, nu_dot: Floats, nu: Floats, nu_c: Floats | None = None) -> Floats:
    """Return the force that the motion takes, ``M nu_dot + C nu + D nu``, shape (n, 3) [N, N, N·m].

    With a current, added mass and damping act on the velocity through the water ``nu_r = nu - nu_c`` and the rigid
    body on `nu`; an irrotational, steady current turns with the body: ``nu_c_dot = [r v_c, -r u_c, 0]``. This is
    exact where (2.19)-(2.20) is an approximation.

    Parameters
    ----------
    hull
        Hull.
    nu_dot
        Accelerations [m/s², m/s², rad/s²], shape (n, 3).
    nu
        Velocities over ground, shape (n, 3).
    nu_c
        Current in the body frame (see `current_in_body`), shape (n, 3), or None in still water.
    """
    nu_dot = np.asarray(nu_dot, dtype=np.float64)
    nu = np.asarray(nu, dtype=np.float64)
    if nu_c is None:
        return nu_dot @ hull.M.T + _coriolis_force(hull.M, nu) + _damping_force(hull.D, nu)
    rigid = rigid_mass(hull.mass_kg, hull.x_g_m, hull.inertia_z)
    added = hull.M - rigid
    nu_c = np.asarray(nu_c, dtype=np.float64)
    nu_r = nu - nu_c
    nu_r_dot = nu_dot - _current_rate(nu, nu_c)
    return (
        nu_dot @ rigid.T
        + _coriolis_force(rigid, nu)
        + nu_r_dot @ added.T
        + _coriolis_force(added, nu_r)
        + _damping_force(hull.D, nu_r)
    )


def payload_mass(payload: Floats) -> Floats:
    """Return what a payload adds to the mass matrix, ``[[m, 0, 0], [0, m, m x], [0, m x, m x²]]``, shape (..., 3, 3).

    Rigid-body mass on the centre line, (2.5) with its own moment of inertia left out.

    Parameters
    ----------
    payload
        Mass [kg], and how far forward of the body origin it stands [m], shape (..., 2).
    """
    payload = np.asarray(payload, dtype=np.float64)
    m, x = payload[..., 0], payload[..., 1]
    matrix = np.zeros((*m.shape, 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = m
    matrix[..., 1, 2] = matrix[..., 2, 1] = m * x
    matrix[..., 2, 2] = m * x**2
    return matrix


def payload_force(payload: Floats, nu_dot: Floats, nu: Floats) -> Floats:
    """Return the force that it takes to move a payload along, ``dM nu_dot + dC(nu) nu``, shape (n, 3) [N, N, N·m].

    As a rigid body it acts on the velocity over ground, whatever the current. Its mass times the acceleration of the point
    where it stands, ``a = [u_dot - v r - x r², v_dot + x r_dot + u r]``.

    Parameters
    ----------
    payload
        See `payload_mass`, shape (n, 2).
    nu_dot, nu
        Acceleration and velocity over ground, shape (n, 3).
    """
    m, x = payload[..., 0], payload[..., 1]
    u, v, r = nu[..., 0], nu[..., 1], nu[..., 2]
    surge = m * (nu_dot[..., 0] - v * r - x * r**2)
    sway = m * (nu_dot[..., 1] + x * nu_dot[..., 2] + u * r)
    return np.stack([surge, sway, x * sway], axis=-1)


def _current_rate(nu: Floats, nu_c: Floats) -> Floats:
    r = nu[..., 2]
    return np.stack([r * nu_c[..., 1], -r * nu_c[..., 0], np.zeros_like(r)], axis=-1)


def _coriolis_force(M: Floats, nu: Floats) -> Floats:
    u, v, r = nu[..., 0], nu[..., 1], nu[..., 2]
    c13 = -M[1, 1] * v - (0.5 * (M[1, 2] + M[2, 1])) * r
    c23 = M[0, 0] * u
    return _joined(c13 * r, c23 * r, -c13 * u - c23 * v)


def _joined(surge: Floats, sway: Floats, yaw: Floats) -> Floats:
    """Return components, shape (...), as vectors, shape (..., 3).

    In a third of the time that `np.stack` takes: free runs ask for it thousands of times.
    """
    out = np.empty((*surge.shape, 3))
    out[..., 0], out[..., 1], out[..., 2] = surge, sway, yaw
    return out


def _damping_force(D: Mapping[str, float], nu_r: Floats) -> Floats:
    if not D:
        return np.zeros_like(nu_r)
    u, v, r = nu_r[..., 0], nu_r[..., 1], nu_r[..., 2]
    size_v, size_r = np.abs(v), np.abs(r)

    def less(first: str, *others: tuple[str, Floats]) -> Floats | float:
        # Most hulls have few of the terms, and this is called in every step of a free run.
        total: Floats | float = -D.get(first, 0.0)
        for term, values in others:
            if coefficient := D.get(term, 0.0):
                total = total - coefficient * values
        return total

    surge = less("X_u", ("X_|u|u", np.abs(u)), ("X_uuu", u**2)) * u
    sway = (
        less("Y_v", ("Y_|v|v", size_v), ("Y_|r|v", size_r), ("Y_vvv", v**2)) * v
        + less("Y_r", ("Y_|v|r", size_v), ("Y_|r|r", size_r)) * r
    )
    yaw = (
        less("N_v", ("N_|v|v", size_v), ("N_|r|v", size_r)) * v
        + less("N_r", ("N_|v|r", size_v), ("N_|r|r", size_r), ("N_rrr", r**2)) * r
    )
    lift = [D.get(term, 0.0) for term in ("Y_uv", "Y_ur", "N_uv", "N_ur")]
    if any(lift):
        sway = sway - (lift[0] * v + lift[1] * r) * u
        yaw = yaw - (lift[2] * v + lift[3] * r) * u
    return _joined(surge, sway, yaw)
