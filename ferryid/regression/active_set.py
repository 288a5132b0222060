"""Least squares with coefficients that are not negative: `scipy.optimize.nnls` would do, but loads for a fifth of a second."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats


def non_negative(X: Floats, y: Floats, most: int) -> Floats:
    """Return b of least ``|X b - y|`` with ``b >= 0``, shape (k,).

    By the active set of Lawson and Hanson (1974), Solving Least Squares Problems, chapter 23.

    Parameters
    ----------
    X, y
        Shapes (n, k) and (n,).
    most
        Steps after which what was found is returned as it is.
    """
    found = np.zeros(X.shape[1])
    free = np.zeros(X.shape[1], dtype=bool)
    rounding = 10.0 * max(X.shape) * np.finfo(np.float64).eps * float(np.abs(X).sum(axis=0).max(initial=0.0))
    barred = np.zeros_like(free)
    for _ in range(most):
        gain = np.where(free | barred, -np.inf, X.T @ (y - X @ found))
        best = int(np.argmax(gain)) if len(gain) else 0
        if not len(gain) or gain[best] <= rounding:
            break
        free[best] = True
        whole = _least_squares(X, y, free)
        if whole[best] <= 0.0:
            # Rounding alone made it look like a gain: it would be taken and left without end.
            free[best], barred[best] = False, True
            continue
        barred[:] = False
        while np.any(negative := free & (whole <= 0.0)):
            # As far towards the unbounded solution as none becomes negative; who is at none there is held at none.
            share = float(np.min(found[negative] / (found[negative] - whole[negative])))
            found = found + share * (whole - found)
            free &= found > np.finfo(np.float64).eps * np.abs(found).max()
            found[~free] = 0.0
            whole = _least_squares(X, y, free)
        found = whole
    return found


def _least_squares(X: Floats, y: Floats, free: np.ndarray) -> Floats:
    """Return the solution with the marked coefficients alone, shape (k,)."""
    out = np.zeros(X.shape[1])
    if free.any():
        out[free] = np.linalg.lstsq(X[:, free], y, rcond=None)[0]
    return out
