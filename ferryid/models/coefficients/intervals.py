"""The hull's coefficients in a model with their 95 % intervals."""

from __future__ import annotations

import numpy as np

from ferryid.effects.force_model import COEFFICIENTS, MASS
from ferryid.models.forces import MAPPED, hull_coefficients
from ferryid.models.model import Model
from ferryid.types import Floats


def coefficient_intervals(model: Model) -> dict[str, Floats]:
    """Return value, low and high of every coefficient of the hull, base model and terms counted together, shape (3,) each.

    What no term of the model changes is the base model's, which has no interval: its ends are NaN.
    """
    hull = hull_coefficients(model)
    found = {name: hull[k] + _reach(model, name) for k, name in enumerate(COEFFICIENTS)}
    for name, told in model.hull.items():
        found[name] = np.array([told.value, told.low, told.high])
    return found


def _reach(model: Model, name: str) -> Floats:
    """Return how far the interval of a hull's coefficient reaches from its value: 0, low and high, shape (3,).

    Every basis has one function for each; what has none is the base model's, which has no interval.
    """
    for term, axis in MAPPED[name]:
        if term in model.terms:
            around = term_interval(model, term, axis)
            around = around - around[0]
            return around if name in MASS else opposite(around)
    return np.array([0.0, np.nan, np.nan])


def term_interval(model: Model, term: str, axis: int) -> Floats:
    """Return the coefficient of a term and its interval as the model file has them, shape (3,); none where it has no width."""
    if term not in model.terms:
        return np.array([0.0, np.nan, np.nan])
    k = model.terms.index(term)
    low, high = model.low[k, axis], model.high[k, axis]
    return np.array([model.theta[k, axis], *((low, high) if low < high else (np.nan, np.nan))])


def opposite(interval: Floats) -> Floats:
    """Return the negative: a SNAME coefficient gives the force that the water exerts, a term that which the motion takes."""
    return -interval[[0, 2, 1]]
