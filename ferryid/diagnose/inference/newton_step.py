"""A step of Newton's method within bounds."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats


def newton_step(A: Floats, slope: Floats, low: Floats, high: Floats) -> Floats:
    """Return the step; what would go beyond its bound goes there, and the others as well as they can then.

    Parameters
    ----------
    A, slope
        Positive definite second derivatives of the cost, or what stands for them, shape (k, k), and first ones, shape (k,).
    low, high
        Bounds of the step, shape (k,).
    """
    step = np.asarray(-np.linalg.solve(A, slope), dtype=np.float64)
    beyond = (step < low) | (step > high)
    if not beyond.any():
        return step
    free = ~beyond
    step = np.where(beyond, np.clip(step, low, high), 0.0)
    while free.any():
        step[free] = -np.linalg.solve(A[np.ix_(free, free)], slope[free] + A[np.ix_(free, ~free)] @ step[~free])
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(step, low, high)[beyond]
        free &= ~beyond
    return step
