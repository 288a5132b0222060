"""Steady wind, and winds that change over the trial."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection, random_vector
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a wind of a speed [m/s]."""
    north, east = random_vector(size, rng)
    return injection("wind", {"north": north, "east": east}, {"wind": (north, east)})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Add the wind, north and east [m/s], and a series of it: rows of time [s], north and east, linear in between."""
    plant.air = np.array(conditions["wind"]) + plant.air
    if len(conditions["wind_series"]):
        at, north, east = np.array(conditions["wind_series"]).T
        plant.air = plant.air + np.column_stack([np.interp(plant.t, at, north), np.interp(plant.t, at, east)])


EFFECT = PlantEffect(
    "wind",
    "m/s",
    (0.1, 8.0),
    3.5,
    sample,
    rank=1,
    settings={"wind": (0.0, 0.0), "wind_series": ()},
    act=act,
)
