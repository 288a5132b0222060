"""Fouling: drag that grows with the square of the speed is larger; and a hump of resistance at one speed, no fouling."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
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
    speed, width, most = conditions["hump"]
    if most != 0.0:
        plant.loads["hump"] = lambda t, y, out: hump_load(speed, width, most, y[6], out)


def hump_load(speed: float, width: float, most: float, u: float, out: Floats) -> None:
    """Write the load of a hump of resistance at a speed, shape (6,) [N, N·m]."""
    out[:] = 0.0
    out[0] = -most * np.sign(u) * np.exp(-0.5 * ((abs(u) - speed) / width) ** 2)


EFFECT = PlantEffect(
    "fouling",
    "share of the drag",
    (0.05, 2.5),
    1.0,
    sample,
    rank=6,
    settings={"fouling": (1.0, 1.0, 1.0), "hump": (1.0, 1.0, 0.0)},
    act=act,
    neutral=1.0,
)
"""Factors on the drag of surge, sway and yaw; speed [m/s], width [m/s] and force [N] of a hump of resistance."""
