"""Coefficients of several terms fitted together: masses act by their inverse, which no column of a regression does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats, Ints
from ferryid.validation.rivals.base import Base

ROUNDS = 5
"""Steps of Gauss's and Newton's method."""
HALVINGS = 12
"""How often a step is halved that makes things worse, before it is given up."""
PROBE = 1e-3
"""Change of a coefficient by which the slope is taken."""


def combined(base: Base, units: Sequence[ForceModel], coefficients: Floats) -> ForceModel:
    """Return the base model's force model with terms in it, each as many units as its coefficient says."""
    plain = base.force_model
    n = len(plain.measurements.t)
    hull, external = plain.hull.copy(), plain.external.copy()
    load = np.zeros((n, 5)) if plain.load is None else plain.load.copy()
    damping = np.ones(n)
    for unit, coefficient in zip(units, coefficients.tolist(), strict=True):
        if unit.hull is not plain.hull:
            hull += coefficient * (unit.hull - plain.hull)
        if unit.external is not plain.external:
            external += coefficient * (unit.external - plain.external)
        if unit.load is not None:
            load += coefficient * (unit.load - (0.0 if plain.load is None else plain.load))
        if unit.damping_factor is not None:
            damping += coefficient * (unit.damping_factor - 1.0)
    loaded = plain.load is not None or any(unit.load is not None for unit in units)
    damped = any(unit.damping_factor is not None for unit in units)
    return replace(
        plain,
        hull=hull,
        external=external,
        load=load if loaded else None,
        damping_factor=damping if damped else None,
    )


def least_error(
    base: Base, units: Sequence[ForceModel], several: Sequence[Floats], rows: Ints, by_axis: Floats
) -> Floats:
    """Return those of several coefficients whose force errs least in the log; other arguments as of `joint_coefficients`.

    What fits the acceleration best may be a mass so large that it hardly moves, the force of which is nothing but noise.
    """

    def error(coefficients: Floats) -> float:
        force_model = combined(base, units, coefficients)
        if not _has_mass(force_model):
            return np.inf
        left = base.prepared.motion.tau - base.expected(force_model).tau
        return float(np.sum((left[rows] / by_axis) ** 2))

    return min(several, key=error)


def joint_coefficients(base: Base, units: Sequence[ForceModel], start: Floats, rows: Ints, by_axis: Floats) -> Floats:
    """Return the coefficients with which the terms together leave least of the measured acceleration, shape (q,).

    Parameters
    ----------
    base, units
        The log, and a unit of each term in it.
    start
        Where to begin, shape (q,): those of the linear regression, or as much of them as leaves the vessel a mass.
    rows, by_axis
        Rows to fit, and what the force on each axis is divided by, shape (3,).
    """

    def left(coefficients: Floats) -> Floats:
        force_model = combined(base, units, coefficients)
        if not _has_mass(force_model):
            return np.full(3 * len(rows), np.inf)
        return np.asarray(((base.residual + base.force_between(force_model))[rows] / by_axis).ravel())

    found: Floats = np.zeros_like(start)
    rest = left(found)
    step = start
    for _ in range(ROUNDS + 1):
        shorter = (found + step * 0.5**k for k in range(HALVINGS))
        after = next((one for one in shorter if np.sum(left(one) ** 2) < np.sum(rest**2)), None)
        if after is None:
            break
        found, rest = after, left(after)
        slopes = np.column_stack([(left(found + PROBE * one) - rest) / PROBE for one in np.eye(len(found))])
        if not np.isfinite(slopes).all():
            # The vessel is about to lose its mass: no way on from here.
            break
        step = np.asarray(-np.linalg.lstsq(slopes, rest, rcond=None)[0])
    return found


def _has_mass(force_model: ForceModel) -> bool:
    """Return True where the mass matrix is positive on every row."""
    m11, m22, m23, m32, m33 = (
        force_model.hull[:5] + (np.zeros((1, 5)) if force_model.load is None else force_model.load)
    ).T
    return bool(min(m11.min(), m22.min(), (m22 * m33 - m23 * m32).min()) > 0.0)
