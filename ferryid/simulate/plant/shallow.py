"""Shallow water: a rectangle in which all damping is multiplied."""

from __future__ import annotations

from typing import NamedTuple

from ferryid.compiled import borrowing
from ferryid.simulate.sections import Shallow


class Patch(NamedTuple):
    """The rectangle [m] in NED, the factor inside, and the width [m] outside over which it falls to 1."""

    south: float
    north: float
    west: float
    east: float
    factor: float
    edge_m: float


def patch_of(shallow: Shallow) -> Patch:
    """Return the rectangle for compiled code, its corners in either order."""
    (south, north), (west, east) = sorted(shallow.north_m), sorted(shallow.east_m)
    return Patch(south, north, west, east, shallow.damping_factor, shallow.edge_m)


@borrowing
def _share(outside: float, edge_m: float) -> float:
    """Return 1 at the rectangle and 0 from `edge_m` on, with no kink in between."""
    s = 1.0 - min(max(outside / edge_m, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@borrowing
def damping_factor(patch: Patch, x: float, y: float) -> float:
    """Return the factor on the damping at a place [m]."""
    if patch.factor == 1.0:
        return 1.0
    along = _share(max(patch.south - x, x - patch.north), patch.edge_m)
    across = _share(max(patch.west - y, y - patch.east), patch.edge_m)
    return 1.0 + (patch.factor - 1.0) * along * across
