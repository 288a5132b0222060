"""Plants for tests: any sections of a scenario, on milliAmpère or another profile, with forces ordered directly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.compiled import compiled
from ferryid.models.forces import UnmappedTerms
from ferryid.simulate.plant.hull import Force, State
from ferryid.simulate.plant.motion import Plant, advance, build, resting
from ferryid.simulate.scenario import NOWHERE, Scenario
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Actuator, Profile

MILLIAMPERE = load_profile("milliampere")
Floats = NDArray[np.float64]


@compiled
def _steps(plant, h, first, count, state, thrusters, orders):  # type: ignore[no-untyped-def]
    rows = np.empty((count, 15))
    for k in range(count):
        for j in range(6):
            rows[k, j] = state[j]
        state = advance(plant, 2 * (first + k), h, state, thrusters, orders, rows[k, 6:])
    return state, rows


@dataclass
class Run:
    """A plant and its actuators, driven with constant orders."""

    plant: Plant
    h: float
    thrusters: Floats
    step: int = 0

    def drive(self, state: State, orders: object, seconds: float) -> tuple[State, Floats]:
        """Return the state after `seconds`, and state, acceleration, actuator and wave force of every step."""
        count = round(seconds / self.h)
        given = np.asarray(orders, dtype=np.float64)
        end, rows = _steps(self.plant, self.h, self.step, count, tuple(map(float, state)), self.thrusters, given)
        self.step += count
        return end, rows

    def push(self, state: State, tau: Force, seconds: float) -> tuple[State, Floats]:
        """Drive a vessel of `direct` actuators with a force [N, N, N·m] that has acted all along."""
        X, Y, N = tau
        self.thrusters[:, 0] = X, 0.5 * (Y + N), 0.5 * (Y - N)
        return self.drive(state, [[force, 0.0] for force in self.thrusters[:, 0]], seconds)


def direct(profile: Profile = MILLIAMPERE) -> Profile:
    """Return the vessel with three forces given directly, in place of its own actuators."""
    return replace(
        profile,
        actuators=(
            Actuator("ahead", "force", (0.0, 0.0)),
            Actuator("fore", "force", (1.0, 0.0), angle_rad=0.5 * pi),
            Actuator("aft", "force", (-1.0, 0.0), angle_rad=0.5 * pi),
        ),
    )


@pytest.fixture(scope="session")
def make() -> Callable[..., Run]:
    """Return a function that builds a plant: ``make(profile, h, seconds, seed, terms, **sections of the scenario)``."""

    def built(
        profile: Profile = MILLIAMPERE,
        h: float = 0.02,
        seconds: float = 10.0,
        seed: int = 1,
        terms: UnmappedTerms | None = None,
        **sections: object,
    ) -> Run:
        scenario = Scenario("test", "", profile.name, NOWHERE, seconds, 0, seed, **sections)  # type: ignore[arg-type]
        plant = build(scenario, profile, seed, h, round(seconds / h), terms)
        return Run(plant, h, resting(plant))

    return built


@pytest.fixture(scope="session")
def adrift(make: Callable[..., Run]) -> Callable[..., Run]:
    """Return the same for a vessel that forces are ordered on directly, with no lag."""
    from ferryid.simulate.sections import Thrusters

    def built(profile: Profile = MILLIAMPERE, **rest: object) -> Run:
        return make(direct(profile), **{"thrusters": Thrusters(speed_lag_s=0.0), **rest})

    return built
