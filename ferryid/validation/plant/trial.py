"""One trial: the vessel under its autopilot, in its conditions, as its instruments see it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, cos, radians, sin
from typing import NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.autopilot import Tuning, steer, tuning
from ferryid.validation.plant.effects import Conditions, complete_conditions
from ferryid.validation.plant.motion import BODY, World, step
from ferryid.validation.plant.navigation import HEIGHT_M, RATE_HZ, Errors, instrument_errors, navigate
from ferryid.validation.plant.paths import DWELL_S, set_points
from ferryid.validation.plant.plant import Plant, build_plant
from ferryid.validation.plant.thrusters import LAG_RATE, STATES
from ferryid.validation.plant.vessels import Vessel

CONTROL_EVERY = 2
"""Samples of the navigation in a period of the autopilot: 10 Hz."""
PATH_STREAM, NOISE_STREAM = 0, 3
"""Numbers of the random streams of path and instruments; those between are of effects."""


@dataclass(frozen=True)
class Trial:
    """What happened, by sample of the navigation.

    Attributes
    ----------
    plant
        The vessel in its conditions.
    t
        Time [s], shape (n,).
    reported
        North, east [m], heading [rad], surge, sway [m/s] and yaw rate [rad/s] as the navigation reports them, shape (n, 6).
    states
        True states: see `ferryid.validation.plant.motion`, shape (n, 12 + 6 k).
    orders
        Speed [rpm] and angle [rad] ordered of each thruster, shape (n, k, 2).
    wanted
        Force that the autopilot asked for, shape (n, 3).
    loads
        Loads from outside by effect, shape (n, 6).
    thrust
        Of each thruster: its force [N], what it would be without inflow [N], and its inflow [m/s], shape (n, k, 3).
    """

    plant: Plant
    t: Floats
    reported: Floats
    states: Floats
    orders: Floats
    wanted: Floats
    loads: Mapping[str, Floats]
    thrust: Floats


class _Setup(NamedTuple):
    """Inputs: world, autopilot, instruments, set points, air and water (n, 2), delay in samples, steps a sample."""

    world: World
    tune: Tuning
    errors: Errors
    goals: Floats
    air: Floats
    water: Floats
    late: int
    steps: int


class _Memory(NamedTuple):
    """States: vessel, navigation (7,), speed over ground (2,), autopilot (3, 3), order (k, 2), force asked for (3,)."""

    y: Floats
    observer: Floats
    speed: Floats
    helm: Floats
    order: Floats
    wanted: Floats


class _Log(NamedTuple):
    """What is recorded, as in `Trial`; `external` is the sum of the loads from outside (n, 6)."""

    reported: Floats
    states: Floats
    orders: Floats
    wanted: Floats
    external: Floats
    thrust: Floats


def simulate_trial(vessel: Vessel, conditions: Conditions, path: str, seed: int) -> Trial:
    """Return a trial of a vessel; the same for the same arguments.

    Parameters
    ----------
    vessel
        Of `ferryid.validation.plant.vessels`.
    conditions
        Settings of the effects; those that are not given do nothing.
    path
        One of `ferryid.validation.plant.paths.PATHS`.
    seed
        Of the path, the weather and the noise, each by a stream of its own.

    Raises
    ------
    ValueError
        For a setting that no effect has.
    """
    conditions = complete_conditions(conditions)
    goals = set_points(path, vessel, np.random.default_rng([seed, PATH_STREAM]))
    n, k = int(len(goals) * DWELL_S * RATE_HZ), len(vessel.thrusters)
    t = np.arange(n) / RATE_HZ
    plant = build_plant(vessel, t, conditions, seed)
    errors = instrument_errors(np.random.default_rng([seed, NOISE_STREAM]), n, conditions["noise"])
    lag_s = plant.world.thrusters.lag_s
    setup = _Setup(
        plant.world,
        tuning(vessel),
        errors,
        goals,
        plant.air,
        plant.water,
        round(plant.delay_s * RATE_HZ),
        # None of the integrator's steps is longer than the memory of a thruster's lag.
        1 if lag_s == 0.0 else max(1, ceil(LAG_RATE / (lag_s * RATE_HZ))),
    )
    start = np.zeros(BODY + STATES * k)
    start[BODY + 1 :: STATES] = [radians(one.angle_deg or 0.0) for one in vessel.thrusters]
    order = np.zeros((k, 2))
    order[:, 1] = start[BODY + 1 :: STATES]
    memory = _Memory(start, np.zeros(7), np.zeros(2), np.zeros((3, 3)), order, np.zeros(3))
    shapes = ((n, 6), (n, len(start)), (n, k, 2), (n, 3), (n, 6), (n, k, 3))
    log = _Log(*(np.zeros(shape) for shape in shapes))
    loads = {name: np.zeros((n, 6)) for name in plant.loads}
    _measure(setup, memory, log, 0)
    if plant.loads or plant.reports:
        for row in range(n):
            for report in plant.reports:
                report(log.reported[row])
            for name, load in plant.loads.items():
                load((row + 0.5) / RATE_HZ, memory.y, loads[name][row])
                log.external[row] += loads[name][row]
            _advance(setup, memory, log, row, row + 1)
    else:
        _advance(setup, memory, log, 0, n)
    return Trial(plant, t, log.reported, log.states, log.orders, log.wanted, loads, log.thrust)


def instrument_motion(states: Floats) -> tuple[Floats, Floats]:
    """Return where the instruments are and how they move over ground, by sample.

    Parameters
    ----------
    states
        As in `Trial`, shape (n, 12 + 6 k).

    Returns
    -------
    tuple
        North, east [m] and heading [rad], and their rates [m/s, rad/s], shape (n, 3) each.
    """
    pose, rates = np.zeros((len(states), 3)), np.zeros((len(states), 3))
    for row, state in enumerate(states):
        _kinematics(state, pose[row], rates[row])
    return pose, rates


@compiled
def _measure(setup: _Setup, memory: _Memory, log: _Log, row: int) -> None:
    """Write the states of a sample and what an unbiased navigation reports of them."""
    h = 1.0 / RATE_HZ
    pose, rates, acceleration = np.zeros(3), np.zeros(3), np.zeros(2)
    _kinematics(memory.y, pose, rates)
    for j in range(2):
        acceleration[j] = (rates[j] - memory.speed[j]) / h if row > 0 else 0.0
        memory.speed[j] = rates[j]
    navigate(setup.errors, row, h, pose, rates, acceleration, memory.observer, log.reported[row])
    # An assignment of slices would bring in, and compile, all that makes the text of its errors.
    for i in range(len(memory.y)):
        log.states[row, i] = memory.y[i]


@compiled
def _advance(setup: _Setup, memory: _Memory, log: _Log, first: int, stop: int) -> None:
    """From one sample to another, steer by what is reported, move the vessel on to the next sample and measure there.

    One function for a trial at a stroke and for one row at a time: two would be compiled twice, with all that they call.
    """
    h, steps = 1.0 / RATE_HZ, setup.steps
    for row in range(first, stop):
        if row % CONTROL_EVERY == 0:
            goal = setup.goals[min(int(row * h / DWELL_S), len(setup.goals) - 1)]
            seen = log.reported[max(row - setup.late, 0)]
            steer(setup.tune, h * CONTROL_EVERY, goal, seen, memory.helm, memory.order, memory.wanted)
        for i in range(len(memory.order)):
            log.orders[row, i, 0], log.orders[row, i, 1] = memory.order[i, 0], memory.order[i, 1]
        for i in range(3):
            log.wanted[row, i] = memory.wanted[i]
        for part in range(steps):
            t = (row + part / steps) * h
            water, air, external, thrust = setup.water[row], setup.air[row], log.external[row], log.thrust[row]
            step(setup.world, t, h / steps, memory.y, memory.order, water, air, external, thrust)
        if row + 1 < len(log.reported):
            _measure(setup, memory, log, row + 1)


@compiled
def _kinematics(y: Floats, pose: Floats, rates: Floats) -> None:
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
