"""Gusts about a steady wind."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_vector
from ferryid.validation.plant.effects.gusts import gusts
from ferryid.validation.recorded.allocation import conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment
from ferryid.validation.recorded.effects.wind import cannot
from ferryid.validation.recorded.hull import wind_load
from ferryid.validation.recorded.log import RecordedLog

MEAN = 3.0
"""Steady wind over the standard deviation of its gusts: the middle of those of the plant."""
TIME_S = 8.0
"""Time scale of the spectrum [s]."""


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return gusts [m/s]; the time constants of the two spectra are not comparable, so that none is among the true values."""
    return Truth("gusts", None, {"std": size})


def winds(log: RecordedLog, std: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return the steady wind, shape (2,), and with its gusts, shape (2, n) [m/s]."""
    mean = np.array(random_vector(MEAN * std, rng))
    return mean, mean[:, None] + gusts(rng, log.measurements.t, std, TIME_S).T


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less what the gusty wind adds to the load of still air."""
    return conceal_load(log, wind_load(log, winds(log, truth.values["std"], rng)[1]))


def of_gusts(log: RecordedLog, truth: Truth) -> Floats:
    """Return the actuators' forces, one of which claims less by the gusts alone: the steady wind is another effect."""
    mean, gusty = winds(log, truth.values["std"], np.random.default_rng(0))
    parts = log.measurements.parts.copy()
    parts[:, 0] -= wind_load(log, gusty) - wind_load(log, mean)
    return parts


CONCEALMENT = Concealment(
    "gusts",
    LOAD,
    "m/s",
    f"Actuators claim less by the load of gusts of Kaimal's spectrum; their mean, {MEAN:g} times as large, may be named too.",
    lambda log: (0.1, 4.0),
    sample,
    conceal,
    cannot,
    parts=of_gusts,
    allowed=("wind",),
)
