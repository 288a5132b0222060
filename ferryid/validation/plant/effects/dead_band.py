"""A thruster whose race has to exceed a speed before it pushes."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a dead band, as a share of the most speed; astern it is another, which a thruster that turns round never shows."""
    one = vessel.thrusters[int(rng.integers(len(vessel.thrusters)))]
    values = {"ahead": size * one.most_rpm}
    if one.angle_deg is not None:
        values["astern"] = float(rng.uniform(0.7, 1.4)) * values["ahead"]
    band = (values["ahead"], values.get("astern", values["ahead"]))
    return injection("dead_band", values, {"dead_band_rpm": {one.name: band}}, instance=one.name)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Let thrusters, by name, give nothing below a speed ahead and astern [rpm]."""
    bands = conditions["dead_band_rpm"]
    plant.set_thrusters(band=np.array([bands.get(one.name, (0.0, 0.0)) for one in plant.vessel.thrusters]))


EFFECT = PlantEffect(
    "dead_band",
    "share of the most speed",
    (0.05, 0.45),
    0.17,
    sample,
    rank=20,
    settings={"dead_band_rpm": {}},
    act=act,
)
