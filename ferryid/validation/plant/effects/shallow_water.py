"""A bank over which damping and added mass grow."""

from __future__ import annotations

from math import cos
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.validation.plant.plant import Plant

SLOPE_M = 3.0
"""Over how many metres a bank rises."""
ADDED_MASS_SHARE = 0.3
"""Share of the growth of damping by which added mass grows over a bank."""


class Bank(NamedTuple):
    """A bank: factor on the damping, and its ends, lowest and highest north, lowest and highest east [m] (4,)."""

    factor: float
    ends: Floats


DEEP_WATER = Bank(1.0, np.zeros(4))


@compiled
def damping_factor(bank: Bank, north: float, east: float) -> float:
    """Return the factor on damping at a place: cosine slopes at the ends of the bank."""
    if bank.factor == 1.0:
        return 1.0
    inside = 1.0
    for low, high, at in ((bank.ends[0], bank.ends[1], north), (bank.ends[2], bank.ends[3], east)):
        depth = min(at - low, high - at) / SLOPE_M + 0.5
        inside *= 0.5 - 0.5 * cos(np.pi * min(max(depth, 0.0), 1.0))
    return 1.0 + (bank.factor - 1.0) * inside


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a bank on one side, over which damping grows by a share."""
    far, edge = 4.0 * vessel.leg_m, float(rng.uniform(-0.3, 0.3)) * vessel.leg_m
    side = [(edge, far, -far, far), (-far, edge, -far, far), (-far, far, edge, far), (-far, far, -far, edge)]
    bank = side[int(rng.integers(4))]
    return injection("shallow_water", {"factor": 1.0 + size}, {"shallow": 1.0 + size, "shallow_m": bank})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Put a bank into the water."""
    plant.world = plant.world._replace(bank=Bank(conditions["shallow"], np.array(conditions["shallow_m"])))


EFFECT = PlantEffect(
    "shallow_water",
    "share of the damping",
    (0.02, 2.0),
    0.8,
    sample,
    rank=14,
    settings={"shallow": 1.0, "shallow_m": (0.0, 0.0, 0.0, 0.0)},
    act=act,
    neutral=1.0,
    positions=("south", "north", "west", "east"),
)
