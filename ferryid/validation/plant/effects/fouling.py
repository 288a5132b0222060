"""Fouling: drag that grows with the square of the speed is larger."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a fouled hull: more drag ahead, as a share, and a third of that across."""
    factors = (1.0 + size, 1.0 + size / 3.0, 1.0 + size / 3.0)
    return injection("fouling", dict(zip(("surge", "sway", "yaw"), factors, strict=True)), {"fouling": factors})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Multiply the drag of surge, sway and yaw."""
    hull = plant.world.hull._replace(roughness=np.array(conditions["fouling"]))
    plant.world = plant.world._replace(hull=hull)


EFFECT = PlantEffect(
    "fouling",
    "share of the drag",
    (0.05, 2.5),
    1.0,
    sample,
    rank=6,
    settings={"fouling": (1.0, 1.0, 1.0)},
    act=act,
    neutral=1.0,
)
