"""A mooring line: a linear spring from the body origin to a point."""

from __future__ import annotations

from typing import NamedTuple

from ferryid.compiled import borrowing
from ferryid.simulate.plant.hull import Force


class Spring(NamedTuple):
    """Where the spring is fastened [m] and its stiffness [N/m], north and east."""

    north_m: float
    east_m: float
    stiffness_north_Npm: float
    stiffness_east_Npm: float


@borrowing
def mooring_load(spring: Spring, x: float, y: float, cos_psi: float, sin_psi: float) -> Force:
    """Return the spring's force on the body origin in the body frame [N, N, N·m]; no moment."""
    north = -spring.stiffness_north_Npm * (x - spring.north_m)
    east = -spring.stiffness_east_Npm * (y - spring.east_m)
    return cos_psi * north + sin_psi * east, cos_psi * east - sin_psi * north, 0.0
