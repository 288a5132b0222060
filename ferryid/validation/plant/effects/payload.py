"""A load aboard, or one that comes aboard and leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats
from ferryid.validation.plant.effects.effect import (
    ALWAYS,
    Conditions,
    Injection,
    PlantEffect,
    Span,
    injection,
    span_limits,
)
from ferryid.validation.plant.hull import rigid_mass
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.validation.plant.plant import Plant

BOARDING_S = 6.0
"""Time in which a load comes aboard, piece by piece, or leaves."""


class Payload(NamedTuple):
    """A load: mass [kg], its mass matrix (6, 6), and when half of it has come and gone [s] (2,)."""

    mass_kg: float
    mass: Floats
    span: Floats


NOTHING = Payload(0.0, np.zeros((6, 6)), np.array([-1e9, 1e9]))


@compiled
def share_aboard(load: Payload, t: float) -> float:
    """Return the share of a load that is aboard."""
    boarded = (t - load.span[0]) / BOARDING_S + 0.5
    left = (t - load.span[1]) / BOARDING_S + 0.5
    return float(min(max(boarded, 0.0), 1.0) - min(max(left, 0.0), 1.0))


@compiled
def boarding_load(load: Payload, t: float, nu: Floats, out: Floats) -> None:
    """Add the momentum that a load takes from the vessel as it comes aboard at rest; one that leaves takes its own along."""
    if 0.0 < (t - load.span[0]) / BOARDING_S + 0.5 < 1.0:
        momentum = load.mass @ nu
        for i in range(6):
            out[i] -= momentum[i] / BOARDING_S


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a load, as a share of the vessel's mass."""
    mass, x = size * vessel.mass, float(rng.uniform(-0.3, 0.3)) * vessel.length
    conditions = {"payload": (mass, x, 0.5), "payload_span": span_limits(span)}
    return injection("payload", {"mass": mass, "x": x}, conditions, span=span)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Put a load aboard: mass [kg], place forward of midship and height above the waterline [m]."""
    mass_kg, x, height = conditions["payload"]
    begin, end = conditions["payload_span"]
    # A load that is aboard from the start never boards.
    span = np.array([begin or -1e9, end])
    mass = rigid_mass(mass_kg, x, -height, np.zeros((3, 3)))
    plant.world = plant.world._replace(payload=Payload(mass_kg, mass, span))


EFFECT = PlantEffect(
    "payload",
    "share of the mass",
    (0.01, 0.4),
    0.15,
    sample,
    rank=5,
    settings={"payload": (0.0, 0.0, 0.6), "payload_span": ALWAYS},
    act=act,
    time_limited=True,
)
