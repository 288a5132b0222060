"""A simulated trial: the vessel under control along a path, then what its sensors report of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.simulate.check_scenario import line_in, vessel_of
from ferryid.simulate.control.allocation import build_allocation
from ferryid.simulate.control.feedforward import build_feedforward
from ferryid.simulate.control.guidance import build_guidance
from ferryid.simulate.control.manoeuvres import build_helm
from ferryid.simulate.control.pid import build_pid
from ferryid.simulate.control.reference import build_reference
from ferryid.simulate.environment import controller_weather
from ferryid.simulate.loop import RECORD, ROW, Loop, Measured, Memory, run
from ferryid.simulate.noise import navigation_errors, navigation_noise, navigation_sent
from ferryid.simulate.plant.motion import build, payload_aboard, resting, roll_pitch
from ferryid.simulate.scenario import Scenario, check_against
from ferryid.simulate.sensors import Stream, sense
from ferryid.simulate.size import check_size, steps_per_cycle
from ferryid.simulate.states import Control, Truth
from ferryid.simulate.vessel_topics import in_vessel_topics
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.models import Model
    from ferryid.models.forces import UnmappedTerms


@dataclass(frozen=True)
class Simulation:
    """One finished trial: the scenario and seed it came from, the truth, the messages that its log holds.

    `faults` are why these are not in the topics of the vessel's profile; none where they are.
    """

    scenario: Scenario
    seed: int
    profile: Profile
    truth: Truth
    control: Control
    streams: tuple[Stream, ...]
    faults: tuple[str, ...] = ()


def simulate(
    scenario: Scenario,
    seed: int | None = None,
    *,
    model: Model | None = None,
    vessel: Profile | None = None,
    terms: UnmappedTerms | None = None,
) -> Simulation:
    """Run a scenario.

    Parameters
    ----------
    scenario
        From `load_scenario`.
    seed
        Takes the place of the scenario's own.
    model
        Takes the place of the controller's model, profile or file.
    vessel
        The vessel that moves, with another hull than the profile's, in which the controller believes; see
        `ferryid.simulate.vessel_model`.
    terms
        What acts on it beside its hull.

    Raises
    ------
    FerryIdError
        When the vessel has no hull model, or the scenario asks for what it lacks.
    """
    profile = vessel_of(scenario)
    number = scenario.seed if seed is None else seed
    check_size(scenario, len(profile.actuators))
    truth, control = sail(scenario, profile, number, model, vessel, terms)
    streams, faults = in_vessel_topics(sense(scenario, profile, number, truth, control), profile)
    return Simulation(scenario, number, profile, truth, control, streams, faults)


def sail(
    scenario: Scenario,
    profile: Profile,
    seed: int,
    model: Model | None = None,
    vessel: Profile | None = None,
    terms: UnmappedTerms | None = None,
) -> tuple[Truth, Control]:
    """Run the closed loop without the log's sensors; parameters and errors as for `simulate`."""
    moving = vessel or profile
    check_against(scenario, moving)
    cycle = 1.0 / scenario.sensors.navigation_rate_hz
    steps = steps_per_cycle(scenario.sensors.navigation_rate_hz)
    h = cycle / steps
    cycles = round(scenario.duration_s / cycle)
    if cycles < 2:
        raise FerryIdError(
            f"{scenario.where}:{line_in(scenario, 'duration_s')}: a trial needs at least two control cycles, found "
            f"duration_s = {scenario.duration_s:g}. Fix: make it longer"
        )
    plant = build(scenario, moving, seed, h, steps * cycles, terms)
    thrusters = resting(plant)
    guidance, way = build_guidance(scenario)
    tuning, reference = build_reference(scenario)
    pid, integral = build_pid(scenario, profile)
    helm, swing = build_helm(scenario, profile)
    loop = Loop(
        plant,
        guidance,
        tuning,
        pid,
        build_feedforward(scenario, profile, model),
        build_allocation(scenario, profile, plant.gear.curves),
        helm,
        bool(scenario.manoeuvre.kind),
        navigation_errors(scenario),
    )
    k = len(thrusters)
    memory = Memory(thrusters, np.zeros((k, 2)), way, reference, integral, swing)
    n = steps * cycles
    wind, current = plant.wind[: 2 * n : 2], plant.current[: 2 * n : 2]
    payload = payload_aboard(plant, n)
    at = np.arange(cycles, dtype=np.float64) * cycle
    measured = Measured(
        navigation_noise(scenario.sensors.noise, seed, cycles, cycle),
        navigation_sent(scenario, seed, cycles, cycle),
        *controller_weather(
            scenario,
            seed,
            at,
            np.add.outer(at, np.arange(steps, dtype=np.float64) * h).ravel(),
            wind,
            current,
            payload,
        ),
    )
    rows, records = np.empty((n, ROW + 2 * k)), np.empty((cycles, RECORD + 2 * k))
    run(loop, memory, measured, h, steps, rows, records)
    if not np.isfinite(rows).all():
        lost = int(np.argmin(np.isfinite(rows).all(axis=1)))
        raise FerryIdError(
            f"{scenario.where}: the simulated motion grows without bound after {lost * h:.1f} s. "
            "Fix: smaller gains or forces; a hull whose damping drives instead of damping does this too"
        )
    attitude = roll_pitch(plant, rows[:, 0], rows[:, 1:4])
    return _truth(rows, k, wind, current, payload, attitude), _control(records, k, int(way[2]))


def _truth(rows: Floats, k: int, wind: Floats, current: Floats, payload: Floats, attitude: Floats) -> Truth:
    return Truth(
        t=rows[:, 0],
        eta=rows[:, 1:4],
        nu=rows[:, 4:7],
        nu_dot=rows[:, 7:10],
        tau=rows[:, 10:13],
        wave=rows[:, 13:16],
        attitude=attitude,
        wind=wind,
        current=current,
        payload=payload,
        speeds=rows[:, ROW : ROW + k],
        angles=rows[:, ROW + k :],
    )


def _control(records: Floats, k: int, undefined_aims: int) -> Control:
    return Control(
        t=records[:, 0],
        t_order=records[:, 1],
        measured=records[:, 2:8],
        sent=records[:, 24] > 0.0,
        goal=records[:, 8:11],
        eta_d=records[:, 11:14],
        nu_d=records[:, 14:17],
        tau_d=records[:, 17:20],
        feedforward=records[:, 20:23],
        speeds=records[:, RECORD : RECORD + k],
        angles=records[:, RECORD + k :],
        saturated=records[:, 23] > 0.0,
        undefined_aims=undefined_aims,
    )
