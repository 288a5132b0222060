"""A steady current."""

from __future__ import annotations

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_vector
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment
from ferryid.validation.recorded.hull import cannot_be_damped, current_load
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a current of a speed [m/s]."""
    north, east = random_vector(size, rng)
    return Truth("current", None, {"north": north, "east": east})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less what the current adds to the forces of still water."""
    return conceal_load(log, current_load(log, np.array([truth.values["north"], truth.values["east"]])))


def cannot(log: RecordedLog) -> str:
    """Return why a recording cannot carry it."""
    if log.measurements.current is not None:
        return "the current was measured"
    return cannot_be_damped(log.profile) or cannot_carry(log)


CONCEALMENT = Concealment(
    "current",
    LOAD,
    "m/s",
    "Actuators claim less by what a current adds to the forces of still water on the plant's strips.",
    lambda log: (0.01, 0.6),
    sample,
    conceal,
    cannot,
)
