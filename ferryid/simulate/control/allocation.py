"""Thrust allocation: the orders to all actuators that together give a desired force."""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import borrowing
from ferryid.errors import FerryIdError
from ferryid.simulate.control.angle import shorter_way
from ferryid.simulate.plant.thrust import Curves, largest_force, speed_for
from ferryid.types import Floats
from ferryid.vessel.profile import Actuator, Profile

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario

Pair = tuple[float, float]
Triple = tuple[float, float, float]

NONE, NSCA, PSEUDO_INVERSE = 0, 1, 2

HELD_BELOW = 1.0 / 60.0
"""An azimuth thruster asked for less than this share of its largest force keeps its angle: a direction means nothing
without a force. 8 N for milliAmpère."""

_SINGULAR = 1e-9


class Allocation(NamedTuple):
    """How a desired force is shared out between k actuators.

    Attributes
    ----------
    kind
        NONE (a manoeuvre gives the orders), NSCA or PSEUDO_INVERSE.
    curves
        Forces over speeds.
    x
        Distance forward of the body origin [m], shape (k,).
    turns
        True for azimuth thrusters, shape (k,).
    shares
        Pseudo-inverse of the extended thrust configuration: surge and sway force of an azimuth thruster, or the force of a
        fixed one (second row unused), for each unit of desired force, shape (k, 2, 3).
    """

    kind: int
    curves: Curves
    x: Floats
    turns: NDArray[np.bool_]
    shares: Floats


def build_allocation(scenario: Scenario, profile: Profile, curves: Curves) -> Allocation:
    """Return the allocation that ``[controller]`` asks for: ``auto`` takes NSCA where the vessel has its layout.

    Raises
    ------
    FerryIdError
        When the actuators cannot give force in every direction, or NSCA is asked for without its layout.
    """
    actuators = profile.actuators
    k = len(actuators)
    x = np.array([actuator.position_m[0] for actuator in actuators])
    turns = np.array([actuator.kind == "azimuth" for actuator in actuators])
    if scenario.manoeuvre.kind:
        return Allocation(NONE, curves, x, turns, np.zeros((k, 2, 3)))
    wanted = scenario.controller.allocation
    fits = k == 2 and bool(turns.all()) and x[0] != x[1] and all(a.position_m[1] == 0.0 for a in actuators)
    if wanted == "nsca" and not fits:
        raise FerryIdError(
            f"{scenario.where}: NSCA allocation needs two azimuth thrusters on the centre line, found "
            f'{_listed(actuators)} on {profile.name}. Fix: use allocation = "pseudo-inverse"'
        )
    if any(actuator.kind == "propeller_rudder" for actuator in actuators):
        raise FerryIdError(
            f"{scenario.where}: a path needs force in every direction, and no force is allocated to a rudder, found "
            f"{_listed(actuators)} on {profile.name}. Fix: give [manoeuvre] in place of [path], or choose another vessel"
        )
    shares = _pseudo_inverse(actuators)
    if shares is None:
        raise FerryIdError(
            f"{scenario.where}: a path needs actuators that push ahead, across and round independently, found "
            f"{_listed(actuators)} on {profile.name}. Fix: give [manoeuvre] in place of [path], or choose another vessel"
        )
    return Allocation(NSCA if fits and wanted != "pseudo-inverse" else PSEUDO_INVERSE, curves, x, turns, shares)


def pushes_every_way(actuators: tuple[Actuator, ...]) -> bool:
    """Return whether a force in every direction can be allocated to actuators, so that they can follow a path."""
    return not any(one.kind == "propeller_rudder" for one in actuators) and _pseudo_inverse(actuators) is not None


def _listed(actuators: tuple[Actuator, ...]) -> str:
    return ", ".join(f"{actuator.kind} at {actuator.position_m}" for actuator in actuators) or "none"


def _pseudo_inverse(actuators: tuple[Actuator, ...]) -> Floats | None:
    """Return ``T^T (T T^T)^-1``, the smallest forces that sum to a desired one, or None where there are none.

    In plain arithmetic, as LAPACK's last digits depend on the machine. Moments are in units of the longest lever, so that
    "nearly singular" means the same for every size of vessel.
    """
    lever = max((max(abs(actuator.position_m[0]), abs(actuator.position_m[1])) for actuator in actuators), default=0.0)
    if lever == 0.0:
        return None
    columns = [
        [
            (c, s, (actuator.position_m[0] * s - actuator.position_m[1] * c) / lever)
            for c, s in (((1.0, 0.0), (0.0, 1.0)) if actuator.kind == "azimuth" else (_direction(actuator),))
        ]
        for actuator in actuators
    ]
    flat = [column for part in columns for column in part]
    G: list[list[float]] = [[sum(column[i] * column[j] for column in flat) for j in range(3)] for i in range(3)]
    inverse = _inverse(G)
    if inverse is None:
        return None
    shares = np.zeros((len(actuators), 2, 3))
    for i, part in enumerate(columns):
        for row, column in enumerate(part):
            for j in range(3):
                total = sum(column[m] * inverse[m][j] for m in range(3))
                shares[i, row, j] = total / lever if j == 2 else total
    return shares


def _direction(actuator: Actuator) -> Pair:
    """Return cosine and sine of a fixed actuator's direction, exact across."""
    return (0.0, 1.0) if actuator.kind == "tunnel" else (cos(actuator.angle_rad), sin(actuator.angle_rad))


def _inverse(G: list[list[float]]) -> list[list[float]] | None:
    """Return the inverse of a symmetric 3 x 3 matrix by cofactors, None where it has none to speak of."""

    def cofactor(i: int, j: int) -> float:
        a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        return G[a][c] * G[b][d] - G[a][d] * G[b][c]

    det = sum(G[0][j] * cofactor(0, j) for j in range(3))
    size = (G[0][0] + G[1][1] + G[2][2]) / 3.0
    if det <= _SINGULAR * size * size * size:
        return None
    return [[cofactor(j, i) / det for j in range(3)] for i in range(3)]


@borrowing
def allocate(allocation: Allocation, tau_d: Triple, before: Floats, after: Floats) -> bool:
    """Write the orders that give a desired force, and return whether it had to be shortened.

    Parameters
    ----------
    allocation
        From `build_allocation`.
    tau_d
        Desired force [N, N, N·m].
    before
        The last orders, speed [rpm; N for a direct force] and angle [rad], shape (k, 2); angles turn the shorter way from
        there.
    after
        New orders, shape (k, 2), overwritten.

    Notes
    -----
    NSCA shortens the force of each thruster out of reach on its own and keeps that force's direction. The pseudo-inverse
    shortens all forces by one factor, which keeps the direction of `tau_d`; only thrusters that have no
    force at all on the side asked for are left out of it.

    References
    ----------
    Torben et al. (2019); Aurlien (2021), (2.30)-(2.32), whose sign order is another. Fossen (2021), section 11.2.
    """
    if allocation.kind == NSCA:
        return _nsca(allocation, tau_d, before, after)
    k = len(before)
    factor = 1.0
    saturated = False
    for i in range(k):
        along, across = _part(allocation, i, tau_d)
        size = sqrt(along * along + across * across)
        largest = largest_force(allocation.curves, i, bool(allocation.turns[i]) or along >= 0.0)
        if size > largest:
            saturated = True
            if largest > 0.0:
                factor = min(factor, largest / size)
    for i in range(k):
        along, across = _part(allocation, i, tau_d)
        if allocation.turns[i]:
            _order_azimuth(allocation.curves, i, factor * along, factor * across, before, after)
        else:
            after[i, 0], after[i, 1] = speed_for(allocation.curves, i, factor * along), before[i, 1]
    return saturated


@borrowing
def _nsca(allocation: Allocation, tau_d: Triple, before: Floats, after: Floats) -> bool:
    """Share between two azimuth thrusters on the centre line, at unequal distances as well.

    Thruster forces are ``F_x = X_d / 2`` each, ``F_1y = (L Y_d + N_d) / 2L`` and ``F_2y = (L Y_d - N_d) / 2L`` for +-L.
    """
    x0, x1 = allocation.x[0], allocation.x[1]
    span = x0 - x1
    along = 0.5 * tau_d[0]
    sides = ((tau_d[2] - x1 * tau_d[1]) / span, (x0 * tau_d[1] - tau_d[2]) / span)
    saturated = False
    for i in range(2):
        size = _order_azimuth(allocation.curves, i, along, sides[i], before, after)
        saturated = saturated or size > largest_force(allocation.curves, i, True)
    return saturated


@borrowing
def _order_azimuth(curves: Curves, i: int, along: float, across: float, before: Floats, after: Floats) -> float:
    """Order a surge and sway force of azimuth thruster i and return its size [N].

    One that keeps its angle gives the part of the force that lies along it, and nothing where that would be against it.
    """
    size = sqrt(along * along + across * across)
    push, angle = size, before[i, 1]
    if size > HELD_BELOW * largest_force(curves, i, True):
        angle += shorter_way(atan2(across, along) - angle)
    else:
        push = max(along * cos(angle) + across * sin(angle), 0.0)
    after[i, 0], after[i, 1] = speed_for(curves, i, push), angle
    return float(size)


@borrowing
def _part(allocation: Allocation, i: int, tau: Triple) -> Pair:
    """Return surge and sway force of azimuth thruster i, or the force of a fixed actuator and 0 [N]."""
    P = allocation.shares[i]
    return (
        P[0, 0] * tau[0] + P[0, 1] * tau[1] + P[0, 2] * tau[2],
        P[1, 0] * tau[0] + P[1, 1] * tau[1] + P[1, 2] * tau[2],
    )
