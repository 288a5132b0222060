"""Rounds flown in the simulator, logged, and read back as any recording is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path

from ferryid.cached import cached_property
from ferryid.identify import FitSettings
from ferryid.models import Model
from ferryid.reproduce.learning import BASE, MASTER, THESIS, learn
from ferryid.reproduce.performance import Performance, performance
from ferryid.signals.align import align
from ferryid.signals.recording import record
from ferryid.signals.smooth import Measured, measure, smooth_measured
from ferryid.signals.track import Motion
from ferryid.simulate.logs import write_log
from ferryid.simulate.scenario import Scenario, parse_scenario
from ferryid.simulate.trial import Simulation, simulate
from ferryid.vessel.profile import Profile


@cache
def trial(name: str) -> Scenario:
    """Return one of the studies' own scenarios."""
    file = resources.files("ferryid.reproduce.scenarios") / f"{name}.toml"
    return parse_scenario(file.read_text("utf-8"), file.name)


def controlled(scenario: Scenario, scale: Mapping[str, float]) -> Scenario:
    """Return a scenario whose feedforward is the profile's hull, scaled."""
    return replace(scenario, controller=replace(scenario.controller, delta=scale["delta"], sigma=scale["sigma"]))


@dataclass(frozen=True)
class Flight:
    """One round: what happened, and its log read back with the vessel's profile."""

    simulation: Simulation
    measured: Measured

    @property
    def profile(self) -> Profile:
        """Profile of the vessel."""
        return self.simulation.profile

    @cached_property
    def performance(self) -> Performance:
        """What the round cost and how precise it was."""
        one = self.simulation
        return performance(one.truth, one.control, one.profile.hull.length_m)

    def motion(self, window_s: float) -> Motion:
        """Return its log, smoothed with a square window."""
        return smooth_measured(self.measured, window_s)


def fly(folder: Path, name: str, scenario: Scenario, seed: int, model: Model | None = None) -> Flight:
    """Fly one round, write its log, and read that.

    Parameters
    ----------
    folder, name
        Where the log goes.
    scenario
        What is flown; its controller's scaled hull is the feedforward where no `model` is given.
    seed
        Of weather and sensors.
    model
        Feedforward of the round.
    """
    simulation = simulate(scenario, seed, model=model)
    log = folder / f"{name}.mcap"
    write_log(simulation, log, overwrite=True)
    track = align(record(log, simulation.profile), simulation.profile, None)
    return Flight(simulation, measure(track, simulation.profile))


def weather_seed(seed: int, round_number: int) -> int:
    """Return the seed of one round's weather and sensors: as on the water, no two rounds are alike."""
    return 1000 * seed + round_number


@dataclass(frozen=True)
class Campaign:
    """Rounds flown one after the other, each with what was learnt from those before it (Table 5.3).

    `models[p]` is Model p + 1, of rounds 1 to p + 1; round p + 2 flew with it.
    """

    flights: tuple[Flight, ...]
    models: tuple[Model, ...]


def campaign(
    folder: Path, scenario: Scenario, seed: int, rounds: int, settings: FitSettings = THESIS, first: int = 1
) -> Campaign:
    """Fly rounds adaptively: the first with the base model, each later one with the model of all rounds before it.

    Parameters
    ----------
    folder, scenario, seed
        As in `fly`.
    rounds
        How many.
    settings
        How models are made.
    first
        Number of the first round, which counts on in the names of logs and in the seeds of the weather.
    """
    flights = [fly(folder, f"round-{first}", controlled(scenario, BASE), weather_seed(seed, first))]
    models: list[Model] = []
    for number in range(first + 1, first + rounds):
        motions = [flight.motion(settings.window_s) for flight in flights]
        models.append(learn(motions, flights[0].profile, settings))
        flights.append(
            fly(folder, f"round-{number}", controlled(scenario, BASE), weather_seed(seed, number), models[-1])
        )
    return Campaign(tuple(flights), tuple(models))


def master_round(folder: Path, scenario: Scenario, seed: int, number: int) -> Flight:
    """Fly a round with the Master Model, the profile's hull as it is."""
    return fly(folder, f"round-{number}", controlled(scenario, MASTER), weather_seed(seed, number))
