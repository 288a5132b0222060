"""Forces of the water on the hull in six degrees of freedom: sections in cross flow, friction, lift and added mass.

Cross flow by strips after Faltinsen (1990), section 6.4; friction by the ITTC-1957 line; lift of a wing of low aspect ratio
after Newman (1977), section 7; inertia by Kirchhoff's equations, as in Sagatun and Fossen (1991).
"""

from __future__ import annotations

from math import log10
from typing import NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.vessels import GRAVITY, RHO, Vessel

STRIPS = 23
VISCOSITY = 1.19e-6
"""Kinematic, of sea water at 15 degrees [m²/s]."""


class HullConstants(NamedTuple):
    """A hull, ready for compiled code: matrices (6, 6), factors on quadratic drag (3,), strips' places and drag widths (s,),
    single numbers."""

    rigid: Floats
    added: Floats
    linear: Floats
    roughness: Floats
    x: Floats
    width: Floats
    length: float
    draught: float
    wetted: float
    viscous: float
    residual: float
    lift: float
    lift_x: float
    mass: float
    waterplane: float
    gm_t: float
    gm_l: float


def hull_constants(vessel: Vessel) -> HullConstants:
    """Return a vessel's hull, ready for compiled code."""
    x = (np.arange(STRIPS) + 0.5) / STRIPS * vessel.length - 0.5 * vessel.length
    drag = np.interp(x, [-0.5 * vessel.length, 0.0, 0.5 * vessel.length], vessel.cross_drag)
    return HullConstants(
        rigid=rigid_mass(vessel.mass, vessel.x_g, vessel.z_g, inertia(vessel)),
        added=added_mass(vessel),
        linear=np.array(vessel.linear),
        roughness=np.ones(3),
        x=x,
        width=drag * vessel.length / STRIPS,
        length=vessel.length,
        draught=vessel.draught,
        wetted=vessel.wetted_m2,
        viscous=1.0 + vessel.form,
        residual=vessel.residual,
        lift=0.5 * np.pi * RHO * vessel.draught**2,
        lift_x=vessel.lift_x * vessel.length,
        mass=vessel.mass,
        waterplane=vessel.waterplane_m2,
        gm_t=vessel.gm_t,
        gm_l=vessel.gm_l,
    )


def inertia(vessel: Vessel) -> Floats:
    """Return the matrix of inertia about the centre of gravity, shape (3, 3) [kg·m²]."""
    return vessel.mass * np.diag([vessel.k_xx**2, vessel.k_yy**2, vessel.k_zz**2])


def rigid_mass(mass: float, x: float, z: float, inertia: Floats) -> Floats:
    """Return the mass matrix of a rigid body about the origin, shape (6, 6); centre at ``x, 0, z`` [m]."""
    S = np.array([[0.0, -z, 0.0], [z, 0.0, -x], [0.0, x, 0.0]])
    M = np.zeros((6, 6))
    M[:3, :3] = mass * np.eye(3)
    M[:3, 3:] = -mass * S
    M[3:, :3] = mass * S
    M[3:, 3:] = inertia - mass * S @ S
    return M


def added_mass(vessel: Vessel) -> Floats:
    """Return the added mass, shape (6, 6)."""
    A = np.zeros((6, 6))
    for pair, value in vessel.added.items():
        i, j = int(pair[0]) - 1, int(pair[1]) - 1
        A[i, j] = A[j, i] = value
    return A


@compiled
def coriolis(M: Floats, nu: Floats, out: Floats) -> None:
    """Add ``-C(nu) nu`` of a mass matrix, by Kirchhoff's equations."""
    P = M @ nu
    # -omega x P1, and -(v x P1 + omega x P2).
    out[0] -= nu[4] * P[2] - nu[5] * P[1]
    out[1] -= nu[5] * P[0] - nu[3] * P[2]
    out[2] -= nu[3] * P[1] - nu[4] * P[0]
    out[3] -= nu[1] * P[2] - nu[2] * P[1] + nu[4] * P[5] - nu[5] * P[4]
    out[4] -= nu[2] * P[0] - nu[0] * P[2] + nu[5] * P[3] - nu[3] * P[5]
    out[5] -= nu[0] * P[1] - nu[1] * P[0] + nu[3] * P[4] - nu[4] * P[3]


@compiled
def drag(hull: HullConstants, nu: Floats, sunk: float, shallow: float, out: Floats) -> None:
    """Add what friction, cross flow and lift do [N, N·m].

    Parameters
    ----------
    hull
        From `hull_constants`.
    nu
        Velocity through the water, shape (6,).
    sunk
        By how much the vessel lies deeper than its draught [m].
    shallow
        Factor on all of it.
    out
        Shape (6,).
    """
    deeper = 1.0 + sunk / hull.draught
    u, v, p, r = nu[0], nu[1], nu[3], nu[5]
    z = 0.5 * (hull.draught + sunk)
    reynolds = max(abs(u) * hull.length / VISCOSITY, 1e5)
    friction = 0.075 / (log10(reynolds) - 2.0) ** 2
    wetted = hull.wetted * (1.0 + 0.5 * (deeper - 1.0))
    surge = -0.5 * RHO * wetted * (hull.viscous * friction + hull.residual) * abs(u) * u * hull.roughness[0]
    sway = yaw = roll = 0.0
    for i in range(len(hull.x)):
        across = v + hull.x[i] * r - z * p
        force = -0.5 * RHO * hull.width[i] * hull.draught * deeper * abs(across) * across
        sway += force
        yaw += hull.x[i] * force
        roll -= z * force
    sway *= hull.roughness[1]
    yaw *= hull.roughness[2]
    lift = -hull.lift * deeper * deeper * u * v
    sway += lift
    yaw += hull.lift_x * lift
    roll -= z * lift
    out[0] += shallow * (surge - hull.linear[0] * u)
    out[1] += shallow * (sway - hull.linear[1] * v)
    out[2] -= hull.linear[2] * nu[2]
    out[3] += roll - hull.linear[3] * p
    out[4] += z * surge - hull.linear[4] * nu[4]
    out[5] += shallow * (yaw - hull.linear[5] * r)


@compiled
def restoring(hull: HullConstants, down: float, roll: float, pitch: float, out: Floats) -> None:
    """Add what floats the vessel upright [N, N·m]."""
    out[2] -= RHO * GRAVITY * hull.waterplane * down
    out[3] -= hull.mass * GRAVITY * hull.gm_t * np.sin(roll)
    out[4] -= hull.mass * GRAVITY * hull.gm_l * np.sin(pitch)
