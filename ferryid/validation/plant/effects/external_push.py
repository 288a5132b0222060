"""A push from outside for a while: a line ashore from near midship, hauled by hand, now more and now less."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, random_vector
from ferryid.validation.plant.paths import duration_s
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.validation.plant.plant import Plant
    from ferryid.validation.plant.trial import Trial

RISE_S = 2.0
"""Time in which the force grows, and falls again."""
HEAVES, HEAVE_S = 0.15, 7.0
"""How much more and less is pulled, as a share, and in what time."""
ID = "external_push"


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a push that gives the vessel this acceleration, for 90 to 180 s in the midst of the log.

    Shorter ones are hints by rule, as nothing can be held out of them.
    The moment is not constant while the vessel turns: what it is on average is measured in the trial.
    """
    whole = duration_s("calibration")
    begin = float(rng.uniform(0.2, 0.7)) * whole
    end = begin + float(rng.uniform(90.0, 180.0))
    north, east = random_vector(size * vessel.mass, rng)
    place = float(rng.uniform(-0.03, 0.03)) * vessel.length
    return Injection({"push": (north, east, place), "push_span": (begin, end)}, (Truth(ID, None, {}, begin, end),))


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Pull with a force to the north and the east [N] at a place forward of midship [m], half of it at either time."""
    north, east, place = conditions["push"]
    begin, end = conditions["push_span"]
    if north == 0.0 and east == 0.0:
        return

    def load(t: float, y: Floats, out: Floats) -> None:
        share = np.clip((t - begin) / RISE_S + 0.5, 0.0, 1.0) - np.clip((t - end) / RISE_S + 0.5, 0.0, 1.0)
        share *= 1.0 + HEAVES * sin(2.0 * pi * (t - begin) / HEAVE_S)
        c, s = cos(y[5]), sin(y[5])
        X, Y = share * (c * north + s * east), share * (c * east - s * north)
        # At the height of the waterline, so that nothing heels.
        out[0], out[1], out[5] = X, Y, place * Y

    plant.loads[ID] = load


def realised(trial: Trial, conditions: Conditions) -> Mapping[str, float]:
    """Return the force over ground and the mean moment while it acted."""
    if ID not in trial.loads:
        return {}
    begin, end = conditions["push_span"]
    acts = (trial.t >= begin) & (trial.t < end)
    north, east, _ = conditions["push"]
    return {"north": north, "east": east, "moment": float(trial.loads[ID][acts, 5].mean())}


EFFECT = PlantEffect(
    ID,
    "m/s²",
    (0.002, 0.3),
    0.05,
    sample,
    rank=23,
    settings={"push": (0.0, 0.0, 0.0), "push_span": (0.0, 0.0)},
    act=act,
    realised=realised,
)
