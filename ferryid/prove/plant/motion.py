"""Motion in six degrees of freedom, and one step of Dormand's and Prince's fifth-order rule."""

from __future__ import annotations

from math import cos, sin, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import compiled
from ferryid.prove.plant.air import AirConstants, air_load
from ferryid.prove.plant.hull import HullConstants, coriolis, drag, restoring
from ferryid.prove.plant.propellers import STATES, ThrusterConstants, thrust
from ferryid.prove.plant.vessels import RHO

Floats = NDArray[np.float64]
BODY = 12
"""States of the body: north, east, down, roll, pitch, yaw, and the six velocities; the thrusters' follow."""
BOARDING_S = 6.0
"""Time in which a load comes aboard, piece by piece, or leaves."""
BANK_M = 3.0
"""Over how many metres a bank rises."""
HEAVIER = 0.3
"""Share of the growth of damping by which added mass grows over a bank."""
STIFFER_M = 40.0
"""Distance at which a mooring line is a tenth stiffer than at rest."""


class World(NamedTuple):
    """Everything that acts, ready for compiled code."""

    hull: HullConstants
    air: AirConstants
    gear: ThrusterConstants
    fouling: Floats
    load_kg: float
    load_mass: Floats
    load_span: Floats
    mooring: Floats
    mooring_span: Floats
    bank: float
    bank_m: Floats


@compiled
def shallowness(world: World, north: float, east: float) -> float:
    """Return the factor on damping at a place: cosine slopes at the ends of the bank."""
    if world.bank == 1.0:
        return 1.0
    inside = 1.0
    for low, high, at in ((world.bank_m[0], world.bank_m[1], north), (world.bank_m[2], world.bank_m[3], east)):
        depth = min(at - low, high - at) / BANK_M + 0.5
        inside *= 0.5 - 0.5 * cos(np.pi * min(max(depth, 0.0), 1.0))
    return 1.0 + (world.bank - 1.0) * inside


@compiled
def changes(
    world: World, t: float, y: Floats, order: Floats, flow: Floats, air: Floats, sea: Floats, dy: Floats, parts: Floats
) -> None:
    """Write the derivative of all states.

    Parameters
    ----------
    world
        What acts.
    t
        Time [s].
    y, dy
        States and their derivatives, shape (12 + 5 k,).
    order
        Of the thrusters, shape (k, 2).
    flow, air
        Where water and air go to, north and east [m/s], shape (2,).
    sea
        Load of the waves, shape (6,).
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
    dy[0:3] = R @ nu[0:3]
    dy[3] = nu[3] + (nu[4] * sf + nu[5] * cf) * tan(pitch)
    dy[4] = nu[4] * cf - nu[5] * sf
    dy[5] = (nu[4] * sf + nu[5] * cf) / ct
    # Water and air as the vessel meets them; the flow is the same everywhere, so it turns against the turning vessel.
    stream = R.T @ np.array([flow[0], flow[1], 0.0])
    through = nu.copy()
    through[0:3] -= stream
    stream_dot = np.zeros(6)
    stream_dot[0] = nu[5] * stream[1] - nu[4] * stream[2]
    stream_dot[1] = nu[3] * stream[2] - nu[5] * stream[0]
    stream_dot[2] = nu[4] * stream[0] - nu[3] * stream[1]
    load = np.zeros(6)
    shallow = shallowness(world, north, east)
    boarded = (t - world.load_span[0]) / BOARDING_S + 0.5
    left = (t - world.load_span[1]) / BOARDING_S + 0.5
    aboard = min(max(boarded, 0.0), 1.0) - min(max(left, 0.0), 1.0)
    sunk = aboard * world.load_kg / (RHO * world.hull.waterplane)
    deeper = 1.0 + sunk / world.hull.draught
    rigid = world.hull.rigid + aboard * world.load_mass
    if 0.0 < boarded < 1.0:
        # What comes aboard lay still over ground, and takes its momentum from the vessel; what leaves keeps what it has.
        load -= world.load_mass @ nu / BOARDING_S
    added = world.hull.added * (deeper * (1.0 + HEAVIER * (shallow - 1.0)))
    coriolis(rigid, nu, load)
    coriolis(added, through, load)
    load += added @ stream_dot
    drag(world.hull, through, sunk, world.fouling, shallow, load)
    # Heave is counted from where the vessel floats with its load.
    restoring(world.hull, down, roll, pitch, load)
    overhead = R.T @ np.array([air[0], air[1], 0.0])
    air_load(world.air, overhead[0] - nu[0], overhead[1] - nu[1], load)
    if world.mooring[0] + world.mooring[1] > 0.0 and world.mooring_span[0] <= t < world.mooring_span[1]:
        dn, de = north - world.mooring[2], east - world.mooring[3]
        stiffer = 1.0 + 0.1 * (dn * dn + de * de) / STIFFER_M**2
        pull = R.T @ np.array([-world.mooring[0] * dn * stiffer, -world.mooring[1] * de * stiffer, 0.0])
        load[0:3] += pull
    load += sea
    k = len(world.gear.most)
    thrust(
        world.gear,
        t,
        y[BODY:].reshape(k, STATES),
        through,
        order,
        dy[BODY:].reshape(k, STATES),
        load,
        parts,
    )
    dy[6:12] = np.linalg.solve(rigid + added, load)


A2 = 1.0 / 5.0
A3 = np.array([3.0 / 40.0, 9.0 / 40.0])
A4 = np.array([44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0])
A5 = np.array([19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0])
A6 = np.array([9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0])
B = np.array([35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0])


@compiled
def step(
    world: World, t: float, h: float, y: Floats, order: Floats, flow: Floats, air: Floats, sea: Floats, parts: Floats
) -> None:
    """Advance the states by h [s] in place; orders, flow, air and sea stand meanwhile. `parts` are those at the start."""
    n = len(y)
    k1, k2, k3, k4, k5, k6 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    spare = np.zeros_like(parts)
    changes(world, t, y, order, flow, air, sea, k1, parts)
    changes(world, t + 0.2 * h, y + h * A2 * k1, order, flow, air, sea, k2, spare)
    changes(world, t + 0.3 * h, y + h * (A3[0] * k1 + A3[1] * k2), order, flow, air, sea, k3, spare)
    changes(world, t + 0.8 * h, y + h * (A4[0] * k1 + A4[1] * k2 + A4[2] * k3), order, flow, air, sea, k4, spare)
    w = y + h * (A5[0] * k1 + A5[1] * k2 + A5[2] * k3 + A5[3] * k4)
    changes(world, t + 8.0 / 9.0 * h, w, order, flow, air, sea, k5, spare)
    w = y + h * (A6[0] * k1 + A6[1] * k2 + A6[2] * k3 + A6[3] * k4 + A6[4] * k5)
    changes(world, t + h, w, order, flow, air, sea, k6, spare)
    y += h * (B[0] * k1 + B[2] * k3 + B[3] * k4 + B[4] * k5 + B[5] * k6)
