"""Stepwise regression: ordinary least squares, terms added and then removed while Schwarz's criterion falls."""

from __future__ import annotations

from functools import partial
from math import log

import numpy as np

from ferryid.types import Floats, Ints
from ferryid.validation.rivals.learner import Learner
from ferryid.validation.rivals.regression import learn_sparsely, left_over

MOST_TERMS = 60
"""Terms at which adding ends."""


def choose(X: Floats, y: Floats, block: Ints) -> Floats:
    """Return the coefficients of a forward and then backward selection; Schwarz (1978), Efroymson (1960).

    Parameters
    ----------
    X, y
        Columns, shape (m, k), and what they are to explain, shape (m,).
    block
        Not used: the criterion needs no data held out.
    """
    m = len(y)
    chosen = _forward(X, y)
    left = left_over(X[:, chosen], y)
    while chosen:
        without = [left_over(np.delete(X[:, chosen], i, axis=1), y) for i in range(len(chosen))]
        i = int(np.argmin(without))
        if _criterion(without[i], m, len(chosen) - 1) >= _criterion(left, m, len(chosen)):
            break
        left = without[i]
        del chosen[i]
    coefficients = np.zeros(X.shape[1])
    if chosen:
        coefficients[chosen] = np.linalg.lstsq(X[:, chosen], y, rcond=None)[0]
    return coefficients


def _forward(X: Floats, y: Floats) -> list[int]:
    """Return the terms in the order in which they were added."""
    m = len(y)
    rest, columns = y.copy(), X.copy()
    size = np.sum(columns**2, axis=0)
    whole = size.copy()
    chosen: list[int] = []
    while len(chosen) < min(MOST_TERMS, X.shape[1], m - 1):
        # What the chosen ones leave of a column is what it could add; next to nothing is rounding.
        free = size > 1e-8 * whole
        gains = np.where(free, (columns.T @ rest) ** 2 / np.where(free, size, 1.0), -1.0)
        k = int(np.argmax(gains))
        left = float(rest @ rest)
        if gains[k] <= 0.0 or _criterion(left - gains[k], m, len(chosen) + 1) >= _criterion(left, m, len(chosen)):
            break
        chosen.append(k)
        unit = columns[:, k] / np.sqrt(size[k])
        rest = rest - unit * (unit @ rest)
        columns = columns - np.outer(unit, unit @ columns)
        size = np.sum(columns**2, axis=0)
    return chosen


def _criterion(left: float, m: int, terms: int) -> float:
    return m * log(max(left, 1e-300) / m) + terms * log(m)


learn: Learner = partial(learn_sparsely, "stepwise", choose)
"""Choose terms stepwise; see `ferryid.validation.rivals.learner.Learner`."""
