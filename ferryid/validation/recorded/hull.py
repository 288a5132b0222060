"""A vessel of the validation plant in the place of a profile's: its boxes in the wind, its strips in the water."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.effects.force_model import MASS, hull_of, required_force
from ferryid.effects.measurements import hull_force_model
from ferryid.types import Floats
from ferryid.validation.plant.air import AirConstants, air_constants, air_load
from ferryid.validation.plant.hull import HullConstants, drag, hull_constants
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
    """Return what a wind adds to the load of still air, shape (n, 3).

    `wind` is where the air goes, north and east [m/s], shape (2,), or (2, n) where it changes.
    """
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


def cannot_be_damped(profile: Profile) -> str:
    """Return why the plant has no hull for a profile, as the end of a sentence; empty where it has."""
    return "" if profile.hull.has_model else "the profile has no hull model"


def damping(log: RecordedLog, nu: Floats, roughness: Floats | None = None) -> Floats:
    """Return the force of the water on the plant's hull in the place of the profile's, shape (n, 3).

    Strips in cross flow, friction and lift are the plant's, for a hull of the profile's main dimensions; each axis is
    multiplied by what brings it nearest to the profile's own damping on the measured motion.

    Parameters
    ----------
    log
        The recording.
    nu
        Velocities through the water, shape (n, 3).
    roughness
        Factors on what grows with the square of the speed, shape (3,); one each where None.
    """
    hull = hull_constants(_vessel(log.profile, FERRY.houses))
    own = hull_of(log.profile)
    own[: len(MASS)] = 0.0
    model = replace(hull_force_model(log.measurements, own), flow=None, load=None)
    stated = -required_force(model, np.zeros_like(log.measurements.nu))
    plain = _drag(hull, log.measurements.nu)
    scale = (stated * plain).sum(axis=0) / np.maximum((plain**2).sum(axis=0), 1e-12)
    return np.asarray(scale * _drag(hull if roughness is None else hull._replace(roughness=roughness), nu))


def _drag(hull: HullConstants, nu: Floats) -> Floats:
    out, six = np.zeros((len(nu), 6)), np.zeros((len(nu), 6))
    six[:, [0, 1, 5]] = nu
    for row in range(len(nu)):
        drag(hull, six[row], 0.0, 1.0, out[row])
    return out[:, [0, 1, 5]]


def current_load(log: RecordedLog, current: Floats) -> Floats:
    """Return what a current adds to the forces of still water, shape (n, 3); `current` is where it goes, north and east [m/s].

    Damping by `damping`, added mass by Kirchhoff's equations, with the velocity through the water.
    """
    measured = log.measurements
    c, s = measured.pointing
    r = measured.nu[:, 2]
    flow = np.column_stack([c * current[0] + s * current[1], c * current[1] - s * current[0], np.zeros(len(r))])
    # The body frame turns through the water.
    turning = np.column_stack([r * flow[:, 1], -r * flow[:, 0], np.zeros(len(r))])
    through, rates = measured.nu - flow, log.acceleration - turning
    added = _added_mass(log.profile)
    more = damping(log, through) - damping(log, measured.nu)
    return more + _added_load(added, through, rates) - _added_load(added, measured.nu, log.acceleration)


def strip_load(log: RecordedLog, growth: Floats, added_share: float) -> Floats:
    """Return what a bank adds to the forces of deep water, shape (n, 3).

    Parameters
    ----------
    log
        The recording.
    growth
        Growth of the damping, as a share, shape (n,).
    added_share
        Growth of the added mass over that of the damping.
    """
    nu = log.measurements.nu
    more = _added_load(_added_mass(log.profile), nu, log.acceleration)
    return np.asarray(growth[:, None] * (damping(log, nu) + added_share * more))


def _added_mass(profile: Profile) -> Floats:
    hull = profile.hull
    rigid = np.array(
        [
            [hull.mass_kg, 0.0, 0.0],
            [0.0, hull.mass_kg, hull.mass_kg * hull.x_g_m],
            [0.0, hull.mass_kg * hull.x_g_m, hull.inertia_z],
        ]
    )
    return np.asarray(hull.M - rigid)


def _added_load(added: Floats, nu: Floats, nu_dot: Floats) -> Floats:
    """Return the force of an added mass on a motion, ``-(A nu_dot + C_A(nu) nu)``, shape (n, 3)."""
    momentum, (u, v, r) = nu @ added.T, nu.T
    coriolis = np.column_stack([-r * momentum[:, 1], r * momentum[:, 0], u * momentum[:, 1] - v * momentum[:, 0]])
    return np.asarray(-(nu_dot @ added.T + coriolis))


def _vessel(profile: Profile, houses: tuple[House, ...]) -> Vessel:
    """Return the plant's ferry with the main dimensions of a profile; those that it does not state are in proportion."""
    hull = profile.hull
    length = float(hull.length_m if np.isfinite(hull.length_m) else FERRY.length)
    as_ferry = length / FERRY.length
    beam = float(hull.beam_m if np.isfinite(hull.beam_m) else FERRY.beam * as_ferry)
    draught = float(hull.draught_m if np.isfinite(hull.draught_m) else FERRY.draught * as_ferry)
    made = replace(FERRY, length=length, beam=beam, draught=draught, mass=hull.mass_kg, houses=houses)
    wetted = (
        FERRY.wetted_m2
        * made.length
        / FERRY.length
        * (made.beam + 2.0 * made.draught)
        / (FERRY.beam + 2.0 * FERRY.draught)
    )
    return replace(made, wetted_m2=wetted)
