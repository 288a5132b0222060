"""A thruster that pushes in another direction than its sensor reads."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import (
    Conditions,
    Injection,
    PlantEffect,
    Span,
    azimuth_names,
    injection,
    random_sign,
)
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a thruster whose angle is off [deg]."""
    name, angle = str(rng.choice(azimuth_names(vessel))), size * random_sign(rng)
    return injection("azimuth_offset", {"angle": angle}, {"azimuth_offset_deg": {name: angle}}, instance=name)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Turn the force of thrusters to the right of what they read [deg], by name."""
    plant.set_thrusters(offset=np.radians(plant.by_thruster(conditions["azimuth_offset_deg"], 0.0)))


EFFECT = PlantEffect(
    "azimuth_offset",
    "deg",
    (0.1, 15.0),
    6.0,
    sample,
    rank=8,
    settings={"azimuth_offset_deg": {}},
    act=act,
)
