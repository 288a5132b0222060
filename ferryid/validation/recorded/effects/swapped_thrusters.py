"""Two thrusters whose records are exchanged: a record that is wrong altogether, of which nothing may be named."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import Drive, drives
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog


def alike(log: RecordedLog) -> list[tuple[Drive, Drive]]:
    """Return pairs of actuators at different places whose records can stand for each other."""
    return [
        (one, other)
        for one, other in combinations(drives(log).values(), 2)
        if one.actuator.position_m != other.actuator.position_m
        and (one.role, bool(one.turn)) == (other.role, bool(other.turn))
        and len(log.columns[one.column]) == len(log.columns[other.column])
    ]


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return the error, which has no size; the thrusters are those of the first pair."""
    return Truth("swapped_thrusters", None, {})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Exchange the records of the first pair."""
    one, other = alike(log)[0]
    pairs = [(one.column, other.column), *([(one.turn, other.turn)] if one.turn else [])]
    return Concealed(log.changed({a: log.columns[b] for pair in pairs for a, b in (pair, pair[::-1])}))


CONCEALMENT = Concealment(
    "swapped_thrusters",
    ACTUATOR,
    "",
    "The records of two thrusters are exchanged; a log that is so wrong is to be refused or left unexplained.",
    lambda log: (0.5, 1.0),
    sample,
    conceal,
    lambda log: "" if alike(log) else "no two actuators of it are recorded alike",
    gross=True,
)
