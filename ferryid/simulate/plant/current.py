"""Current over ground, steady or slowly turning, that may set in and slacken."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from ferryid.compiled import compiled
from ferryid.simulate.sections import Current
from ferryid.types import Floats


def turn_rate(current: Current) -> float:
    """Return how fast the current turns [rad/s], clockwise from above."""
    return current.turn_degpmin * pi / 180.0 / 60.0


def current_series(current: Current, n: int, step_s: float) -> Floats:
    """Return the velocity of the water over ground every `step_s` seconds, shape (n, 2) [m/s, north and east]."""
    series = _turning(float(current.north_mps), float(current.east_mps), turn_rate(current), n, step_s)
    t = np.arange(n) * step_s
    series[(t < current.from_s) | (t >= current.until_s)] = 0.0
    return series


@compiled
def _turning(north: float, east: float, turn_radps: float, n: int, step_s: float) -> Floats:
    series = np.empty((n, 2))
    for i in range(n):
        angle = turn_radps * (i * step_s)
        c, s = cos(angle), sin(angle)
        series[i, 0] = c * north - s * east
        series[i, 1] = s * north + c * east
    return series
