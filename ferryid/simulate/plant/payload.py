"""Payload: rigid mass that comes aboard at a place, and what that does to the hull's mass and motion."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.simulate.plant.hull import Hydrodynamics
from ferryid.simulate.sections import Payload

Masses = tuple[float, float, float, float, float]
"""m11, m22, m23, m32, m33; everything else of a mass matrix is zero."""


def loaded(hull: Hydrodynamics | Masses, aboard: Sequence[Payload], zeta: float = 1.0) -> Masses:
    """Return the mass matrix with payload aboard, ``[[m, 0, 0], [0, m, m x], [0, m x, m x²]]`` each, on the centre line.

    `zeta` divides each payload's mass, as it has divided the hull's.
    """
    m11, m22, m23, m32, m33 = hull[:5]
    for payload in aboard:
        m, x = payload.mass_kg / zeta, payload.x_m
        m11, m22, m23, m32, m33 = m11 + m, m22 + m, m23 + m * x, m32 + m * x, m33 + m * x * x
    return m11, m22, m23, m32, m33


def inverse(M: Masses) -> Masses:
    """Return the inverse of a mass matrix, by cofactors."""
    det = M[1] * M[4] - M[2] * M[3]
    return 1.0 / M[0], M[4] / det, -M[2] / det, -M[3] / det, M[1] / det


def boarding(kept: Masses, new: Masses) -> Masses:
    """Return the matrix that turns velocities before a boarding into those after it: ``M_new nu_after = M_kept nu_before``.

    Who comes aboard stood still over ground before, so momentum is conserved; who leaves takes theirs along.
    """
    inv = inverse(new)
    return (
        inv[0] * kept[0],
        inv[1] * kept[1] + inv[2] * kept[3],
        inv[1] * kept[2] + inv[2] * kept[4],
        inv[3] * kept[1] + inv[4] * kept[3],
        inv[3] * kept[2] + inv[4] * kept[4],
    )


def together(aboard: Sequence[Payload]) -> tuple[float, float]:
    """Return the mass of all payload [kg] and where its centre lies forward of the body origin [m]."""
    mass = sum(payload.mass_kg for payload in aboard)
    moment = sum(payload.mass_kg * payload.x_m for payload in aboard)
    return mass, moment / mass if mass > 0.0 else 0.0
