"""Integrals of the cross-flow along the two halves of a hull, in closed form."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats

LEAST_SPEED_MPS = 1e-300
"""Added to a sum of speeds that is divided by, m/s: at rest all integrals are zero."""


def crossflow_integrals(v: Floats, r: Floats, length_m: float) -> dict[str, Floats]:
    """Return the four integrals by the names of their factors: force [m³/s²] and moment [m⁴/s²], fore and aft, shape (n,).

    ``fore`` is ``∫|v + x r|(v + x r) dx`` over 0 <= x <= L/2 and ``x_fore`` the same with another x under the integral; ``aft``
    and ``x_aft`` go from -L/2 to 0.

    Parameters
    ----------
    v, r
        Sway [m/s] and yaw rate [rad/s], shape (n,).
    length_m
        Length L of the hull, its middle at the body origin.
    """
    half = 0.5 * length_m
    turn = half * r
    fore, x_fore = half_hull(v, v + turn, half)
    aft, x_aft = half_hull(v, v - turn, half)
    return {"fore": fore, "aft": aft, "x_fore": x_fore, "x_aft": -x_aft}


def half_hull(v: Floats, end: Floats, half: float) -> tuple[Floats, Floats]:
    """Return ``∫|w| w ds`` and ``∫ s |w| w ds`` over 0 <= s <= half, w going linearly from `v` to `end`, shape (n,) each.

    With t = s/half, ``even`` is ``∫|w| w dt`` and ``odd`` is ``∫(2t - 1)|w| w dt``. Nothing is divided by the
    slope of w, which may be zero; `crossing` is zero where w keeps its sign.
    """
    a, b = np.abs(v), np.abs(end)
    both = a + b + LEAST_SPEED_MPS
    even = (v + end) / both * (v * v + a * b + end * end) / 3.0
    crossing = 0.5 * (a * b - v * end) / both
    odd = (b * end - a * v) / 6.0 - crossing * crossing * (end - v) / both / 3.0
    return half * even, 0.5 * half * half * (even + odd)
