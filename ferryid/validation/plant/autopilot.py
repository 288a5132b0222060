"""The autopilot: a filtered set point, a controller with integral, and thrusters by the pseudo-inverse."""

from __future__ import annotations

from math import atan2, cos, floor, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.vessels import Vessel

REST = 0.01
"""Share of its most thrust below which an azimuth stays where it points."""


class Tuning(NamedTuple):
    """Gains of position, velocity and integral, masses and most force, shape (3,); thrusters; the set point's filter."""

    stiff: Floats
    damp: Floats
    integral: Floats
    mass: Floats
    most: Floats
    shares: Floats
    first: NDArray[np.int64]
    turns: NDArray[np.bool_]
    ahead: Floats
    astern: Floats
    most_rpm: Floats
    omega: float
    speed: float
    turn: float


def tuning(vessel: Vessel) -> Tuning:
    """Return the gains of a vessel, from its masses and bandwidth."""
    added = vessel.added
    inertia = vessel.mass * vessel.k_zz**2
    mass = np.array([vessel.mass + added["11"], vessel.mass + added["22"], inertia + added["66"]])
    omega = np.array([1.0, 1.0, 1.5]) * vessel.omega
    columns: list[list[float]] = []
    first = []
    for one in vessel.thrusters:
        first.append(len(columns))
        angles = (0.0, 90.0) if one.angle_deg is None else (one.angle_deg,)
        for angle in angles:
            c, s = cos(radians(angle)), sin(radians(angle))
            columns.append([c, s, one.x * s - one.y * c])
    # Moments count by half a length.
    scale = np.array([1.0, 1.0, 2.0 / vessel.length])
    shares = np.linalg.pinv(scale[:, None] * np.array(columns).T) * scale
    full = sum(one.ahead * one.most_rpm**2 for one in vessel.thrusters)
    return Tuning(
        mass * omega**2,
        2.0 * 0.9 * mass * omega,
        mass * omega**3 * 0.12,
        mass,
        np.array([0.8, 0.8, 0.4 * vessel.length]) * full,
        shares,
        np.array(first),
        np.array([one.angle_deg is None for one in vessel.thrusters]),
        np.array([one.ahead for one in vessel.thrusters]),
        np.array([one.astern for one in vessel.thrusters]),
        np.array([one.most_rpm for one in vessel.thrusters]),
        1.6 * vessel.omega,
        vessel.speed_mps,
        radians(vessel.turn_degps),
    )


@compiled
def steer(tune: Tuning, h: float, target: Floats, seen: Floats, memory: Floats, order: Floats, wanted: Floats) -> None:
    """Take one step of the autopilot.

    Parameters
    ----------
    tune
        From `tuning`.
    h
        Its period [s].
    target
        Set point: north, east [m] and heading [rad], unwrapped, shape (3,).
    seen
        What the navigation reports: north, east, heading, surge, sway, yaw rate, shape (6,).
    memory
        Filtered set point, its rate, and the integral, shape (3, 3).
    order
        Speed [rpm] and angle [rad] of each thruster, shape (k, 2).
    wanted
        Force that is asked for [N, N, N·m], shape (3,).
    """
    goal, rate, whole = memory[0], memory[1], memory[2]
    before = rate.copy()
    for j in range(3):
        rate[j] += h * (tune.omega**2 * (target[j] - goal[j]) - 2.0 * tune.omega * rate[j])
    pace = sqrt(rate[0] ** 2 + rate[1] ** 2)
    if pace > tune.speed:
        rate[0] *= tune.speed / pace
        rate[1] *= tune.speed / pace
    rate[2] = min(max(rate[2], -tune.turn), tune.turn)
    for j in range(3):
        goal[j] += h * rate[j]
    hurry = (rate - before) / h
    c, s = cos(seen[2]), sin(seen[2])
    north, east, turn = seen[0] - goal[0], seen[1] - goal[1], seen[2] - goal[2]
    turn -= 2.0 * pi * floor((turn + pi) / (2.0 * pi))
    whole[0] += h * north
    whole[1] += h * east
    whole[2] += h * turn
    for j in range(3):
        # A fifth of the most force, so that it does not wind up.
        limit = 0.25 * tune.most[j] / tune.integral[j]
        whole[j] = min(max(whole[j], -limit), limit)
    off = (c * north + s * east, c * east - s * north, turn)
    summed = (c * whole[0] + s * whole[1], c * whole[1] - s * whole[0], whole[2])
    way = (c * rate[0] + s * rate[1], c * rate[1] - s * rate[0], rate[2])
    push = (c * hurry[0] + s * hurry[1], c * hurry[1] - s * hurry[0], hurry[2])
    for j in range(3):
        force = tune.mass[j] * push[j] - tune.stiff[j] * off[j] - tune.damp[j] * (seen[3 + j] - way[j])
        force -= tune.integral[j] * summed[j]
        wanted[j] = min(max(force, -tune.most[j]), tune.most[j])
    for i in range(len(tune.turns)):
        row = tune.first[i]
        push_along = tune.shares[row] @ wanted
        full = tune.ahead[i] * tune.most_rpm[i] ** 2
        if tune.turns[i]:
            across = tune.shares[row + 1] @ wanted
            along = push_along
            push_along = sqrt(along * along + across * across)
            if push_along > REST * full:
                order[i, 1] = atan2(across, along)
        coefficient = tune.ahead[i] if push_along >= 0.0 else tune.astern[i]
        speed = min(sqrt(abs(push_along) / coefficient), tune.most_rpm[i])
        order[i, 0] = speed if push_along >= 0.0 else -speed
