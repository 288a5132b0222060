"""How fast a vessel moves along and about its axes, and how much room it has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, hypot, isfinite, sin

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.simulate.plant.thrust import curves_of, largest_force
from ferryid.types import Floats
from ferryid.vessel.dimensions import dimensions
from ferryid.vessel.profile import Profile

USED = 0.6
"""Share of the largest forces that a plan counts on: the rest is left to the controller, and to wind and current."""
HULL_SPEED = 0.3
"""Froude number that no plan exceeds: beyond, waves of the vessel's own change its resistance."""
FASTEST_TURN = 0.35
"""Yaw rate that no plan exceeds, times the root of gravity over length."""
LEAST_ROOM = 3.0
"""Shorter side of an area, in lengths of the vessel, below which there is no room for circles."""
MOST_ROOM = 40.0
"""Longer side of an area, in lengths of the vessel, beyond which more room is not used."""
CLEARANCE = 0.1
"""Room between a path's hull and the area's sides, in lengths: a vessel wanders about its path, in no two runs alike."""
GRAVITY = 9.81


@dataclass(frozen=True)
class Limits:
    """Speeds and accelerations of a plan along and about the vessel's axes, and its room.

    Attributes
    ----------
    speed
        Surge, sway [m/s] and yaw rate [rad/s] that the forces keep up.
    acceleration
        From rest [m/s², m/s², rad/s²].
    long, wide
        Half of the area's sides, less half a length of the vessel and the clearance [m].
    """

    speed: tuple[float, float, float]
    acceleration: tuple[float, float, float]
    long: float
    wide: float


def limits_of(vessel: Profile, area: tuple[float, float]) -> Limits:
    """Return what a vessel can do in an area.

    Parameters
    ----------
    vessel
        With a hull model, and thrust curves that end.
    area
        Length and breadth [m].

    Raises
    ------
    FerryIdError
        For an area without room for a circle.
    """
    length = dimensions(vessel)[0]
    if not all(isfinite(side) and side > 0.0 for side in area):
        raise FerryIdError(f"--area: has two sides above 0 m, found {area[0]:g}x{area[1]:g}. Fix: give them as 60x40")
    if min(area) < LEAST_ROOM * length:
        least = LEAST_ROOM * length
        raise FerryIdError(
            f"--area: {area[0]:g}x{area[1]:g} m has no room for the turning circle of {vessel.name}, {length:.3g} m long. "
            f"Fix: give at least {least:.0f}x{least:.0f}"
        )
    surge, sway, yaw = _forces(vessel)
    M, D = vessel.hull.M, vessel.hull.D
    top = HULL_SPEED * (GRAVITY * length) ** 0.5
    speed = (
        min(_steady(surge, D, "X_u", "X_|u|u", "X_uuu"), top),
        min(_steady(sway, D, "Y_v", "Y_|v|v", "Y_vvv"), top),
        min(_steady(yaw, D, "N_r", "N_|r|r", "N_rrr"), FASTEST_TURN * (GRAVITY / length) ** 0.5),
    )
    acceleration = (surge / float(M[0, 0]), sway / float(M[1, 1]), yaw / float(M[2, 2]))
    used = [min(side, MOST_ROOM * length) for side in sorted(area, reverse=True)]
    long, wide = (0.5 * (side - length) - CLEARANCE * length for side in used)
    return Limits(speed, acceleration, long, wide)


def within(poses: Floats, area: tuple[float, float], size: tuple[float, float]) -> bool:
    """Tell whether a hull stays in an area, about its middle and its longer side to the north.

    Parameters
    ----------
    poses
        North, east [m] and heading [rad], shape (n, 3).
    area
        Its sides [m].
    size
        Length and beam of the hull [m].
    """
    long, wide = sorted(area, reverse=True)
    north, east = np.abs(poses[:, :2]).T + _half(poses, size)
    return bool(north.max() <= 0.5 * long and east.max() <= 0.5 * wide)


def room_of(poses: Floats, size: tuple[float, float]) -> tuple[float, float]:
    """Return the sides [m] of the area that a hull takes, the longer first, with sides to the north and east.

    Parameters
    ----------
    poses, size
        As of `within`.
    """
    half = _half(poses, size)
    least, most = (poses[:, :2].T - half).min(axis=1), (poses[:, :2].T + half).max(axis=1)
    short, long = sorted((most - least).tolist())
    return long, short


def _half(poses: Floats, size: tuple[float, float]) -> Floats:
    """Return how far a hull reaches north and east of its middle [m], shape (2, n)."""
    c, s = np.abs(np.cos(poses[:, 2])), np.abs(np.sin(poses[:, 2]))
    return 0.5 * np.stack([c * size[0] + s * size[1], s * size[0] + c * size[1]])


def _forces(vessel: Profile) -> tuple[float, float, float]:
    """Return the forces [N] and the moment [N·m] that all actuators together keep up along and about the axes."""
    curves = curves_of(vessel)
    surge = sway = yaw = 0.0
    for k, one in enumerate(vessel.actuators):
        force = min(largest_force(curves, k, ahead) for ahead in (True, False))
        if one.kind == "azimuth":
            # It turns round and need not run astern.
            force = largest_force(curves, k, True)
        if not isfinite(force):
            force = 0.1 * vessel.hull.mass_kg / len(vessel.actuators)
        x, y = one.position_m[:2]
        if one.kind == "azimuth":
            surge, sway, yaw = surge + force, sway + force, yaw + force * hypot(x, y)
            continue
        if abs(cos(one.angle_rad)) > abs(sin(one.angle_rad)):
            surge, yaw = surge + force, yaw + force * abs(y)
        else:
            sway, yaw = sway + force, yaw + force * abs(x)
    return USED * surge, USED * sway, USED * yaw


def _steady(force: float, D: Mapping[str, float], linear: str, quadratic: str, cubic: str) -> float:
    """Return the speed at which a hull's damping takes a force, by bisection."""
    a, b, c = (-float(D.get(name, 0.0)) for name in (linear, quadratic, cubic))
    low, high = 0.0, 1.0
    while a * high + b * high**2 + c * high**3 < force and high < 1e3:
        high *= 2.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if a * middle + b * middle**2 + c * middle**3 < force:
            low = middle
        else:
            high = middle
    return low
