"""A thruster that lost a share of its force, in all or part of the trial."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import (
    ALWAYS,
    Conditions,
    Injection,
    PlantEffect,
    Span,
    injection,
    span_limits,
)
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a thruster that lost a share of its force."""
    name = str(rng.choice([one.name for one in vessel.thrusters]))
    conditions = {"gain": {name: 1.0 - size}, "gain_span": span_limits(span)}
    return injection("thruster_gain", {"factor": 1.0 - size}, conditions, instance=name, span=span)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Multiply the force of thrusters, by name, within a span of time."""
    gain = plant.by_thruster(conditions["gain"], 1.0)
    plant.set_thrusters(gain=gain, gain_span=np.array(conditions["gain_span"]))


EFFECT = PlantEffect(
    "thruster_gain",
    "share of the force",
    (0.005, 0.5),
    0.2,
    sample,
    rank=7,
    settings={"gain": {}, "gain_span": ALWAYS},
    act=act,
    time_limited=True,
    neutral=1.0,
)
