"""Which of a fitted model's terms stand for which of the hull's coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ferryid.effects.force_model import COEFFICIENTS
from ferryid.models.model import Model
from ferryid.regression.bases import Term, make_basis
from ferryid.types import Floats

MAPPED: Mapping[str, tuple[tuple[str, int], ...]] = {
    "X_u": (("u", 0),),
    "X_|u|u": (("|u|u", 0), ("sgn(u)u^2", 0)),
    "X_uuu": (("u^3", 0),),
    "Y_v": (("v", 1),),
    "Y_|v|v": (("|v|v", 1), ("sgn(v)v^2", 1)),
    "Y_|r|v": (("|r|v", 1),),
    "Y_vvv": (("v^3", 1),),
    "Y_r": (("r", 1),),
    "Y_|v|r": (("|v|r", 1),),
    "Y_|r|r": (("|r|r", 1), ("sgn(r)r^2", 1)),
    "N_v": (("v", 2),),
    "N_|v|v": (("|v|v", 2), ("sgn(v)v^2", 2)),
    "N_|r|v": (("|r|v", 2),),
    "N_r": (("r", 2),),
    "N_|v|r": (("|v|r", 2),),
    "N_|r|r": (("|r|r", 2), ("sgn(r)r^2", 2)),
    "N_rrr": (("r^3", 2),),
    "Y_uv": (("uv", 1),),
    "Y_ur": (("ur", 1),),
    "N_uv": (("uv", 2),),
    "N_ur": (("ur", 2),),
    "m11": (("u_dot", 0),),
    "m22": (("v_dot", 1),),
    "m23": (("r_dot", 1),),
    "m32": (("v_dot", 2),),
    "m33": (("r_dot", 2),),
}
"""The terms of a fitted model, with their axes, that stand for each of the hull's coefficients."""


def hull_contribution(model: Model) -> tuple[Floats, Floats]:
    """Return what a model's terms add to the hull's coefficients, and its variance, shape (26,) each."""
    part, variance = np.zeros(len(COEFFICIENTS)), np.zeros(len(COEFFICIENTS))
    for index, name in enumerate(COEFFICIENTS):
        picked = [(model.terms.index(term), axis) for term, axis in MAPPED[name] if term in model.terms]
        if not picked:
            continue
        rows, axis = np.array([row for row, _ in picked]), picked[0][1]
        # Mass takes force to accelerate; a SNAME coefficient gives the force that the water exerts.
        part[index] = (1.0 if name.startswith("m") else -1.0) * float(model.theta[rows, axis].sum())
        variance[index] = float(model.covariance[axis][np.ix_(rows, rows)].sum())
    return part, variance


def hull_covariance(model: Model) -> Floats:
    """Return the covariance of what a model's terms add to the hull's coefficients, shape (26, 26).

    Axes are fitted by themselves, so that coefficients of different axes do not vary together.
    """
    count = len(model.terms)
    covariance = np.zeros((len(COEFFICIENTS), len(COEFFICIENTS)))
    for axis in range(3):
        picked = np.zeros((len(COEFFICIENTS), count))
        for index, name in enumerate(COEFFICIENTS):
            for term, of in MAPPED[name]:
                if of == axis and term in model.terms:
                    picked[index, model.terms.index(term)] = 1.0 if name.startswith("m") else -1.0
        covariance += picked @ model.covariance[axis][:count, :count] @ picked.T
    return covariance


@dataclass(frozen=True, eq=False)
class UnmappedTerms:
    """What a model's force has beside that of its hull.

    Attributes
    ----------
    functions
        T terms.
    theta
        Their coefficients on the axes on which no coefficient of a hull stands for them, shape (T, 3).
    intercept
        Shape (3,) [N, N, N·m].
    zeta
        Factor on the measured force, (4.5): divides the loads of air, waves and payload. The hull's coefficients are
        divided already.
    added_mass
        m11, m22 and the mean of m23 and m32 that terms add to the hull [kg, kg, kg·m]. A model's C is that of its base model's
        mass alone: what turning takes beside is in its terms of products of velocities.
    """

    functions: tuple[Term, ...]
    theta: Floats
    intercept: Floats
    zeta: float = 1.0
    added_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)


def beside_the_hull(model: Model) -> UnmappedTerms:
    """Return what a model's force has beside its hull: terms of `unmapped_terms`, and no C of the mass that terms add."""
    theta, taken = model.theta.copy(), {place for places in MAPPED.values() for place in places}
    for k, term in enumerate(model.terms):
        for axis in range(3):
            if (term, axis) in taken:
                theta[k, axis] = 0.0
    some = np.flatnonzero(theta.any(axis=1))
    named = str(model.settings["basis"])
    functions = make_basis(named, structure=str(model.settings["structure"])).functions if model.terms else ()
    m11, m22, m23, m32, _ = hull_contribution(model)[0][:5].tolist()
    return UnmappedTerms(
        tuple(functions[k] for k in some.tolist()),
        theta[some],
        model.intercept,
        float(model.scale.get("zeta", 1.0)),
        (m11, m22, 0.5 * (m23 + m32)),
    )


def unmapped_terms(model: Model) -> tuple[str, ...]:
    """Return the terms, and the constant, that no coefficient of a hull stands for and that are not zero."""
    taken = {place for places in MAPPED.values() for place in places}
    left = [
        term
        for k, term in enumerate(model.terms)
        if any(model.theta[k, axis] != 0.0 and (term, axis) not in taken for axis in range(3))
    ]
    return (*left, *(("the constant",) if np.any(model.intercept != 0.0) else ()))
