"""One trial: the vessel under its autopilot, in its conditions, as its instruments see it."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import compiled
from ferryid.prove.plant.air import air_constants, gusts
from ferryid.prove.plant.autopilot import Tuning, steer, tuning
from ferryid.prove.plant.conditions import Conditions
from ferryid.prove.plant.hull import hull_constants, rigid_mass
from ferryid.prove.plant.motion import BODY, World, step
from ferryid.prove.plant.navigation import HEIGHT_M, RATE_HZ, Errors, instrument_errors, navigate
from ferryid.prove.plant.paths import DWELL_S, set_points
from ferryid.prove.plant.propellers import LAG_RATE, STATES, thruster_constants
from ferryid.prove.plant.sea import SeaConstants, sea_constants, sea_load
from ferryid.prove.plant.vessels import Vessel

Floats = NDArray[np.float64]
CONTROL_EVERY = 2
"""Samples of the navigation in a period of the autopilot: 10 Hz."""


@dataclass(frozen=True)
class Voyage:
    """What happened, by sample of the navigation.

    Attributes
    ----------
    t
        Time [s], shape (n,).
    reported
        North, east [m], heading [rad], surge, sway [m/s] and yaw rate [rad/s] as navigation tells them, shape (n, 6).
    states
        True states: see `ferryid.prove.plant.motion`, shape (n, 12 + 5 k).
    orders
        Speed [rpm] and angle [rad] asked of each thruster, shape (n, k, 2).
    wanted
        Force that the autopilot asked for, shape (n, 3).
    waves
        Load of the waves, shape (n, 6).
    thrust
        Of each thruster: its force [N], what it would be without inflow [N], and its inflow [m/s], shape (n, k, 3).
    """

    t: Floats
    reported: Floats
    states: Floats
    orders: Floats
    wanted: Floats
    waves: Floats
    thrust: Floats


def sail(vessel: Vessel, conditions: Conditions, path: str, seed: int) -> Voyage:
    """Return a trial of a vessel; the same for the same arguments.

    Parameters
    ----------
    vessel
        Of `ferryid.prove.plant.vessels`.
    conditions
        What acts on it.
    path
        One of `ferryid.prove.plant.paths.PATHS`.
    seed
        Of the path, the weather and the noise, each by a stream of its own.
    """
    paths, weather, sea, noise = (np.random.default_rng([seed, number]) for number in range(4))
    goals = set_points(path, vessel, paths)
    n = int(len(goals) * DWELL_S * RATE_HZ)
    t = np.arange(n) / RATE_HZ
    air = np.array(conditions.wind) + gusts(weather, t, conditions.gust_std, conditions.gust_time)
    if conditions.wind_series:
        at, north, east = np.array(conditions.wind_series).T
        air = air + np.column_stack([np.interp(t, at, north), np.interp(t, at, east)])
    turn = np.radians(conditions.current_turn) * t / 60.0
    north, east = conditions.current
    flow = np.column_stack([np.cos(turn) * north - np.sin(turn) * east, np.sin(turn) * north + np.cos(turn) * east])
    kilograms, ahead, above = conditions.payload
    world = World(
        hull_constants(vessel),
        air_constants(vessel),
        thruster_constants(vessel, conditions),
        np.array(conditions.fouling),
        kilograms,
        rigid_mass(kilograms, ahead, -above, np.zeros((3, 3))),
        # What was aboard from the start never came.
        np.array([conditions.payload_span[0] or -1e9, conditions.payload_span[1]]),
        np.array(conditions.mooring),
        np.array(conditions.mooring_span),
        conditions.shallow,
        np.array(conditions.shallow_m),
    )
    k = len(vessel.thrusters)
    voyage = Voyage(
        t,
        np.zeros((n, 6)),
        np.zeros((n, BODY + STATES * k)),
        np.zeros((n, k, 2)),
        np.zeros((n, 3)),
        np.zeros((n, 6)),
        np.zeros((n, k, 3)),
    )
    start = np.zeros(BODY + STATES * k)
    for i, one in enumerate(vessel.thrusters):
        start[BODY + STATES * i + 1] = radians(one.angle_deg or 0.0)
    marks = np.array(
        [
            radians(conditions.heading_bias_deg),
            conditions.lever_m[0],
            conditions.lever_m[1],
            conditions.yaw_rate_factor,
            round(conditions.delay_s * RATE_HZ),
        ]
    )
    _run(
        world,
        tuning(vessel),
        instrument_errors(noise, n, conditions.noise),
        sea_constants(sea, vessel, conditions),
        goals,
        air,
        flow,
        marks,
        _steps(conditions),
        start,
        voyage.reported,
        voyage.states,
        voyage.orders,
        voyage.wanted,
        voyage.waves,
        voyage.thrust,
    )
    return voyage


def _steps(conditions: Conditions) -> int:
    """Return the integrator's steps in a sample of the navigation: none is longer than the memory of a thruster's lag."""
    return 1 if conditions.lag_s == 0.0 else max(1, ceil(LAG_RATE / (conditions.lag_s * RATE_HZ)))


@compiled
def _run(
    world: World,
    tune: Tuning,
    errors: Errors,
    sea: SeaConstants,
    goals: Floats,
    air: Floats,
    flow: Floats,
    marks: Floats,
    steps: int,
    y: Floats,
    reported: Floats,
    states: Floats,
    orders: Floats,
    wanted: Floats,
    waves: Floats,
    thrust: Floats,
) -> None:
    n, k = orders.shape[0], orders.shape[1]
    h = 1.0 / RATE_HZ
    order = np.zeros((k, 2))
    for i in range(k):
        order[i, 1] = y[BODY + STATES * i + 1]
    observer, helm, asked = np.zeros(7), np.zeros((3, 3)), np.zeros(3)
    pose, rates, before, pushed, seen = np.zeros(3), np.zeros(3), np.zeros(2), np.zeros(2), np.zeros(6)
    bias, ahead, aside, factor, late = marks[0], marks[1], marks[2], marks[3], int(marks[4])
    for row in range(n):
        _sensed(y, pose, rates)
        for j in range(2):
            pushed[j] = (rates[j] - before[j]) / h if row > 0 else 0.0
            before[j] = rates[j]
        navigate(errors, row, h, pose, rates, pushed, observer, seen)
        # As it is told: about another point, with a heading that is off and a gyro that is off.
        c, s = cos(seen[2]), sin(seen[2])
        u, v = seen[3] - seen[5] * aside, seen[4] + seen[5] * ahead
        reported[row, 0] = seen[0] + c * ahead - s * aside
        reported[row, 1] = seen[1] + s * ahead + c * aside
        reported[row, 2] = seen[2] + bias
        reported[row, 3] = cos(bias) * u + sin(bias) * v
        reported[row, 4] = cos(bias) * v - sin(bias) * u
        reported[row, 5] = factor * seen[5]
        states[row] = y
        if row % CONTROL_EVERY == 0:
            goal = goals[min(int(row * h / DWELL_S), len(goals) - 1)]
            steer(tune, h * CONTROL_EVERY, goal, reported[max(row - late, 0)], helm, order, asked)
        orders[row] = order
        wanted[row] = asked
        sea_load(sea, (row + 0.5) * h, y[0], y[1], y[5], waves[row])
        for part in range(steps):
            step(world, (row + part / steps) * h, h / steps, y, order, flow[row], air[row], waves[row], thrust[row])


@compiled
def _sensed(y: Floats, pose: Floats, rates: Floats) -> None:
    """Write where the instruments are and how they move over ground: they sit above the origin."""
    roll, pitch, yaw = y[3], y[4], y[5]
    u, v, w, p, q, r = y[6], y[7], y[8], y[9], y[10], y[11]
    u -= q * HEIGHT_M
    v += p * HEIGHT_M
    cf, sf, ct, st, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    rates[0] = cp * ct * u + (cp * st * sf - sp * cf) * v + (sp * sf + cp * cf * st) * w
    rates[1] = sp * ct * u + (cp * cf + sf * st * sp) * v + (st * sp * cf - cp * sf) * w
    rates[2] = (q * sf + r * cf) / ct
    pose[0] = y[0] - HEIGHT_M * (sp * sf + cp * cf * st)
    pose[1] = y[1] - HEIGHT_M * (st * sp * cf - cp * sf)
    pose[2] = yaw
