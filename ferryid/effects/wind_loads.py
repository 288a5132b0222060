"""Loads of steady winds in every row, compiled: `ferryid.vessel.wind.relative_wind_force` in one pass."""

from __future__ import annotations

import math

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.types import Floats
from ferryid.vessel.profile import WindAreas
from ferryid.vessel.wind import AIR_DENSITY

Shape = tuple[float, float, float, float, float]
"""Factors of longitudinal and transverse load and of the loss at oblique angles, the lever in a beam wind [m], and by how much
it moves with the angle [m/rad]."""


EIGHTH, SIXTEENTH, THREE_SIXTEENTHS = math.pi / 8.0, math.tan(math.pi / 16.0), math.tan(3.0 * math.pi / 16.0)
"""An eighth of a half turn [rad], and tangents of half of it and of one and a half of it."""
TANGENT_EIGHTH = math.tan(math.pi / 8.0)
LEAST = 2.2250738585072014e-308
"""Least normal number: what may be zero is divided by this at least."""
BLOCK = 512
"""Rows at a time: what is worked out of them stays in the cache."""


def steady_wind_force(
    areas: WindAreas, winds_ne: Floats, weights: Floats, cosine: Floats, sine: Floats, nu: Floats
) -> Floats:
    """Return the weighted sum of the loads of winds that are steady over ground, shape (n, 3) [N, N, N·m].

    Parameters
    ----------
    areas
        Wind areas and coefficients.
    winds_ne, weights
        True winds north and east, where the air goes to [m/s], shape (w, 2), and the weight of the load of each, shape (w,).
    cosine, sine
        Of the heading, shape (n,) each.
    nu
        Velocities over ground, shape (n, 3).
    """
    return weighed_loads(np.zeros((1, 2)), winds_ne, weights, cosine, sine, nu, shape_of(areas))


def shape_of(areas: WindAreas) -> Shape:
    """Return what the load of these areas is made of, with the usual density of air."""
    cd_l = areas.CD_l_AF * areas.frontal_m2 / areas.lateral_m2
    return (
        0.5 * AIR_DENSITY * areas.CD_l_AF * areas.frontal_m2,
        0.5 * AIR_DENSITY * areas.CD_t * areas.lateral_m2,
        0.5 * areas.delta * (1.0 - cd_l / areas.CD_t),
        float(areas.S_L_m),
        0.18 * areas.length_m,
    )


@borrowing
def angle(a: float, b: float) -> float:
    """Return ``atan2(a, b)`` of an `a` that is not negative, to the last digit or two, in a fraction of its time.

    The ratio of the smaller to the larger is brought within a sixteenth of a half turn of none, an eighth or a quarter of it;
    there ten terms of Taylor's series are enough.
    """
    size = abs(b)
    large, small = max(a, size), min(a, size)
    # Choices of a value, and divisions that never raise: only so are loops that call it vectorised.
    eighth, quarter = small > SIXTEENTH * large, small > THREE_SIXTEENTHS * large
    near = 2.0 * EIGHTH if quarter else EIGHTH if eighth else 0.0
    tangent = 1.0 if quarter else TANGENT_EIGHTH if eighth else 0.0
    x = np.divide(small - tangent * large, max(large + tangent * small, LEAST))
    y = x * x
    series = y * (1.0 / 17.0 - y * (1.0 / 19.0 - y / 21.0))
    series = y * (1.0 / 9.0 - y * (1.0 / 11.0 - y * (1.0 / 13.0 - y * (1.0 / 15.0 - series))))
    series = y * (1.0 / 3.0 - y * (1.0 / 5.0 - y * (1.0 / 7.0 - series)))
    found = near + (x - x * series)
    found = 0.5 * math.pi - found if a > size else found
    return float(math.pi - found if b < 0.0 else found)


@borrowing
def load_at(
    c: float, s: float, u: float, v: float, north: float, east: float, shape: Shape
) -> tuple[float, float, float]:
    """Return the load [N, N, N·m] of a wind to north and east [m/s] on a heading with cosine and sine c and s."""
    longitudinal, transverse, oblique, lever, moved = shape
    # Velocity relative to the air.
    ahead, aside = u - (c * north + s * east), v - (c * east - s * north)
    square = ahead * ahead + aside * aside
    sin_2gamma = np.divide(2.0 * ahead * aside, max(square, LEAST))
    pressure = np.divide(-math.sqrt(square), 1.0 - oblique * (sin_2gamma * sin_2gamma))
    push = transverse * pressure * aside
    turn = (lever + moved * (0.5 * math.pi - angle(abs(aside), ahead))) * push
    return longitudinal * pressure * ahead, push, turn


@compiled
def weighed_loads(
    winds: Floats, away: Floats, weights: Floats, cosine: Floats, sine: Floats, nu: Floats, shape: Shape
) -> Floats:
    """Return the weighted sum of the loads of several winds, shape (n, 3) [N, N, N·m].

    Parameters
    ----------
    winds
        One that each row has of its own, shape (n, 2), or that all have, shape (1, 2).
    away, weights
        What is added to it, shape (w, 2), and the weight of the load of each, shape (w,).
    cosine, sine, nu
        As of `steady_wind_force`.
    shape
        `shape_of` the areas.
    """
    n = nu.shape[0]
    every = 1 if winds.shape[0] > 1 else 0
    out = np.empty((n, 3))
    u, v, X, Y, N = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    ahead, aside = np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, n, BLOCK):
        rows = min(BLOCK, n - first)
        c, s = cosine[first : first + rows], sine[first : first + rows]
        for i in range(rows):
            u[i], v[i] = nu[first + i, 0], nu[first + i, 1]
            ahead[i], aside[i] = winds[every * (first + i), 0], winds[every * (first + i), 1]
            X[i], Y[i], N[i] = 0.0, 0.0, 0.0
        for w in range(away.shape[0]):
            north, east, weight = away[w, 0], away[w, 1], weights[w]
            for i in range(rows):
                x, y, turn = load_at(c[i], s[i], u[i], v[i], ahead[i] + north, aside[i] + east, shape)
                X[i] += weight * x
                Y[i] += weight * y
                N[i] += weight * turn
        for i in range(rows):
            out[first + i, 0], out[first + i, 1], out[first + i, 2] = X[i], Y[i], N[i]
    return out
