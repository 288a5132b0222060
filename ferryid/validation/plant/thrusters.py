"""Thrusters with a memory: motor and steering, the race that takes time to form, inflow, and races that meet.

Thrust beyond the bollard's while the race forms after Blanke, Lindegaard and Fossen (2000); loss in another's race after
Ekstrom and Brown (2002), "Interactions between thrusters attached to a vessel hull".
"""

from __future__ import annotations

from math import cos, degrees, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.vessels import Vessel

STATES = 6
"""Of a thruster: speed [rpm], angle [rad], race [rpm], two of a force that is late [N], and the share of its disc in air."""
LAG_RATE = 2.0
"""Of each of two stages of a force that is late, over the rate of both together."""
MOTOR_S, RATE_S = 0.25, 0.9
"""Time constant of the motor, and time that it takes from rest to its most."""
STEER_S, STEER_RADPS = 0.15, radians(60.0)
RACE_SHARE = 0.25
"""Thrust that a race not yet formed gives besides."""
RACE_S = 0.08
"""Time in which it forms at full speed; longer at less."""
CORNER = 30.0
"""Power with which a thrust bends into a limit of its motor's current: 2 % are missing at the limit."""
FREE_OF_AIR = (0.0, 1e9)
"""Share of the force that air takes, and share of the most speed above which it is drawn, of a thruster that draws none."""
DRAWN_S, WASHED_S = 1.5, 0.6
"""Time constants with which air gathers in a propeller's disc, and with which it is washed out."""
AIR_BAND, AIR_INFLOW = 0.1, 0.1
"""Shares of the most speed: over which the disc fills, and by how much later it does at an inflow of 1 m/s."""
AT_SPEED = 0.6
"""Share of the most speed at which the loss to inflow is defined."""


class ThrusterConstants(NamedTuple):
    """Thrusters, ready for compiled code: places (k, 3), coefficients and most speeds (k,), losses, when a gain holds.

    `band` are speeds of the race ahead and astern below which there is no thrust [rpm], `limit` the most thrust either way [N],
    and `air` the share of the thrust that air takes and the share of the most speed above which it is drawn, shape (k, 2).
    """

    place: Floats
    ahead: Floats
    astern: Floats
    most: Floats
    turns: NDArray[np.bool_]
    gain: Floats
    gain_span: Floats
    offset: Floats
    lag_s: float
    inflow: float
    interaction: float
    band: Floats
    limit: Floats
    air: Floats


def thruster_constants(vessel: Vessel) -> ThrusterConstants:
    """Return a vessel's thrusters without a fault, ready for compiled code."""
    every = vessel.thrusters
    return ThrusterConstants(
        place=np.array([[one.x, one.y, one.z] for one in every]),
        ahead=np.array([one.ahead for one in every]),
        astern=np.array([one.astern for one in every]),
        most=np.array([one.most_rpm for one in every]),
        turns=np.array([one.angle_deg is None for one in every]),
        gain=np.ones(len(every)),
        gain_span=np.array([0.0, 1e9]),
        offset=np.zeros(len(every)),
        lag_s=0.0,
        inflow=0.0,
        interaction=0.0,
        band=np.zeros((len(every), 2)),
        limit=np.full((len(every), 2), 1e9),
        air=np.array([FREE_OF_AIR for _ in every]),
    )


@compiled
def thrust(
    gear: ThrusterConstants,
    t: float,
    state: Floats,
    nu: Floats,
    order: Floats,
    change: Floats,
    out: Floats,
    parts: Floats,
) -> None:
    """Write how the thrusters change, and add what they push [N, N·m].

    Parameters
    ----------
    gear
        From `thruster_constants`.
    t
        Time [s].
    state, change
        `STATES` of each, and their derivatives, shape (k, 6).
    nu
        Velocity through the water, shape (6,).
    order
        Speed [rpm] and angle [rad] of each, shape (k, 2).
    out
        Load on the hull, shape (6,).
    parts
        Force of each, and what it would be without inflow, and its inflow [m/s], shape (k, 3).
    """
    k = len(gear.most)
    for i in range(k):
        n, angle = state[i, 0], state[i, 1]
        most = gear.most[i]
        change[i, 0] = min(max((order[i, 0] - n) / MOTOR_S, -most / RATE_S), most / RATE_S)
        turn = order[i, 1] - angle
        turn -= 2.0 * pi * np.floor((turn + pi) / (2.0 * pi))
        change[i, 1] = min(max(turn / STEER_S, -STEER_RADPS), STEER_RADPS) if gear.turns[i] else 0.0
        change[i, 2] = (n - state[i, 2]) * (0.05 + abs(n) / most) / RACE_S
        coefficient = gear.ahead[i] if n >= 0.0 else gear.astern[i]
        push = coefficient * abs(n) * (n + RACE_SHARE * (n - state[i, 2]))
        x, y, z = gear.place[i]
        a = angle + gear.offset[i]
        along = (nu[0] - nu[5] * y + nu[4] * z) * cos(a) + (nu[1] + nu[5] * x - nu[3] * z) * sin(a)
        side = 0 if state[i, 2] >= 0.0 else 1
        # Blades that do not bite yet give nothing, whatever flows past them.
        bites = 1.0 if abs(state[i, 2]) >= gear.band[i, side] else 0.0
        push *= bites
        parts[i, 1] = _limited(gear, i, push)
        # Thrust falls linearly with the advance ratio: with n times inflow.
        push -= bites * gear.inflow * coefficient * AT_SPEED * most * abs(n) * along
        push = _limited(gear, i, push)
        # Loading grows with speed and falls with the inflow; air comes slower than it goes.
        full = (abs(n) / most - gear.air[i, 1] - AIR_INFLOW * abs(along)) / AIR_BAND
        full = min(max(full, 0.0), 1.0)
        change[i, 5] = (full - state[i, 5]) / (DRAWN_S if full > state[i, 5] else WASHED_S)
        kept = 1.0 - gear.air[i, 0] * state[i, 5]
        push *= kept
        parts[i, 1] *= kept
        if gear.gain_span[0] <= t < gear.gain_span[1]:
            push *= gear.gain[i]
            parts[i, 1] *= gear.gain[i]
        parts[i, 2] = along if push >= 0.0 else -along
        if gear.lag_s > 0.0:
            change[i, 3] = (push - state[i, 3]) * LAG_RATE / gear.lag_s
            change[i, 4] = (state[i, 3] - state[i, 4]) * LAG_RATE / gear.lag_s
            push = state[i, 4]
        parts[i, 0] = push
    for i in range(k):
        push = parts[i, 0]
        if gear.interaction > 0.0:
            for j in range(k):
                if j != i:
                    push *= _left(gear, state, parts, i, j)
        x, y, z = gear.place[i]
        a = state[i, 1] + gear.offset[i]
        X, Y = push * cos(a), push * sin(a)
        out[0] += X
        out[1] += Y
        out[3] -= z * Y
        out[4] += z * X
        out[5] += x * Y - y * X


@compiled
def _limited(gear: ThrusterConstants, i: int, push: float) -> float:
    """Return the thrust that the current of the motor allows."""
    limit = gear.limit[i, 0 if push >= 0.0 else 1]
    return float(push / (1.0 + (abs(push) / limit) ** CORNER) ** (1.0 / CORNER))


@compiled
def _left(gear: ThrusterConstants, state: Floats, parts: Floats, i: int, j: int) -> float:
    """Return the share of thruster i's thrust that the race of thruster j leaves it."""
    dx, dy = gear.place[i, 0] - gear.place[j, 0], gear.place[i, 1] - gear.place[j, 1]
    apart = sqrt(dx * dx + dy * dy)
    a = state[j, 1] + gear.offset[j]
    blows = -1.0 if parts[j, 0] >= 0.0 else 1.0
    toward = blows * (cos(a) * dx + sin(a) * dy) / apart
    if toward <= 0.0:
        return 1.0
    beside = degrees(np.arccos(min(toward, 1.0)))
    # The race of a thruster that hardly turns is none.
    strength = min(1.0, abs(parts[j, 0]) / (0.08 * gear.ahead[j] * gear.most[j] ** 2))
    t = max(1.0 - gear.interaction, 1e-3)
    left = t + (1.0 - t) * beside**3 / (130.0 / t**3 + beside**3)
    return float(1.0 - strength * (1.0 - left))
