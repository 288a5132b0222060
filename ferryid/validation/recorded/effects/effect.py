"""What a concealment is: how the record is changed so that physics with an effect, and nothing else, explains it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ferryid.effects.force_model import ForceModel
from ferryid.types import Flags, Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.log import RecordedLog
from ferryid.vessel.dimensions import dimensions

SENSOR, ACTUATOR, LOAD = "sensor", "actuator", "load"
"""Families: what the navigation reports, what an actuator gives, and what acts on the hull besides."""


@dataclass(frozen=True, eq=False)
class Concealed:
    """A recording in which an effect is concealed.

    Attributes
    ----------
    log
        With the record changed.
    missed
        Share of the rewritten rows which cannot express it.
    why
        What those rows lack, as the end of a sentence.
    """

    log: RecordedLog
    missed: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class Concealment:
    """A way to conceal an effect.

    Attributes
    ----------
    id
        Effect id, as a finding has it.
    family
        `SENSOR`, `ACTUATOR` or `LOAD`.
    unit
        Of its size.
    how
        What is changed, as a sentence for the page.
    sizes
        ``sizes(log)`` returns the smallest and the largest size that is drawn for a vessel, from invisible to gross.
    sample
        ``sample(size, log, rng, span)`` draws what is concealed in a size; the truth has the parameters of the effect.
    conceal
        ``conceal(log, truth, rng)`` changes the record; the motion stays as it was, unless a sensor errs.
    cannot
        Why a recording cannot carry it, as the end of a sentence; empty where it can.
    neutral
        Value at which a parameter changes nothing.
    positions
        Parameters that are places, whose distance from neutral means nothing.
    time_limited
        True where it may begin within the log.
    visible
        ``visible(log)`` returns the size that an oracle sees of a sensor's error in what is measured; None where it is seen in
        forces, as in `ferryid.validation.recorded.oracle_size`.
    altered
        ``altered(force_model, truth)`` returns the force model without a sensor's error that forces alone show; None where the
        record of actuators is what is changed.
    parts
        ``parts(log, truth)`` returns the forces of the actuators, as in the measurements, that the motion is weighed
        against; None where the altered record gives them.
    allowed
        Effects that come with it and may be named too.
    gross
        True for a record that is wrong altogether: it has no size and no name, and is to be refused or left unexplained.
    """

    id: str
    family: str
    unit: str
    how: str
    sizes: Callable[[RecordedLog], tuple[float, float]]
    sample: Callable[[float, RecordedLog, np.random.Generator, Span], Truth]
    conceal: Callable[[RecordedLog, Truth, np.random.Generator], Concealed]
    cannot: Callable[[RecordedLog], str] = lambda log: ""
    neutral: float = 0.0
    positions: tuple[str, ...] = ()
    time_limited: bool = False
    visible: Callable[[RecordedLog], float | None] | None = None
    altered: Callable[[ForceModel, Truth], ForceModel] | None = None
    parts: Callable[[RecordedLog, Truth], Floats] | None = None
    allowed: tuple[str, ...] = ()
    gross: bool = False


def acting(truth: Truth, t: Floats) -> Flags:
    """Return at which times [s] an effect acts."""
    begin = -np.inf if truth.onset_s is None else truth.onset_s
    end = np.inf if truth.offset_s is None else truth.offset_s
    return np.asarray((t >= begin) & (t < end))


def length_of(log: RecordedLog) -> float:
    """Return the vessel's length [m], that by which a diagnosis judges what is on the hull."""
    return dimensions(log.profile)[0]
