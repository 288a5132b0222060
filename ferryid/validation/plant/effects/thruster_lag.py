"""Force that lags the speed of the propeller."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a lag [s]."""
    return injection("thruster_lag", {"time_constant": size}, {"lag_s": size})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Let the force of all thrusters lag [s]."""
    plant.set_thrusters(lag_s=conditions["lag_s"])


EFFECT = PlantEffect(
    "thruster_lag",
    "s",
    (0.02, 1.5),
    0.6,
    sample,
    rank=10,
    settings={"lag_s": 0.0},
    act=act,
    excludes=("time_delay",),
)
