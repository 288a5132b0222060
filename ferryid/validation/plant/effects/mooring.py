"""A mooring line, which stiffens as it is stretched."""

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
    random_vector,
    span_limits,
)
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.validation.plant.plant import Plant

STIFFENING_M = 40.0
"""Distance at which a line is a tenth stiffer than at rest."""


class Mooring(NamedTuple):
    """A line: stiffness north and east [N/m], place north and east [m], shape (4,), and when it is on [s] (2,)."""

    line: Floats
    span: Floats


NO_LINE = Mooring(np.zeros(4), np.array(ALWAYS))


@compiled
def mooring_load(mooring: Mooring, t: float, north: float, east: float, R: Floats, out: Floats) -> None:
    """Add the pull of a line at a place to a load (6,); R turns body axes to the world's (3, 3)."""
    if mooring.line[0] + mooring.line[1] > 0.0 and mooring.span[0] <= t < mooring.span[1]:
        dn, de = north - mooring.line[2], east - mooring.line[3]
        stiffer = 1.0 + 0.1 * (dn * dn + de * de) / STIFFENING_M**2
        pull = R.T @ np.array([-mooring.line[0] * dn * stiffer, -mooring.line[1] * de * stiffer, 0.0])
        for i in range(3):
            out[i] += pull[i]


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a line on which the vessel swings at 0.06 rad/s times the root of the size."""
    stiffness = [size * 0.0036 * vessel.mass * float(rng.uniform(0.6, 1.6)) for _ in range(2)]
    place = random_vector(vessel.leg_m * rng.uniform(0.2, 0.8), rng)
    names = ("stiffness_north", "stiffness_east", "north", "east")
    conditions = {"mooring": (*stiffness, *place), "mooring_span": span_limits(span)}
    return injection("mooring", dict(zip(names, (*stiffness, *place), strict=True)), conditions, span=span)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Tie the vessel to a place within a span of time."""
    line, span = np.array(conditions["mooring"]), np.array(conditions["mooring_span"])
    plant.world = plant.world._replace(mooring=Mooring(line, span))


EFFECT = PlantEffect(
    "mooring",
    "(0.06 rad/s)²",
    (0.002, 3.0),
    1.0,
    sample,
    rank=13,
    settings={"mooring": (0.0, 0.0, 0.0, 0.0), "mooring_span": ALWAYS},
    act=act,
    time_limited=True,
)
