"""A vessel of the validation plant in the place of a profile's: its boxes in the wind, its strips in the water."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.plant.air import AirConstants, air_constants, air_load
from ferryid.validation.plant.vessels import FERRY, House, Vessel
from ferryid.validation.recorded.log import RecordedLog
from ferryid.vessel.profile import Profile


def rigid_load(mass_kg: float, x_m: float, nu: Floats, nu_dot: Floats) -> Floats:
    """Return the force that a mass at a place takes to follow a motion, as a load: ``-(M nu_dot + C nu)``, shape (n, 3).

    By the accelerations of a point of the rigid body; Fossen (2021), section 3.3, in the plane.
    """
    (u, v, r), (u_dot, v_dot, r_dot) = nu.T, nu_dot.T
    ahead, aside = u_dot - v * r - x_m * r**2, v_dot + u * r + x_m * r_dot
    return -mass_kg * np.column_stack([ahead, aside, x_m * aside])


def air_of(profile: Profile) -> AirConstants:
    """Return boxes of the frontal and lateral area of a profile, as the plant's table of wall pressures."""
    areas = profile.wind
    assert areas is not None
    height = areas.lateral_m2 / areas.length_m
    house = House(areas.S_L_m, areas.length_m, areas.frontal_m2 / height, height)
    return air_constants(_vessel(profile, (house,)))


def wind_load(log: RecordedLog, wind: Floats) -> Floats:
    """Return what a wind adds to the load of still air, shape (n, 3); `wind` is where the air goes, north and east [m/s]."""
    air, measured = air_of(log.profile), log.measurements
    c, s = measured.pointing
    ahead, aside = c * wind[0] + s * wind[1], c * wind[1] - s * wind[0]
    u, v, _ = measured.nu.T
    out = np.zeros((len(u), 3))
    for row in range(len(u)):
        blown, still = np.zeros(6), np.zeros(6)
        air_load(air, float(ahead[row] - u[row]), float(aside[row] - v[row]), blown)
        air_load(air, float(-u[row]), float(-v[row]), still)
        out[row] = (blown - still)[[0, 1, 5]]
    return out


def _vessel(profile: Profile, houses: tuple[House, ...]) -> Vessel:
    from dataclasses import replace

    return replace(FERRY, length=profile.hull.length_m, mass=profile.hull.mass_kg, houses=houses)
