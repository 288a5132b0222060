"""The profile that a user has of a vessel of the plant: from a towing tank, a bollard pull and drawings.

Masses are right, damping is fitted to the true forces over the usual range of velocities and the wind areas to the true loads,
both in the forms that a profile has; then each coefficient of the hull is given an error.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
from scipy.optimize import least_squares

from ferryid.types import Floats
from ferryid.validation.plant.air import RHO_AIR, air_constants, air_load
from ferryid.validation.plant.hull import added_mass, drag, hull_constants, inertia, rigid_mass
from ferryid.validation.plant.vessels import Thruster, Vessel
from ferryid.vessel.profile import WindAreas
from ferryid.vessel.wind import wind_force

TESTS = 4000
"""Velocities in the towing tank."""
SURGE = ("X_u", "X_|u|u")
SWAY = ("Y_v", "Y_|v|v", "Y_|r|v", "Y_r", "Y_|v|r", "Y_|r|r", "Y_uv")
YAW = ("N_v", "N_|v|v", "N_|r|v", "N_r", "N_|v|r", "N_|r|r", "N_uv")
MASSES = ("m11", "m22", "m23", "m32", "m33")


@cache
def masses(vessel: Vessel) -> Mapping[str, float]:
    """Return the masses of the vessel in the plane, added mass included."""
    M = rigid_mass(vessel.mass, vessel.x_g, vessel.z_g, inertia(vessel)) + added_mass(vessel)
    return {"m11": M[0, 0], "m22": M[1, 1], "m23": M[1, 5], "m32": M[5, 1], "m33": M[5, 5]}


@cache
def damping(vessel: Vessel) -> Mapping[str, float]:
    """Return the coefficients of a hull model that come nearest to the true forces of the water in the plane."""
    rng = np.random.default_rng(1)
    scale = np.array([0.6, 0.4, 1.2]) * vessel.speed_mps / np.array([1.0, 1.0, vessel.length])
    velocities = scale * rng.standard_normal((TESTS, 3))
    hull = hull_constants(vessel)
    forces = np.zeros((TESTS, 6))
    for row, (u, v, r) in enumerate(velocities):
        drag(hull, np.array([u, v, 0.0, 0.0, 0.0, r]), 0.0, 1.0, forces[row])
    found: dict[str, float] = {}
    for names, column in ((SURGE, 0), (SWAY, 1), (YAW, 5)):
        A = np.column_stack([_term(name, velocities) for name in names])
        found |= zip(names, np.linalg.lstsq(A, forces[:, column], rcond=None)[0].tolist(), strict=True)
    return found


def _term(name: str, velocities: Floats) -> Floats:
    """Return what a coefficient is multiplied by: ``N_|v|r`` by |v| r."""
    value, letters = np.ones(len(velocities)), name.partition("_")[2]
    while letters:
        if letters[0] == "|":
            value = value * np.abs(velocities[:, "uvr".index(letters[1])])
            letters = letters[3:]
        else:
            value = value * velocities[:, "uvr".index(letters[0])]
            letters = letters[1:]
    return value


@cache
def wind_areas(vessel: Vessel) -> WindAreas:
    """Return Blendermann's parameters that come nearest to the true loads of the air."""
    frontal = sum(house.width * house.height for house in vessel.houses)
    lateral = sum(house.length * house.height for house in vessel.houses)
    angles = np.linspace(-np.pi, np.pi, 180, endpoint=False)
    over = 10.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    true = np.zeros((len(angles), 6))
    constants = air_constants(vessel)
    for row, (along, across) in enumerate(over):
        air_load(constants, along, across, true[row])
    pressure = 0.5 * RHO_AIR * 100.0
    scale = pressure * np.array([frontal, lateral, lateral * vessel.length * 0.2])

    def areas(p: Floats) -> WindAreas:
        return WindAreas(frontal, lateral, vessel.length, float(p[0]), float(p[1]), float(p[2]), float(p[3]))

    def error(p: Floats) -> Floats:
        zero = np.zeros(len(angles))
        fitted = wind_force(areas(p), over, zero, np.zeros((len(angles), 3)))
        return np.asarray(((fitted - true[:, [0, 1, 5]]) / scale).ravel())

    return areas(least_squares(error, [0.0, 0.9, 0.6, 0.5], bounds=([-2, 0.2, 0.1, 0.0], [2, 2.0, 2.0, 1.0])).x)


def profile_text(
    vessel: Vessel,
    factors: Mapping[str, float] | None,
    thrusters: tuple[Thruster, ...],
    omitted: tuple[str, ...] = (),
) -> str:
    """Return the profile as TOML.

    Parameters
    ----------
    vessel
        The true one.
    factors
        What coefficients of the hull are multiplied by, by name; None for a profile without a hull model.
    thrusters
        As the profile has them.
    omitted
        Coefficients that the profile lacks.
    """
    areas = wind_areas(vessel)
    lines = [
        'schema = "ferryid.vessel/1"',
        f'name = "{vessel.name}"',
        f'title = "{vessel.title}"',
        'source = "towing tank, bollard pull and areas of a vessel that exists in ferryid.validation alone"',
        "[hull]",
        f"length_m = {vessel.length}",
        f"beam_m = {vessel.beam}",
        f"draught_m = {vessel.draught}",
        f"mass_kg = {vessel.mass}",
        f"inertia_z = {vessel.mass * (vessel.k_zz**2 + vessel.x_g**2):.6g}",
        f"x_g_m = {vessel.x_g}",
        *([] if factors is None else _hull_model(vessel, factors, omitted)),
        "[wind]",
        f"frontal_m2 = {areas.frontal_m2:.6g}",
        f"lateral_m2 = {areas.lateral_m2:.6g}",
        f"length_m = {areas.length_m}",
        f"S_L_m = {areas.S_L_m:.6g}",
        f"CD_t = {areas.CD_t:.6g}",
        f"CD_l_AF = {areas.CD_l_AF:.6g}",
        f"delta = {areas.delta:.6g}",
    ]
    for one in thrusters:
        lines += _thruster(one)
    lines.append(NAVIGATION)
    for one in vessel.thrusters:
        lines += _signals(one)
    return "\n".join(lines) + "\n"


def _hull_model(vessel: Vessel, factors: Mapping[str, float], omitted: tuple[str, ...]) -> list[str]:
    M, D = (
        {name: value * factors.get(name, 1.0) for name, value in some.items()}
        for some in (masses(vessel), damping(vessel))
    )
    return [
        "[hull.M]",
        *(f"{name} = {value:.8g}" for name, value in M.items()),
        "[hull.D]",
        *(f'"{name}" = {value:.8g}' for name, value in D.items() if name not in omitted),
    ]


def _thruster(one: Thruster) -> list[str]:
    kind = {None: "azimuth", 0.0: "propeller", 90.0: "tunnel"}[one.angle_deg]
    return [
        "[[actuator]]",
        f'name = "{one.name}"',
        f'kind = "{kind}"',
        f"position_m = [{one.x}, {one.y}]",
        "[actuator.thrust]",
        'kind = "quadratic"',
        'input = "rpm"',
        f"ahead = {one.ahead}",
        f"astern = {one.astern}",
        f"valid = [{-1.02 * one.most_rpm}, {1.02 * one.most_rpm}]",
    ]


def _signals(one: Thruster) -> list[str]:
    lines = []
    for topic, suffix in (("state", ""), ("command", ".command")):
        lines += [
            f'[signals."{one.name}.speed{suffix}"]',
            f'topic = "/{one.name}/{topic}"',
            'field = "speed"',
            'unit = "rpm"',
        ]
        if one.angle_deg is None:
            lines += [
                f'[signals."{one.name}.angle{suffix}"]',
                f'topic = "/{one.name}/{topic}"',
                'field = "azimuth"',
                'unit = "rad"',
            ]
    return lines


NAVIGATION = """[signals.position]
topic = "/navigation/odometry"
fields = ["pose.pose.position.x", "pose.pose.position.y"]
unit = "m"
frame = "NED"
[signals.heading]
topic = "/navigation/odometry"
quaternion = ["pose.pose.orientation.x", "pose.pose.orientation.y", "pose.pose.orientation.z", "pose.pose.orientation.w"]
frame = "NED"
[signals.velocity]
topic = "/navigation/odometry"
fields = ["twist.twist.linear.x", "twist.twist.linear.y"]
unit = "m/s"
frame = "FRD"
[signals.yaw_rate]
topic = "/navigation/odometry"
field = "twist.twist.angular.z"
unit = "rad/s"
frame = "FRD"
[signals.tau_d]
topic = "/control/tau_d"
fields = ["wrench.force.x", "wrench.force.y", "wrench.torque.z"]
unit = "N"
moment_unit = "N*m"
frame = "FRD\""""
