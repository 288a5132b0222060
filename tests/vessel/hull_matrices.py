"""The hull's equations of motion in matrices, against which the forces in ferryid are tested."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ferryid.types import Floats
from ferryid.vessel.hull import inverse_dynamics
from ferryid.vessel.profile import Hull


def coriolis(M: Floats, nu: Floats) -> Floats:
    """Return the Coriolis and centripetal matrix of a mass matrix, shape (..., 3, 3); Fossen (2021), theorem 3.2.

    ``[[0, 0, c13], [0, 0, c23], [-c13, -c23, 0]]`` with ``c13 = -m22 v - (m23 + m32)/2 r`` and ``c23 = m11 u``.

    Parameters
    ----------
    M
        Mass matrix, shape (3, 3).
    nu
        Surge, sway [m/s] and yaw rate [rad/s], shape (..., 3).
    """
    nu = np.asarray(nu, dtype=np.float64)
    c13 = -M[1, 1] * nu[..., 1] - 0.5 * (M[1, 2] + M[2, 1]) * nu[..., 2]
    c23 = M[0, 0] * nu[..., 0]
    matrix = np.zeros((*nu.shape[:-1], 3, 3))
    matrix[..., 0, 2], matrix[..., 1, 2] = c13, c23
    matrix[..., 2, 0], matrix[..., 2, 1] = -c13, -c23
    return matrix


def damping(D: Mapping[str, float], nu_r: Floats) -> Floats:
    """Return the damping matrix, shape (..., 3, 3); (2.14), with Y_vvv in d22 where it belongs, and lift.

    Parameters
    ----------
    D
        SNAME coefficients, negative where they damp; absent ones are zero.
    nu_r
        Velocities through the water, shape (..., 3).
    """
    nu_r = np.asarray(nu_r, dtype=np.float64)
    u, v, r = nu_r[..., 0], nu_r[..., 1], nu_r[..., 2]
    size_u, size_v, size_r = np.abs(u), np.abs(v), np.abs(r)

    def get(name: str) -> float:
        return D.get(name, 0.0)

    matrix = np.zeros((*nu_r.shape[:-1], 3, 3))
    matrix[..., 0, 0] = -get("X_u") - get("X_|u|u") * size_u - get("X_uuu") * u**2
    matrix[..., 1, 1] = -get("Y_v") - get("Y_|v|v") * size_v - get("Y_|r|v") * size_r - get("Y_vvv") * v**2
    matrix[..., 1, 2] = -get("Y_r") - get("Y_|v|r") * size_v - get("Y_|r|r") * size_r
    matrix[..., 2, 1] = -get("N_v") - get("N_|v|v") * size_v - get("N_|r|v") * size_r
    matrix[..., 2, 2] = -get("N_r") - get("N_|v|r") * size_v - get("N_|r|r") * size_r - get("N_rrr") * r**2
    matrix[..., 1:, 1] -= np.stack([get("Y_uv") * u, get("N_uv") * u], axis=-1)
    matrix[..., 1:, 2] -= np.stack([get("Y_ur") * u, get("N_ur") * u], axis=-1)
    return matrix


def forward(hull: Hull, nu: Floats, tau: Floats, nu_c: Floats | None = None) -> Floats:
    """Return the acceleration `nu_dot` under a force, shape (n, 3): the inverse of `inverse_dynamics`.

    Parameters
    ----------
    hull
        Hull.
    nu
        Velocities over ground, shape (n, 3).
    tau
        All forces on the hull besides its own [N, N, N·m], shape (n, 3).
    nu_c
        Current in the body frame, shape (n, 3), or None.
    """
    nu = np.asarray(nu, dtype=np.float64)
    still = inverse_dynamics(hull, np.zeros_like(nu), nu, nu_c)
    # M_RB nu_dot + M_A (nu_dot - nu_c_dot) + ... = tau, so the whole mass acts on nu_dot.
    rest = (np.asarray(tau, dtype=np.float64) - still).reshape(-1, 3)
    return np.asarray(np.linalg.solve(hull.M, rest.T), dtype=np.float64).T.reshape(nu.shape)
