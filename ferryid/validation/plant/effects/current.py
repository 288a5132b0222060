"""Steady current, and one that turns over the trial."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection, random_vector
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a current of a speed [m/s]."""
    north, east = random_vector(size, rng)
    return injection("current", {"north": north, "east": east}, {"current": (north, east)})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Add the current, north and east [m/s], turning at a rate [deg/min]."""
    turn = np.radians(conditions["current_turn"]) * plant.t / 60.0
    north, east = conditions["current"]
    c, s = np.cos(turn), np.sin(turn)
    plant.water = plant.water + np.column_stack([c * north - s * east, s * north + c * east])


EFFECT = PlantEffect(
    "current",
    "m/s",
    (0.0005, 0.4),
    0.15,
    sample,
    rank=3,
    settings={"current": (0.0, 0.0), "current_turn": 0.0},
    act=act,
)
