"""What an effect of the plant is: its physics, the sizes that are sampled, and what ought to be found of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.validation.plant.plant import Plant
    from ferryid.validation.plant.trial import Trial

Conditions = Mapping[str, Any]
"""Settings of a trial by name: those of every effect, and ``noise``, a factor on the errors of the navigation."""
Span = tuple[float | None, float | None]
"""From when until when [s]; None for the start of the log, or its end."""
ALWAYS = (0.0, 1e9)


@dataclass(frozen=True)
class Injection:
    """What is injected into a trial.

    Attributes
    ----------
    conditions
        Settings of the plant.
    truths
        What ought to be named.
    hull_factors
        What the coefficients of the profile's hull are multiplied by.
    """

    conditions: Conditions
    truths: tuple[Truth, ...]
    hull_factors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class PlantEffect:
    """An effect of the plant.

    Attributes
    ----------
    id
        Effect id, as a finding has it.
    unit
        Of its size.
    sizes
        Smallest and largest size that is sampled, from invisible to gross on the 6 m ferry.
    moderate
        A size that a user would want to know of.
    sample
        ``sample(size, vessel, rng, span)`` draws it in a size for a vessel, within a span of time.
    rank
        Place in draws and reports: the cases of a seed depend on the order of the effects. Those without one come last.
    settings
        Names of its settings, with values at which nothing acts.
    act
        ``act(plant, conditions, rng)`` puts it into the plant.
    stream
        Number of its random stream in a trial; one by its id where None.
    realised
        ``realised(trial, conditions)`` measures parameters in a trial that no setting gives; empty where it does not act.
    oracle
        ``oracle(measurements)`` estimates an error of a sensor from kinematics alone: a
        `ferryid.validation.oracle_sensors.SensorEstimate`. Forces are estimated with the effect of `ferryid.effects`.
    time_limited
        True where it may begin and end during the log.
    stochastic
        True for a disturbance that comes and goes by chance: it is not combined with others.
    excludes
        Effects that it is not combined with, as no log distinguishes them.
    neutral
        Value at which a parameter changes nothing; 0 for a limit, whose error is a share of the limit.
    vessel
        That its detection curve is of: the ferry, but for what the ferry's thrusters, which turn round, never do; that is not
        combined with others.
    positions
        Parameters that say where the effect acts, such as places on the chart, or how fast: their distance from neutral means
        nothing.
    """

    id: str
    unit: str
    sizes: tuple[float, float]
    moderate: float
    sample: Callable[[float, Vessel, np.random.Generator, Span], Injection]
    rank: float = float("inf")
    settings: Conditions = field(default_factory=dict)
    act: Callable[[Plant, Conditions, np.random.Generator], None] | None = None
    stream: int | None = None
    realised: Callable[[Trial, Conditions], Mapping[str, float]] | None = None
    oracle: Callable[[Any], Any] | None = None
    time_limited: bool = False
    stochastic: bool = False
    excludes: tuple[str, ...] = ()
    neutral: float = 0.0
    vessel: str = "ferry"
    positions: tuple[str, ...] = ()


def injection(
    effect: str,
    values: Mapping[str, float],
    conditions: Conditions,
    *,
    instance: str | None = None,
    span: Span = (None, None),
    hull_factors: Mapping[str, float] | None = None,
) -> Injection:
    """Return one injected effect."""
    return Injection(conditions, (Truth(effect, instance, dict(values), *span),), hull_factors or {})


def random_vector(size: float, rng: np.random.Generator) -> tuple[float, float]:
    """Return a vector of a length, in a random direction."""
    angle = rng.uniform(0.0, 2.0 * pi)
    return size * cos(angle), size * sin(angle)


def random_sign(rng: np.random.Generator) -> float:
    """Return 1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def span_limits(span: Span) -> tuple[float, float]:
    """Return a span as two times [s]."""
    return (span[0] or 0.0, 1e9 if span[1] is None else span[1])


def azimuth_names(vessel: Vessel) -> list[str]:
    """Return the names of the thrusters that turn."""
    return [one.name for one in vessel.thrusters if one.angle_deg is None]
