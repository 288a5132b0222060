"""The vessel in motion: all loads together, and one Runge-Kutta step."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.errors import FerryIdError
from ferryid.simulate.added_effects import acting
from ferryid.simulate.environment import wind_series
from ferryid.simulate.plant import rolling
from ferryid.simulate.plant.added import Added, added_load, build_added
from ferryid.simulate.plant.beside import Beside, beside_load, beside_of
from ferryid.simulate.plant.current import current_series, turn_rate
from ferryid.simulate.plant.hull import (
    Force,
    Hydrodynamics,
    State,
    coriolis_load,
    damping_load,
    fouled,
    hydrodynamics,
    perturbed,
)
from ferryid.simulate.plant.phases import Phases, phases_of
from ferryid.simulate.plant.shallow import Patch, damping_factor, patch_of
from ferryid.simulate.plant.thrusters import Gear, gear_of, move, thrust_load
from ferryid.simulate.plant.waves import Sea, sea_of, wave_load
from ferryid.simulate.plant.wind import Areas, areas_of, wind_load
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.models.forces import UnmappedTerms
    from ferryid.simulate.scenario import Scenario


class Plant(NamedTuple):
    """All that the vessel's motion depends on. One run at a time: `gear.acting`, `sea.terms` and `added` are written to.

    `wind` and `current` (2 steps + 1, 2) are velocities over ground,
    north and east [m/s], every half step.
    """

    p: Hydrodynamics
    areas: Areas
    wind: Floats
    current: Floats
    turn_radps: float
    phases: Phases
    gear: Gear
    sea: Sea
    added: Added
    shallow: Patch
    beside: Beside


def build(
    scenario: Scenario, profile: Profile, seed: int, h: float, steps: int, terms: UnmappedTerms | None = None
) -> Plant:
    """Return the plant of a scenario, for `steps` steps of `h` seconds; `terms` act beside the hull of the profile.

    Raises
    ------
    FerryIdError
        When the profile lacks what the scenario needs, or a fault names a thruster that the vessel has not.
    """
    if not profile.hull.has_model:
        raise FerryIdError(
            f"{profile.name}: the simulator needs the hull's damping, found no [hull.D] in the profile. "
            "Fix: simulate a vessel with a hull model, such as milliampere"
        )
    hull = fouled(perturbed(profile.hull, scenario.true_hull), scenario.fouling)
    p = hydrodynamics(hull)
    m, I_z = float(hull.mass_kg), float(hull.inertia_z)
    n = 2 * steps + 1
    effects = acting(scenario)
    added = build_added(effects, profile)
    beside = beside_of(terms)
    zeta = beside.zeta
    return Plant(
        p=p,
        areas=areas_of(profile.wind),
        wind=np.column_stack(wind_series(scenario, seed, n, 0.5 * h)),
        current=current_series(scenario.current, n, 0.5 * h),
        turn_radps=turn_rate(scenario.current),
        phases=phases_of(p, profile, scenario.payload, effects, scenario.thrusters.faults, h, steps, zeta),
        gear=gear_of(profile, scenario.thrusters, h, added),
        sea=sea_of(
            profile, scenario.waves, scenario.wakes, seed, (zeta * p[0] - m, zeta * p[1] - m, zeta * p[4] - I_z)
        ),
        added=added,
        shallow=patch_of(scenario.shallow),
        beside=beside,
    )


def resting(plant: Plant) -> Floats:
    """Return the actuators at rest, shape (k, 3): speed [rpm or N], angle or rudder [rad], lagged force [N]."""
    gear = plant.gear
    thrusters = np.zeros((len(gear.x), 3))
    fixed = gear.steers == 0
    thrusters[fixed, 1] = gear.angle[fixed]
    return thrusters


def payload_aboard(plant: Plant, steps: int) -> Floats:
    """Return the payload's mass [kg] and place [m] in each of the first `steps` steps, shape (steps, 2)."""
    return np.asarray(plant.phases.payload[plant.phases.of_step[:steps]])


def roll_pitch(plant: Plant, t: Floats, eta: Floats) -> Floats:
    """Return roll and pitch [rad] along a track, shape (n, 2); see `ferryid.simulate.plant.rolling.roll_pitch`."""
    return rolling.roll_pitch(plant.sea, t, eta)


@borrowing
def derivative(plant: Plant, phase: int, node: int, i: int, t: float, state: State) -> tuple[State, Force, Force]:
    """Return the state's time derivative, the force of the actuators and that of the waves [N, N, N·m].

    Rigid-body terms act on nu and added-mass terms on ``nu_r = nu - nu_c``. For an irrotational current the two add up to the
    whole M and C acting on nu_r, with ``[r v_c, -r u_c, 0]`` added at the end. A current that changes over ground adds its
    acceleration there too: the pressure gradient that accelerates the water pushes what the hull displaces,
    which weighs as much as the hull, and the added mass goes with the water anyway.

    Parameters
    ----------
    plant, phase
        Plant, and the phase of the step.
    node
        0, 1 or 2: start, middle or end of the step.
    i
        Index of the time on the half-step grid.
    t
        The time itself [s].
    state
        See `State`.
    """
    x, y, psi, u, v, r = state
    c, s = cos(psi), sin(psi)
    north, east = plant.current[i, 0], plant.current[i, 1]
    u_c, v_c = c * north + s * east, c * east - s * north
    u_r, v_r = u - u_c, v - v_c
    tau = thrust_load(plant.gear, node, u_r, v_r, r)
    wave = wave_load(plant.sea, t, x, y, psi, c, s)
    north, east = plant.wind[i, 0], plant.wind[i, 1]
    u_rw, v_rw = u - c * north - s * east, v - c * east + s * north
    blown = wind_load(plant.areas, u_rw, v_rw)
    mass = plant.phases.mass[phase]
    fitted = plant.beside.added_mass
    C = coriolis_load(mass[0] - fitted[0], mass[1] - fitted[1], mass[2] - fitted[2], u_r, v_r, r)
    D = damping_load(plant.p, u_r, v_r, r)
    factor = damping_factor(plant.shallow, x, y)
    zeta = plant.beside.zeta
    X = tau[0] + wave[0] / zeta + blown[0] / zeta - C[0] - factor * D[0]
    Y = tau[1] + wave[1] / zeta + blown[1] / zeta - C[1] - factor * D[1]
    N = tau[2] + wave[2] / zeta + blown[2] / zeta - C[2] - factor * D[2]
    more = added_load(plant.added, t, x, y, psi, u, v, r, u_r, v_r)
    X, Y, N = X + more[0], Y + more[1], N + more[2]
    learned = beside_load(plant.beside, u, v, r, u_rw, v_rw, u_r, v_r)
    X, Y, N = X + learned[0], Y + learned[1], N + learned[2]
    # nu_c_dot: [r v_c, -r u_c, 0], and R^T dV/dt of a current that turns clockwise, the current itself a quarter turn on.
    turn = r - plant.turn_radps
    inv = plant.phases.inverse[phase]
    rates = (
        c * u - s * v,
        s * u + c * v,
        r,
        inv[0] * X + turn * v_c,
        inv[1] * Y + inv[2] * N - turn * u_c,
        inv[3] * Y + inv[4] * N,
    )
    return rates, tau, wave


@borrowing
def _ahead(state: State, rates: State, d: float) -> State:
    return (
        state[0] + d * rates[0],
        state[1] + d * rates[1],
        state[2] + d * rates[2],
        state[3] + d * rates[3],
        state[4] + d * rates[4],
        state[5] + d * rates[5],
    )


@borrowing
def advance(plant: Plant, i: int, h: float, state: State, thrusters: Floats, orders: Floats, row: Floats) -> State:
    """Take one classical Runge-Kutta step.

    Parameters
    ----------
    plant
        From `build`, with the same `h`.
    i
        Index of the step's start on the half-step grid; even.
    h
        Step [s].
    state
        At the start.
    thrusters
        Speed [rpm or N], angle [rad] and lagged force [N] of each, shape (k, 3); moved in place to the end of the step.
    orders
        Speed [rpm or N] and angle or rudder [rad] of each, shape (k, 2).
    row
        Shape (9,), overwritten with the acceleration, the force of the actuators that really acts and that of the waves at
        the start of the step.

    Returns
    -------
    State
        At the end; with payload that boards there already aboard.
    """
    phases = plant.phases
    step = i // 2
    phase = phases.of_step[step]
    t, d = step * h, 0.5 * h
    for k in range(len(plant.added.acts)):
        plant.added.acts[k] = phases.acts[phase, k]
    move(plant.gear, thrusters, orders, phases.factor[phase], phases.offset[phase], h)
    at = state
    k1 = k2 = k3 = k4 = state
    # A loop, so that the loads are compiled into the step once and not four times over.
    for stage in range(4):
        node = (stage + 1) // 2
        rates, tau, wave = derivative(plant, phase, node, i + node, t + node * d, at)
        if stage == 0:
            for j in range(3):
                row[j], row[3 + j], row[6 + j] = rates[3 + j], tau[j], wave[j]
            k1, at = rates, _ahead(state, rates, d)
        elif stage == 1:
            k2, at = rates, _ahead(state, rates, d)
        elif stage == 2:
            k3, at = rates, _ahead(state, rates, h)
        else:
            k4 = rates
    d = h / 6.0
    x, y, psi, u, v, r = state
    x += d * (k1[0] + 2.0 * (k2[0] + k3[0]) + k4[0])
    y += d * (k1[1] + 2.0 * (k2[1] + k3[1]) + k4[1])
    psi += d * (k1[2] + 2.0 * (k2[2] + k3[2]) + k4[2])
    u += d * (k1[3] + 2.0 * (k2[3] + k3[3]) + k4[3])
    v += d * (k1[4] + 2.0 * (k2[4] + k3[4]) + k4[4])
    r += d * (k1[5] + 2.0 * (k2[5] + k3[5]) + k4[5])
    later = phases.of_step[min(step + 1, len(phases.of_step) - 1)]
    if later != phase:
        b = phases.boarding[later]
        u, v, r = b[0] * u, b[1] * v + b[2] * r, b[3] * v + b[4] * r
    return x, y, psi, u, v, r
