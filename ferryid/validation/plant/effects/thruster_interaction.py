"""Thrust that is lost in the race of another thruster."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a loss in the race of another thruster, as a share."""
    return injection("thruster_interaction", {"fraction": size}, {"interaction": size})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Let a thruster lose a share of its thrust in a race that blows straight at it."""
    plant.set_thrusters(interaction=conditions["interaction"])


EFFECT = PlantEffect(
    "thruster_interaction",
    "share of the force",
    (0.02, 0.6),
    0.3,
    sample,
    rank=12,
    settings={"interaction": 0.0},
    act=act,
)
