"""Loads of the air, from a table of pressures on boxes."""

from __future__ import annotations

from math import atan2, floor, pi
from typing import NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.vessels import Vessel

RHO_AIR = 1.225
COLUMNS = 36
WINDWARD, LEEWARD = 0.75, 0.35
"""Mean pressure on a wall that faces the flow, and suction on the one behind it, over the dynamic pressure: Hoerner (1965)."""
SHIFT = 0.12
"""By how much of a wall's length the pressure's centre moves towards its upwind edge, at 45 degrees."""


class AirConstants(NamedTuple):
    """A table of load over dynamic pressure, by the angle of the flow over the vessel, shape (36, 3); height of the load."""

    table: Floats
    height: float


def air_constants(vessel: Vessel) -> AirConstants:
    """Return the table of a vessel, by where the air goes to relative to the bow: X, Y [m²] and N [m³]."""
    angles = 2.0 * pi * np.arange(COLUMNS) / COLUMNS
    rows = np.zeros((COLUMNS, 3))
    for house in vessel.houses:
        c, s = np.cos(angles), np.sin(angles)
        # The wall that faces the flow feels it by the cosine, somewhat more at a slant; the one behind by its suction.
        along = house.width * house.height * (WINDWARD * c * (1.0 + 0.25 * s * s) + LEEWARD * np.tanh(3.0 * c))
        across = house.length * house.height * (WINDWARD * s * (1.0 + 0.25 * c * c) + LEEWARD * np.tanh(3.0 * s))
        # Towards the edge that the air meets first: the stern's when it comes from astern.
        centre = house.x - SHIFT * house.length * 2.0 * np.abs(s) * c
        rows += np.column_stack([along, across, centre * across])
    return AirConstants(rows, vessel.height_m)


@compiled
def air_load(air: AirConstants, along: float, across: float, out: Floats) -> None:
    """Add the load of air that moves over the vessel along and across [m/s], shape (6,) [N, N·m]."""
    place = atan2(across, along) / (2.0 * pi) * COLUMNS
    low = floor(place)
    part = place - low
    pressure = 0.5 * RHO_AIR * (along * along + across * across)
    for j in range(3):
        before, first = air.table[(low - 1) % COLUMNS, j], air.table[low % COLUMNS, j]
        second, after = air.table[(low + 1) % COLUMNS, j], air.table[(low + 2) % COLUMNS, j]
        # Catmull's and Rom's cubic between the table's rows.
        slope, end = 0.5 * (second - before), 0.5 * (after - first)
        bend = first + part * (
            slope + part * (3.0 * (second - first) - 2.0 * slope - end + part * (slope + end - 2.0 * (second - first)))
        )
        force = pressure * bend
        if j == 0:
            out[0] += force
            out[4] -= air.height * force
        elif j == 1:
            out[1] += force
            out[3] += air.height * force
        else:
            out[5] += force
