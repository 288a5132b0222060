"""Gusts about a mean wind, of Kaimal's spectrum; that of the estimated effect is a Gauss-Markov process."""

from __future__ import annotations

from math import pi

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, random_vector
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel

COMPONENTS = 72


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return gusts [m/s] about a wind of twice to four times as much.

    The time constants of the two spectra are not comparable, so that none is among the true values.
    """
    time_s = float(rng.uniform(4.0, 12.0))
    north, east = random_vector(size * rng.uniform(2.0, 4.0), rng)
    truths = (Truth("gusts", None, {"std": size}), Truth("wind", None, {"north": north, "east": east}))
    return Injection({"wind": (north, east), "gust_std": size, "gust_time": time_s}, truths)


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Add gusts of a standard deviation [m/s] and a time scale [s]."""
    plant.air = plant.air + gusts(rng, plant.t, conditions["gust_std"], conditions["gust_time"])


def gusts(rng: np.random.Generator, t: Floats, std: float, time_s: float) -> Floats:
    """Return gusts about the mean along north and east [m/s], shape (n, 2): cosines of random phase, Kaimal's spectrum.

    The spectrum is ``S(f) ~ 1 / (1 + 6 f T)^(5/3)``, which is correlated as long as a Gauss-Markov process of time constant T.
    """
    if std == 0.0:
        return np.zeros((len(t), 2))
    edges = np.geomspace(1e-3, 1.0, COMPONENTS + 1)
    frequency = rng.uniform(edges[:-1], edges[1:], (2, COMPONENTS))
    power = np.diff(edges) / (1.0 + 6.0 * frequency * time_s) ** (5.0 / 3.0)
    amplitude = std * np.sqrt(2.0 * power / power.sum(axis=1, keepdims=True))
    phase = rng.uniform(0.0, 2.0 * pi, (2, COMPONENTS))
    return np.column_stack(
        [(amplitude[k] * np.cos(2.0 * pi * np.outer(t, frequency[k]) + phase[k])).sum(axis=1) for k in range(2)]
    )


EFFECT = PlantEffect(
    "gusts",
    "m/s",
    (0.1, 2.5),
    1.0,
    sample,
    rank=2,
    settings={"gust_std": 0.0, "gust_time": 8.0},
    act=act,
    stream=1,
    stochastic=True,
)
