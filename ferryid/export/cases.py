"""States with the force and acceleration that ferryid gives for them, by which every exported copy checks itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ferryid.models.forces import Estimator
from ferryid.types import Floats

TOLERANCE = 1e-9
"""By how much a copy may be off, as a part of the largest value of the same kind."""
WORST_CONDITION = 1e6
"""Condition number, units apart, from which on a mass matrix is as good as singular."""
USUAL = {"u": 1.0, "v": 0.5, "r": 0.2, "u_dot": 0.1, "v_dot": 0.1, "r_dot": 0.05}
"""Reach of a state where the model does not tell its range."""


@dataclass(frozen=True)
class Case:
    """One state, and what ferryid makes of it.

    Attributes
    ----------
    nu_dot, nu, psi
        The motion, shapes (3,), (3,) and a number.
    wind, current, payload
        Shape (2,) each, or None where not given.
    tau
        The force that it takes [N, N, N·m], shape (3,).
    push
        Another force, shape (3,).
    rate
        The acceleration that this one gives, shape (3,); None where the mass matrix cannot be inverted.
    """

    nu_dot: Floats
    nu: Floats
    psi: float
    wind: Floats | None
    current: Floats | None
    payload: Floats | None
    tau: Floats
    push: Floats
    rate: Floats | None


def cases(force: Estimator, ranges: Mapping[str, tuple[float, float]]) -> tuple[Case, ...]:
    """Return the same states for the same model, from its ranges of validity: at rest, ahead, and everything at once."""
    functions, hull = force.basis, force.profile.hull
    air, water = np.array([5.0, -3.0]), np.array([0.3, -0.2])
    load = np.array([_short(0.1 * hull.mass_kg), _short(0.2 * hull.length_m) if math.isfinite(hull.length_m) else 1.0])
    still = np.zeros(2)
    calm = still if functions is not None and functions.needs_wind else None
    slack = still if functions is not None and functions.needs_current else None
    none, ahead = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
    return (
        _case(force, ranges, none, none, 0.0, calm, slack, None),
        _case(force, ranges, none, ahead, 0.0, calm, slack, None),
        _case(force, ranges, (0.4, -0.7, 0.6), (0.8, 0.5, -0.6), 0.5, calm, slack, None),
        _case(force, ranges, (-0.5, 0.3, -0.2), (-0.6, -0.9, 0.7), -2.2, air, slack, None),
        _case(force, ranges, (0.2, 0.6, 0.9), (0.7, -0.4, -0.8), 1.9, calm, water, None),
        _case(force, ranges, (-0.8, -0.2, 0.5), (0.5, 0.7, 0.9), 3.0, calm, slack, load),
        _case(force, ranges, (0.7, 0.8, -0.9), (-0.9, 0.8, 0.3), -0.9, -air, -2.0 * water, load),
    )


def effective_mass(force: Estimator, payload: Floats | None = None) -> Floats:
    """Return by how much the force grows with the acceleration [kg, kg·m, kg·m²], shape (3, 3)."""
    at_rest = np.zeros((4, 3))
    nu_dot = np.vstack([np.zeros(3), np.eye(3)])
    still = np.zeros((4, 2))
    aboard = None if payload is None else np.tile(payload, (4, 1))
    tau = force(nu_dot, at_rest, np.zeros(4), still, still, aboard)
    return np.asarray((tau[1:] - tau[0]).T)


def invertible(mass: Floats) -> bool:
    """Tell whether a mass matrix can be solved for an acceleration."""
    size = np.sqrt(np.abs(np.diag(mass)))
    if not np.isfinite(mass).all() or not size.all():
        return False
    return bool(np.linalg.cond(mass / np.outer(size, size)) < WORST_CONDITION)


def tolerances(several: tuple[Case, ...]) -> tuple[Floats, Floats]:
    """Return by how much forces and accelerations of a copy may be off, shape (3,) each."""
    tau = np.max([np.abs(one.tau) for one in several], axis=0)
    rates = [np.abs(one.rate) for one in several if one.rate is not None]
    rate = np.max(rates, axis=0) if rates else np.zeros(3)
    return TOLERANCE * np.where(tau > 0.0, tau, 1.0), TOLERANCE * np.where(rate > 0.0, rate, 1.0)


def _case(
    force: Estimator,
    ranges: Mapping[str, tuple[float, float]],
    nu_dot_part: tuple[float, float, float],
    nu_part: tuple[float, float, float],
    psi: float,
    wind: Floats | None,
    current: Floats | None,
    payload: Floats | None,
) -> Case:
    nu_dot, nu = _reach(ranges, ("u_dot", "v_dot", "r_dot"), nu_dot_part), _reach(ranges, ("u", "v", "r"), nu_part)

    def needed(rate: Floats) -> Floats:
        rows = [None if one is None else one[None] for one in (wind, current, payload)]
        return np.asarray(force(rate[None], nu[None], np.array([psi]), *rows)[0])

    tau = needed(nu_dot)
    mass = effective_mass(force, payload)
    push = np.array([_short(value) for value in 0.6 * tau])
    rate = None
    if invertible(mass):
        rate = np.asarray(np.linalg.solve(mass, push - needed(np.zeros(3))), dtype=np.float64)
    return Case(nu_dot, nu, psi, wind, current, payload, tau, push, rate)


def _reach(
    ranges: Mapping[str, tuple[float, float]], names: tuple[str, str, str], parts: tuple[float, float, float]
) -> Floats:
    def most(name: str) -> float:
        known = max(abs(end) for end in ranges.get(name, (0.0, 0.0)))
        return known if known > 0.0 else USUAL[name]

    return np.array([_short(part * most(name)) for name, part in zip(names, parts, strict=True)])


def _short(value: float) -> float:
    return float(f"{value:.3g}")
