"""Navigation that is late."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a delay [s]."""
    return injection("time_delay", {"seconds": size}, {"delay_s": size})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Delay the navigation [s]."""
    plant.delay_s += conditions["delay_s"]


EFFECT = PlantEffect(
    "time_delay",
    "s",
    (0.01, 1.0),
    0.3,
    sample,
    rank=15,
    settings={"delay_s": 0.0},
    act=act,
    excludes=("thruster_lag",),
)
