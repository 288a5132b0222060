"""Steady current, one that sets in or slackens, and one that turns over the trial."""

from __future__ import annotations

import numpy as np

from ferryid.validation.plant.effects.effect import (
    ALWAYS,
    Conditions,
    Injection,
    PlantEffect,
    Span,
    injection,
    random_vector,
    span_limits,
)
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel

CHANGE_S = 20.0
"""Time in which it sets in or slackens."""


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a current of a speed [m/s]."""
    north, east = random_vector(size, rng)
    conditions = {"current": (north, east), "current_span": span_limits(span)}
    return injection("current", {"north": north, "east": east}, conditions, span=span)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Add the current, north and east [m/s], within its span, turning at a rate [deg/min]."""
    begin, end = conditions["current_span"]
    # What runs from the start never sets in.
    ends = [(plant.t - time) / CHANGE_S + 0.5 for time in (begin or -ALWAYS[1], end)]
    begun, over = (np.clip(one, 0.0, 1.0) for one in ends)
    turn = np.radians(conditions["current_turn"]) * plant.t / 60.0
    north, east = conditions["current"]
    c, s = np.cos(turn), np.sin(turn)
    along = np.column_stack([c * north - s * east, s * north + c * east])
    plant.water = plant.water + (begun - over)[:, None] * along


EFFECT = PlantEffect(
    "current",
    "m/s",
    (0.0005, 0.4),
    0.15,
    sample,
    rank=3,
    settings={"current": (0.0, 0.0), "current_turn": 0.0, "current_span": ALWAYS},
    act=act,
    time_limited=True,
)
