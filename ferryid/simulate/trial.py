"""A simulated trial: the vessel under control along a path, then what its sensors report of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil, radians

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.simulate.control import Controller, Order, Reference, allocate
from ferryid.simulate.noise import generator, gusts, measurement_noise
from ferryid.simulate.plant import (
    DAMPING,
    Azimuth,
    Force,
    State,
    ThrustTable,
    advance,
    hydrodynamics,
    rates,
    total,
)
from ferryid.simulate.scenario import MASS, Noise, Scenario
from ferryid.simulate.sensors import Stream, sense
from ferryid.simulate.states import Control, Truth
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Hull, Profile

Floats = NDArray[np.float64]

LONGEST_STEP_S = 0.02
"""Longest integration step [s]: the plant runs at 50 Hz or faster, in whole steps per control cycle."""


@dataclass(frozen=True)
class Simulation:
    """One finished trial: the scenario and seed it came from, the truth, and the messages that its log holds."""

    scenario: Scenario
    seed: int
    profile: Profile
    truth: Truth
    control: Control
    streams: tuple[Stream, ...]


def simulate(scenario: Scenario, seed: int | None = None) -> Simulation:
    """Run a scenario.

    Parameters
    ----------
    scenario
        From `load_scenario`.
    seed
        Takes the place of the scenario's own.

    Raises
    ------
    FerryIdError
        When the vessel has no hull model, or not two azimuth thrusters on its centre line.
    """
    profile = load_profile(scenario.vessel)
    number = scenario.seed if seed is None else seed
    truth, control = run(scenario, profile, number)
    return Simulation(scenario, number, profile, truth, control, sense(scenario, profile, number, truth, control))


def run(scenario: Scenario, profile: Profile, seed: int) -> tuple[Truth, Control]:
    """Run the closed loop: controller, allocation, thrusters, hull.

    Within a step the thrusters follow their order exactly and do not depend on the hull, so that the Runge-Kutta
    stages see their true force. An order takes effect one step after the measurement it answers, which stands for the
    way from the sensors through the controller.
    """
    if not profile.hull.has_model:
        raise FerryIdError(
            f"{profile.name}: the simulator needs the hull's damping, found no [hull.D] in the profile. "
            "Fix: simulate a vessel with a hull model, such as milliampere"
        )
    fore, aft = _thrusters(scenario, profile)
    p = hydrodynamics(perturbed(profile.hull, scenario.true_hull))
    areas = profile.wind
    cycle = 1.0 / scenario.sensors.navigation_rate_hz
    steps = ceil(cycle / LONGEST_STEP_S - 1e-9)
    h = cycle / steps
    cycles = round(scenario.duration_s / cycle)
    if cycles < 2:
        raise FerryIdError(
            f"{scenario.name}: a trial needs at least two control cycles, found duration_s = {scenario.duration_s:g}. "
            "Fix: make it longer"
        )
    controller = Controller(
        hydrodynamics(profile.hull, scenario.delta, scenario.sigma),
        Reference(scenario.reference),
        scenario.gains,
    )
    noise = navigation_noise(scenario.noise, seed, cycles, cycle).tolist()
    north, east = wind_series(scenario, seed, 2 * steps * cycles + 1, 0.5 * h)
    current = (scenario.current.north_mps, scenario.current.east_mps)
    state: State = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    orders = (Order(0.0, 0.0), Order(0.0, 0.0))
    saturated = False
    tau = total((fore.force(), aft.force()))
    rows: list[tuple[float, ...]] = []
    records: list[tuple[float, ...]] = []
    for k in range(cycles):
        t = k * cycle
        seen = [value + error for value, error in zip(state, noise[k], strict=True)]
        controller.reference.advance(scenario.path.at(t), cycle)
        acting = orders
        tau_d, ahead = controller.desired_force(
            (seen[0], seen[1], seen[2]), (seen[3], seen[4], seen[5]), cycle, saturated=saturated
        )
        orders_fore, orders_aft, saturated = allocate(tau_d, fore, aft, orders)
        orders = (orders_fore, orders_aft)
        nu_d, _ = controller.reference.body()
        records.append(
            (
                t,
                t + h,
                *seen,
                *controller.reference.pose,
                *nu_d,
                *tau_d,
                *ahead,
                orders_fore.speed,
                orders_aft.speed,
                orders_fore.angle,
                orders_aft.angle,
                saturated,
            )
        )
        for j in range(steps):
            i = 2 * (k * steps + j)
            wind = (north[i], east[i])
            slope = rates(p, areas, state, tau, wind, current)
            rows.append((t + j * h, *state, *slope[3:], *tau, *wind, fore.speed, aft.speed, fore.angle, aft.angle))
            mid = _follow(fore, aft, acting, 0.5 * h)
            tau = _follow(fore, aft, acting, 0.5 * h)
            acting = orders
            winds = ((north[i + 1], east[i + 1]), (north[i + 2], east[i + 2]))
            state = advance(p, areas, state, slope, (mid, tau), winds, current, h)
    return _truth(np.asarray(rows), current), _control(np.asarray(records))


def _follow(fore: Azimuth, aft: Azimuth, orders: tuple[Order, Order], h: float) -> Force:
    """Let both thrusters follow their orders for `h` seconds and return their force."""
    fore.follow(orders[0].speed, orders[0].angle, h)
    aft.follow(orders[1].speed, orders[1].angle, h)
    return total((fore.force(), aft.force()))


def _truth(rows: Floats, current: tuple[float, float]) -> Truth:
    return Truth(
        t=rows[:, 0],
        eta=rows[:, 1:4],
        nu=rows[:, 4:7],
        nu_dot=rows[:, 7:10],
        tau=rows[:, 10:13],
        wind=rows[:, 13:15],
        current=np.broadcast_to(np.asarray(current), (len(rows), 2)),
        speeds=rows[:, 15:17],
        angles=rows[:, 17:19],
    )


def _control(records: Floats) -> Control:
    return Control(
        t=records[:, 0],
        t_order=records[:, 1],
        measured=records[:, 2:8],
        eta_d=records[:, 8:11],
        nu_d=records[:, 11:14],
        tau_d=records[:, 14:17],
        feedforward=records[:, 17:20],
        speeds=records[:, 20:22],
        angles=records[:, 22:24],
        saturated=records[:, 24] > 0.0,
    )


def perturbed(hull: Hull, factors: Mapping[str, float]) -> Hull:
    """Return the hull with coefficients multiplied by `factors`."""
    places = dict(zip(MASS, ((0, 0), (1, 1), (1, 2), (2, 1), (2, 2)), strict=True))
    M = hull.M.copy()
    for name, place in places.items():
        M[place] *= factors.get(name, 1.0)
    D = {name: value * factors.get(name, 1.0) for name, value in hull.D.items() if name in DAMPING}
    return replace(hull, M=M, D=D)


def navigation_noise(noise: Noise, seed: int, n: int, step_s: float) -> Floats:
    """Return the errors of pose and velocities as a navigation filter leaves them, shape (n, 6) [m, rad, m/s, rad/s].

    The time derivative of a position's error is as large as the velocity's own error, and that of a velocity's error
    as large as Table 5.2 states for the acceleration.
    """
    turn, yaw = radians(noise.yaw_rate_degps), radians(noise.yaw_acceleration_degps2)
    channels = {
        "x": (noise.position_m, noise.velocity_mps),
        "y": (noise.position_m, noise.velocity_mps),
        "psi": (radians(noise.heading_deg), turn),
        "u": (noise.velocity_mps, noise.acceleration_mps2),
        "v": (noise.velocity_mps, noise.acceleration_mps2),
        "r": (turn, yaw),
    }
    return np.column_stack(
        [
            measurement_noise(generator(seed, name), n, step_s, std, rate_std, noise.white_share)
            for name, (std, rate_std) in channels.items()
        ]
    )


def wind_series(scenario: Scenario, seed: int, n: int, step_s: float) -> tuple[list[float], list[float]]:
    """Return the wind's north and east components [m/s] every `step_s` seconds, steady part and gusts."""
    wind = scenario.wind
    series = [
        steady + gusts(generator(seed, f"gust {axis}"), n, step_s, wind.gust_std_mps, wind.gust_time_s)
        for axis, steady in (("north", wind.north_mps), ("east", wind.east_mps))
    ]
    return series[0].tolist(), series[1].tolist()


def _thrusters(scenario: Scenario, profile: Profile) -> tuple[Azimuth, Azimuth]:
    """Return the fore and the aft azimuth thruster of the profile."""
    found = [actuator for actuator in profile.actuators if actuator.kind == "azimuth"]
    fits = (
        len(found) == len(profile.actuators) == 2
        and all(actuator.position_m[1] == 0.0 for actuator in found)
        and found[0].position_m[0] > found[1].position_m[0]
    )
    if not fits:
        kinds = ", ".join(f"{actuator.kind} at {actuator.position_m}" for actuator in profile.actuators)
        raise FerryIdError(
            f"{profile.name}: the simulator's allocation needs two azimuth thrusters on the centre line, "
            f"the fore one first, found {kinds or 'none'}. Fix: simulate a vessel with that layout, such as milliampere"
        )
    dynamics = scenario.thrusters
    made = []
    for actuator in found:
        if actuator.thrust is None:
            raise FerryIdError(
                f"{profile.name}: the simulator needs the thrust curve of {actuator.name}, found none. "
                "Fix: add thrust = {...} to the actuator"
            )
        if actuator.thrust.kind == "open_water":
            raise FerryIdError(
                f"{profile.name}: the simulator's thrusters do not feel their inflow yet, found an open-water curve "
                f"for {actuator.name}. Fix: give it a polynomial, a table or a quadratic"
            )
        made.append(
            Azimuth(
                *actuator.position_m,
                ThrustTable.of(actuator.thrust),
                dynamics.speed_lag_s,
                dynamics.speed_rate_rpmps,
                dynamics.azimuth_lag_s,
                radians(dynamics.azimuth_rate_degps),
                float(actuator.count),
            )
        )
    return made[0], made[1]
