"""A steady wind."""

from __future__ import annotations

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_vector
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment
from ferryid.validation.recorded.hull import wind_load
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a wind of a speed [m/s]."""
    north, east = random_vector(size, rng)
    return Truth("wind", None, {"north": north, "east": east})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less what the wind adds to the load of still air on the plant's boxes."""
    return conceal_load(log, wind_load(log, np.array([truth.values["north"], truth.values["east"]])))


def cannot(log: RecordedLog) -> str:
    """Return why a recording cannot carry it."""
    if log.measurements.wind is not None:
        return "the wind was measured"
    return "the profile has no wind areas" if log.profile.wind is None else cannot_carry(log)


CONCEALMENT = Concealment(
    "wind",
    LOAD,
    "m/s",
    "Actuators claim less by the load of a steady wind on boxes of the profile's areas, over that of still air.",
    lambda log: (0.2, 12.0),
    sample,
    conceal,
    cannot,
)
