"""Elementary functions that give the same bits on every machine."""

from __future__ import annotations

import math

from ferryid.simulate.compiled import compiled


@compiled
def sin(x: float) -> float:
    """Return the sine of an angle [rad]."""
    return math.sin(x)


@compiled
def cos(x: float) -> float:
    """Return the cosine of an angle [rad]."""
    return math.cos(x)


@compiled
def exp(x: float) -> float:
    """Return e to the power x."""
    return math.exp(x)


@compiled
def log(x: float) -> float:
    """Return the natural logarithm of x > 0."""
    return math.log(x)


@compiled
def atan2(y: float, x: float) -> float:
    """Return the angle of the point (x, y) [rad], in [-pi, pi]."""
    return math.atan2(y, x)
