"""A propeller that gives less astern than its bollard pull says: blades that are worn on their back."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a fixed thruster that lost a share of its force astern."""
    name = str(rng.choice([one.name for one in vessel.thrusters if one.angle_deg is not None]))
    return injection("astern_asymmetry", {"factor": 1.0 - size}, {"astern": {name: 1.0 - size}}, instance=name)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Multiply the force of thrusters, by name, while they turn astern."""
    share = plant.by_thruster(conditions["astern"], 1.0)
    plant.set_thrusters(astern=share * plant.world.thrusters.astern)


EFFECT = PlantEffect(
    "astern_asymmetry",
    "share of the force astern",
    (0.005, 0.5),
    0.25,
    sample,
    rank=21,
    settings={"astern": {}},
    act=act,
    vessel="surveyor",
    neutral=1.0,
)
