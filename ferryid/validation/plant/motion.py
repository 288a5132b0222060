"""Motion in six degrees of freedom, and one step of Dormand's and Prince's fifth-order rule."""

from __future__ import annotations

from math import cos, sin, tan
from typing import NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.air import AirConstants, air_load
from ferryid.validation.plant.effects.mooring import Mooring, mooring_load
from ferryid.validation.plant.effects.payload import Payload, boarding_load, share_aboard
from ferryid.validation.plant.effects.shallow_water import ADDED_MASS_SHARE, Bank, damping_factor
from ferryid.validation.plant.hull import HullConstants, coriolis, drag, restoring
from ferryid.validation.plant.thrusters import STATES, ThrusterConstants, thrust
from ferryid.validation.plant.vessels import RHO

BODY = 12
"""States of the body: north, east, down, roll, pitch, yaw, and the six velocities; the thrusters' follow."""


class World(NamedTuple):
    """Everything that acts, ready for compiled code."""

    hull: HullConstants
    air: AirConstants
    thrusters: ThrusterConstants
    payload: Payload
    mooring: Mooring
    bank: Bank


@compiled
def changes(
    world: World,
    t: float,
    y: Floats,
    order: Floats,
    flow: Floats,
    air: Floats,
    external: Floats,
    dy: Floats,
    parts: Floats,
) -> None:
    """Write the derivative of all states.

    Parameters
    ----------
    world
        What acts.
    t
        Time [s].
    y, dy
        States and their derivatives, shape (12 + 6 k,).
    order
        Of the thrusters, shape (k, 2).
    flow, air
        Where water and air go to, north and east [m/s], shape (2,).
    external
        Load from outside that is constant within a sample, such as that of waves, shape (6,).
    parts
        As of `thrust`.
    """
    north, east, down, roll, pitch, yaw = y[0], y[1], y[2], y[3], y[4], y[5]
    nu = y[6:12]
    cf, sf, ct, st, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    R = np.array(
        [
            [cp * ct, -sp * cf + cp * st * sf, sp * sf + cp * cf * st],
            [sp * ct, cp * cf + sf * st * sp, -cp * sf + st * sp * cf],
            [-st, ct * sf, ct * cf],
        ]
    )
    # By elements, here and below: an assignment of slices would bring in, and compile, all that makes the text of its errors.
    over_ground = R @ nu[0:3]
    for i in range(3):
        dy[i] = over_ground[i]
    dy[3] = nu[3] + (nu[4] * sf + nu[5] * cf) * tan(pitch)
    dy[4] = nu[4] * cf - nu[5] * sf
    dy[5] = (nu[4] * sf + nu[5] * cf) / ct
    # Water and air as the vessel meets them; the flow is the same everywhere, so it turns against the turning vessel.
    stream = R.T @ np.array([flow[0], flow[1], 0.0])
    through = nu.copy()
    for i in range(3):
        through[i] -= stream[i]
    stream_dot = np.zeros(6)
    stream_dot[0] = nu[5] * stream[1] - nu[4] * stream[2]
    stream_dot[1] = nu[3] * stream[2] - nu[5] * stream[0]
    stream_dot[2] = nu[4] * stream[0] - nu[3] * stream[1]
    load = np.zeros(6)
    shallow = damping_factor(world.bank, north, east)
    aboard = share_aboard(world.payload, t)
    sunk = aboard * world.payload.mass_kg / (RHO * world.hull.waterplane)
    deeper = 1.0 + sunk / world.hull.draught
    rigid = world.hull.rigid + aboard * world.payload.mass
    boarding_load(world.payload, t, nu, load)
    added = world.hull.added * (deeper * (1.0 + ADDED_MASS_SHARE * (shallow - 1.0)))
    coriolis(rigid, nu, load)
    coriolis(added, through, load)
    carried = added @ stream_dot
    for i in range(6):
        load[i] += carried[i]
    drag(world.hull, through, sunk, shallow, load)
    # Heave is counted from where the vessel floats with its load.
    restoring(world.hull, down, roll, pitch, load)
    overhead = R.T @ np.array([air[0], air[1], 0.0])
    air_load(world.air, overhead[0] - nu[0], overhead[1] - nu[1], load)
    mooring_load(world.mooring, t, north, east, R, load)
    for i in range(6):
        load[i] += external[i]
    k = len(world.thrusters.most)
    thrust(
        world.thrusters,
        t,
        y[BODY:].reshape(k, STATES),
        through,
        order,
        dy[BODY:].reshape(k, STATES),
        load,
        parts,
    )
    acceleration = np.linalg.solve(rigid + added, load)
    for i in range(6):
        dy[6 + i] = acceleration[i]


NODES = np.array([0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0])
A2 = 1.0 / 5.0
A = np.array(
    [
        [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
        [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0],
        [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0],
        [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    ]
)
"""Of the third stage to the sixth."""
B = np.array([35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0])


@compiled
def step(
    world: World,
    t: float,
    h: float,
    y: Floats,
    order: Floats,
    flow: Floats,
    air: Floats,
    external: Floats,
    parts: Floats,
) -> None:
    """Advance the states by h [s] in place; orders, flow, air and external load are constant. `parts`: at the start."""
    k, w, spare = np.zeros((6, len(y))), np.empty_like(y), np.zeros_like(parts)
    # One call in a loop, in six places it would be compiled six times; by elements, as each sum of arrays would be compiled.
    for stage in range(6):
        for i in range(len(y)):
            if stage == 0:
                w[i] = y[i]
            elif stage == 1:
                w[i] = y[i] + h * A2 * k[0, i]
            else:
                slope = A[stage - 2, 0] * k[0, i]
                for j in range(1, stage):
                    slope += A[stage - 2, j] * k[j, i]
                w[i] = y[i] + h * slope
        at_start = parts if stage == 0 else spare
        changes(world, t + NODES[stage] * h, w, order, flow, air, external, k[stage], at_start)
    for i in range(len(y)):
        y[i] += h * (B[0] * k[0, i] + B[2] * k[2, i] + B[3] * k[3, i] + B[4] * k[4, i] + B[5] * k[5, i])
