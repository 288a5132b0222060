"""Terms of a fitted model that no coefficient of a hull stands for: products of velocities, and a constant force."""

from __future__ import annotations

from math import atan2, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.simulate.plant.hull import Force
from ferryid.types import Floats, Ints

if TYPE_CHECKING:
    from ferryid.models.forces import UnmappedTerms

_FLOW = ("V", "cos", "sin", "2cos", "|cos|", "|sin|", "gamma")
FACTORS = (
    *("u", "v", "r", "|u|", "|v|", "|r|"),
    *(f"{name}_{flow}" for flow in ("rw", "rc") for name in _FLOW),
)
"""Factors of terms that the plant knows, of `ferryid.regression.bases.DIMENSIONS`; a code is a place in them."""
_RW, _RC = FACTORS.index("V_rw"), FACTORS.index("V_rc")
NONE = -1
"""In the place of a factor: no more of them."""


class Beside(NamedTuple):
    """T terms: `factors` (T, f) are codes, `force` (T, 3) and `constant` (3,) what acts on the hull [N, N, N·m].

    `zeta` divides the loads of air, waves and payload, which then are in the units of the actuators' force as the hull is.
    `added_mass` (3,), m11, m22 and m23 [kg, kg, kg·m], accelerates with the hull and has no C of its own.
    """

    factors: Ints
    force: Floats
    constant: Floats
    zeta: float
    added_mass: Floats


def beside_of(terms: UnmappedTerms | None) -> Beside:
    """Return terms for compiled code; what a motion takes, a model says, and the plant what acts on the hull."""
    if terms is None:
        return Beside(np.zeros((0, 1), dtype=np.int64), np.zeros((0, 3)), np.zeros(3), 1.0, np.zeros(3))
    most = max([len(one.factors) for one in terms.functions], default=1)
    factors = np.full((len(terms.functions), most), NONE, dtype=np.int64)
    for row, one in zip(factors, terms.functions, strict=True):
        row[: len(one.factors)] = [FACTORS.index(name) for name in one.factors]
    return Beside(factors, -terms.theta, -terms.intercept, terms.zeta, np.array(terms.added_mass))


@borrowing
def _of_flow(which: int, u: float, v: float) -> float:
    """Return a factor of a flow, counted from ``V``; see `ferryid.export.physics.FACTORS`."""
    if which == 0:
        return sqrt(u * u + v * v)
    if which == 1:
        return u
    if which == 2:
        return -v
    if which == 3:
        return 2.0 * u
    if which == 4:
        return abs(u)
    if which == 5:
        return abs(v)
    return -atan2(v, u)


@borrowing
def beside_load(
    beside: Beside, u: float, v: float, r: float, u_rw: float, v_rw: float, u_rc: float, v_rc: float
) -> Force:
    """Return the force of the terms [N, N, N·m], from velocities over ground, and through air and water."""
    X, Y, N = beside.constant[0], beside.constant[1], beside.constant[2]
    for k in range(beside.factors.shape[0]):
        value = 1.0
        for j in range(beside.factors.shape[1]):
            code = beside.factors[k, j]
            if code == 0:
                value *= u
            elif code == 1:
                value *= v
            elif code == 2:
                value *= r
            elif code == 3:
                value *= abs(u)
            elif code == 4:
                value *= abs(v)
            elif code == 5:
                value *= abs(r)
            elif code >= _RC:
                value *= _of_flow(code - _RC, u_rc, v_rc)
            elif code >= _RW:
                value *= _of_flow(code - _RW, u_rw, v_rw)
        X += beside.force[k, 0] * value
        Y += beside.force[k, 1] * value
        N += beside.force[k, 2] * value
    return X, Y, N
