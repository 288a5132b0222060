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
    return weighed_loads(winds_ne, weights, cosine, sine, nu, _shape(areas))


def _shape(areas: WindAreas) -> Shape:
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
    large, small = max(a, abs(b)), min(a, abs(b))
    near, tangent = 0.0, 0.0
    if small > SIXTEENTH * large:
        near, tangent = EIGHTH, TANGENT_EIGHTH
    if small > THREE_SIXTEENTHS * large:
        near, tangent = 2.0 * EIGHTH, 1.0
    x = (small - tangent * large) / max(large + tangent * small, 2.2250738585072014e-308)
    y = x * x
    series = y * (1.0 / 17.0 - y * (1.0 / 19.0 - y / 21.0))
    series = y * (1.0 / 9.0 - y * (1.0 / 11.0 - y * (1.0 / 13.0 - y * (1.0 / 15.0 - series))))
    series = y * (1.0 / 3.0 - y * (1.0 / 5.0 - y * (1.0 / 7.0 - series)))
    found = near + (x - x * series)
    found = 0.5 * math.pi - found if a > abs(b) else found
    return math.pi - found if b < 0.0 else found


@borrowing
def load(u: float, v: float, shape: Shape) -> tuple[float, float, float]:
    """Return the load at a velocity relative to the air [m/s]."""
    longitudinal, transverse, oblique, lever, moved = shape
    square = u * u + v * v
    sin_2gamma = 2.0 * u * v / max(square, 2.2250738585072014e-308)
    pressure = -math.sqrt(square) / (1.0 - oblique * (sin_2gamma * sin_2gamma))
    Y = transverse * pressure * v
    return longitudinal * pressure * u, Y, (lever + moved * (0.5 * math.pi - angle(abs(v), u))) * Y


@compiled
def weighed_loads(winds: Floats, weights: Floats, cosine: Floats, sine: Floats, nu: Floats, shape: Shape) -> Floats:
    """Return `steady_wind_force`."""
    out = np.empty((nu.shape[0], 3))
    for i in range(nu.shape[0]):
        c, s = cosine[i], sine[i]
        X, Y, N = 0.0, 0.0, 0.0
        for w in range(winds.shape[0]):
            along, across = c * winds[w, 0] + s * winds[w, 1], c * winds[w, 1] - s * winds[w, 0]
            ahead, aside, turn = load(nu[i, 0] - along, nu[i, 1] - across, shape)
            X, Y, N = X + weights[w] * ahead, Y + weights[w] * aside, N + weights[w] * turn
        out[i, 0], out[i, 1], out[i, 2] = X, Y, N
    return out
