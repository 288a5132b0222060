"""Sizes of effects that were tested and not found, below which a log would probably not have shown them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import hypot, isfinite

import numpy as np

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.claims import Key
from ferryid.diagnose.judging.detection_power import DetectionPower
from ferryid.effects.effect import HELD
from ferryid.effects.wording import titled
from ferryid.json_record import Record
from ferryid.types import Floats


@dataclass(frozen=True)
class LeastSize(Record):
    """The size from which on an effect has an even chance to be named in a log.

    Attributes
    ----------
    effect, instance
        Effect id and thruster.
    value
        Of its first parameter, or the length of the vector of those that have its unit; of a factor, the distance from one.
        None where no size that it may have would be seen.
    unit
        Of it; ``-`` for a share.
    says
        As a sentence.
    """

    effect: str
    instance: str | None
    value: float | None
    unit: str
    says: str

    @property
    def text(self) -> str:
        """The size with its unit."""
        return _text(self.value, self.unit)


def least_sizes(
    problem: EstimationProblem, kept: Fit, powers: Sequence[DetectionPower], named: Collection[Key] = ()
) -> tuple[LeastSize, ...]:
    """Return the least size that a log would have shown of each effect that was not found in it.

    Parameters
    ----------
    problem, kept
        The log, and what was found in it.
    powers
        From `ferryid.diagnose.judging.detection_power.detection_powers`: multiples of the usual size at which the evidence
        has an even chance. What moves the vessel less than `INFERENCE.void_share`, or is less than the effect's least size, is
        not named whatever the evidence.
    named
        What has a finding that is not of this fit: of all logs of a campaign, or of the sensors.
    """
    force_model = fitted_force_model(problem.plain, kept)
    windows = problem.windows
    before = windows.gap(force_model)
    usual = np.maximum(np.sqrt(np.mean(windows.measured[:, windows.channels] ** 2, axis=0)), 1e-12)
    made = []
    for one in powers:
        candidate = one.candidate
        if candidate.key in named:
            continue
        moved = windows.gap(candidate.act(force_model, one.usual)) - before
        share = float((np.sqrt(np.mean(moved**2, axis=0)) / usual).max())
        multiple = max(one.multiple, INFERENCE.void_share / max(share, 1e-12))
        size = size_of(candidate, one.usual)
        if size > 0.0:
            multiple = max(multiple, candidate.effect.negligible / size)
        made.append(_least(candidate, multiple * size if multiple <= _largest(candidate, one.usual) else None))
    return tuple(made)


def _least(candidate: Candidate, value: float | None) -> LeastSize:
    unit = candidate.parameters[0].unit
    name = titled(candidate.effect.title, candidate.instance)
    neutral = candidate.parameters[0].neutral
    if value is None or not isfinite(value):
        return LeastSize(
            candidate.effect.id, candidate.instance, None, unit, f"{name} would not have been seen here at any size."
        )
    change = "a change " if neutral == 1.0 else ""
    sentence = f"{name}: {change}below {_text(value, unit)} would not have been seen here."
    return LeastSize(candidate.effect.id, candidate.instance, value, unit, sentence)


def _text(value: float | None, unit: str) -> str:
    if value is None:
        return "not at any size"
    return f"{_two_digits(100.0 * value)} %" if unit == "-" else f"{_two_digits(value)} {unit}"


def _two_digits(value: float) -> str:
    """Return a number of two significant digits, without an exponent where it is a hundred or more."""
    return f"{float(f'{value:.2g}'):g}"


def _mine(candidate: Candidate) -> list[int]:
    """Return the places of the parameters that make up the size: those of the unit of the first."""
    unit = candidate.parameters[0].unit
    return [k for k, one in enumerate(candidate.parameters) if one.unit == unit and one.size > HELD]


def size_of(candidate: Candidate, values: Floats) -> float:
    """Return how far parameters are from neutral: the length of a vector, else the largest."""
    away = [float(values[k]) - candidate.parameters[k].neutral for k in _mine(candidate)]
    names = {candidate.parameters[k].name for k in _mine(candidate)}
    vector = names <= {"north", "east"} or names <= {"x", "y"}
    return hypot(*away) if vector else max(map(abs, away))


def _largest(candidate: Candidate, usual: Floats) -> float:
    """Return the multiple of the usual size at which the first parameter that makes it up ends."""
    ends = []
    for k in _mine(candidate):
        one, value = candidate.parameters[k], float(usual[k])
        end = one.high if value > one.neutral else one.low
        if value != one.neutral:
            ends.append((end - one.neutral) / (value - one.neutral))
    return max(ends, default=float("inf"))
