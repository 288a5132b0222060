"""Wind load on the parts above water, Blendermann's form."""

from __future__ import annotations

from math import atan2, pi, sqrt
from typing import NamedTuple

from ferryid.compiled import borrowing
from ferryid.simulate.plant.hull import Force
from ferryid.vessel.profile import WindAreas

AIR_DENSITY = 1.225
"""Density of air [kg/m³] of the wind load."""


class Areas(NamedTuple):
    """Areas [m²], lengths [m] and coefficients as in `ferryid.vessel.profile.WindAreas`; all zero for no wind load."""

    frontal_m2: float
    lateral_m2: float
    length_m: float
    S_L_m: float
    CD_t: float
    CD_l_AF: float
    delta: float


def areas_of(areas: WindAreas | None) -> Areas:
    """Return the wind areas for compiled code; a vessel without any feels no wind."""
    if areas is None:
        return Areas(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Areas(*(float(getattr(areas, name)) for name in Areas._fields))


@borrowing
def wind_load(w: Areas, u_rw: float, v_rw: float) -> Force:
    """Return the wind load [N, N, N·m] for the hull's velocity relative to the air [m/s].

    References
    ----------
    Aurlien (2021), (2.15)-(2.18), Table 4.2.
    """
    V2 = u_rw * u_rw + v_rw * v_rw
    if V2 == 0.0 or w.lateral_m2 == 0.0:
        return 0.0, 0.0, 0.0
    V = sqrt(V2)
    cos_gamma, sin_gamma = u_rw / V, -v_rw / V
    gamma = abs(atan2(v_rw, u_rw))
    CD_l = w.CD_l_AF * w.frontal_m2 / w.lateral_m2
    sin_2gamma = 2.0 * sin_gamma * cos_gamma
    den = 1.0 - 0.5 * w.delta * (1.0 - CD_l / w.CD_t) * sin_2gamma * sin_2gamma
    q = 0.5 * AIR_DENSITY * V2 / den
    X = -q * w.CD_l_AF * cos_gamma * w.frontal_m2
    Y = q * w.CD_t * sin_gamma * w.lateral_m2
    return X, Y, (w.S_L_m / w.length_m - 0.18 * (gamma - 0.5 * pi)) * w.length_m * Y
