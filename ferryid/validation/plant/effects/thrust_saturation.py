"""A thruster whose motor is short of current: it never gives its most."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel

FREE = (1e9, 1e9)


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a limit, as the share of the most thrust that is lost; the same share astern, which only a fixed one shows."""
    one = vessel.thrusters[int(rng.integers(len(vessel.thrusters)))]
    ahead, astern = ((1.0 - size) * each * one.most_rpm**2 for each in (one.ahead, one.astern))
    values = {"ahead": ahead} if one.angle_deg is None else {"ahead": ahead, "astern": astern}
    return injection("thrust_saturation", values, {"thrust_limit_N": {one.name: (ahead, astern)}}, instance=one.name)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Limit the thrust of thrusters, by name, ahead and astern [N]."""
    limits = conditions["thrust_limit_N"]
    plant.set_thrusters(limit=np.array([limits.get(one.name, FREE) for one in plant.vessel.thrusters]))


EFFECT = PlantEffect(
    "thrust_saturation",
    "share of the most force that is lost",
    (0.05, 0.8),
    0.4,
    sample,
    rank=22,
    settings={"thrust_limit_N": {}},
    act=act,
)
