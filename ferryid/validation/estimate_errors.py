"""Errors of the estimates of effects that were named rightly: parameters, their intervals, and times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot, inf
from typing import ClassVar, Protocol

import numpy as np

from ferryid.diagnose import Estimate
from ferryid.json_record import Record
from ferryid.validation.case import Truth, parameter_vectors
from ferryid.validation.name_scores import Share, label, named_findings
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.records import CaseResult, Finding

WITHIN = 0.1
"""Relative error of a parameter that is small."""
IN_TIME_S = 5.0
"""Error of an onset or offset that is small [s]."""


@dataclass(frozen=True)
class Outside(Record):
    """An interval that does not hold the truth.

    Attributes
    ----------
    cell
        Of the case.
    effect, parameter, truth
        Whose estimate, and what it should have been.
    estimate
        With its 95 % interval.
    beside
        What else was in the log, and what else was named of it.
    """

    cell: str
    effect: str
    parameter: str
    truth: float
    estimate: Estimate
    beside: tuple[str, ...]


@dataclass(frozen=True)
class EstimateErrors(Record):
    """Errors of some estimates.

    Attributes
    ----------
    effect
        Effect id, or ``all``.
    found
        How many were named.
    errors
        Errors relative to how far the truth is from changing nothing; of vectors, in their length.
    reaches
        How far the truth is from each parameter, in parts of the way to the end of its 95 % interval on that side.
    times_s
        Errors of onsets and offsets [s], infinite where none was found.
    times_held
        Onsets and offsets whose 95 % interval holds the truth.
    outside
        The intervals that do not hold it.
    """

    DERIVED: ClassVar[Mapping[str, str]] = {name: name for name in ("median_error", "within", "covered", "in_time")}

    effect: str
    found: int
    errors: tuple[float, ...]
    reaches: tuple[float, ...]
    times_s: tuple[float, ...]
    times_held: Share
    outside: tuple[Outside, ...] = ()

    @property
    def median_error(self) -> float:
        """Return the median of the relative errors, NaN of none."""
        return float(np.median(self.errors)) if self.errors else float("nan")

    @property
    def within(self) -> Share:
        """Return how many parameters are within `WITHIN`."""
        return Share(sum(error <= WITHIN for error in self.errors), len(self.errors))

    @property
    def covered(self) -> Share:
        """Return how many parameters' intervals hold the truth."""
        return Share(sum(reach <= 1.0 for reach in self.reaches), len(self.reaches))

    @property
    def in_time(self) -> Share:
        """Return how many onsets and offsets are within `IN_TIME_S`."""
        return Share(sum(error <= IN_TIME_S for error in self.times_s), len(self.times_s))


class Parameters(Protocol):
    """What is known of the parameters of an effect: the value that changes nothing, and which of them are places."""

    @property
    def neutral(self) -> float: ...
    @property
    def positions(self) -> tuple[str, ...]: ...


def estimate_errors(
    results: Iterable[CaseResult], effects: Mapping[str, Parameters] | None = None
) -> tuple[EstimateErrors, ...]:
    """Return the errors of what was named rightly: of everything first, then effect by effect.

    Parameters
    ----------
    results
        Of finished cases.
    effects
        Injected effects by their ids; those of the plant where None.
    """
    known = plant_effects() if effects is None else effects
    found: dict[str, list[EstimateErrors]] = {}
    for result in results:
        named = named_findings(result)
        for truth in result.truths:
            if truth.key in named:
                one = named[truth.key]
                values = result.values(truth, one)
                errors = _errors(truth, known[truth.effect], values, one)
                others = dict.fromkeys(label(key) for key in (*(each.key for each in result.truths), *named))
                beside = tuple(other for other in others if other != label(truth.key))
                outside = tuple(
                    Outside(result.case.cell, label(truth.key), name, value, one.parameters[name], beside)
                    for vector in parameter_vectors(list(values))
                    if all(name in one.parameters for name in vector)
                    for name, value in ((name, values[name]) for name in vector)
                    if _reach(one.parameters[name], value) > 1.0
                )
                found.setdefault(truth.effect, []).append(replace(errors, outside=outside))
    every = [one for some in found.values() for one in some]
    return (_joined("all", every), *(_joined(effect, found[effect]) for effect in sorted(found)))


def _errors(truth: Truth, effect: Parameters, values: Mapping[str, float], finding: Finding) -> EstimateErrors:
    estimates = finding.parameters
    errors, reaches = [], []
    for vector in parameter_vectors(list(values)):
        if not all(name in estimates for name in vector):
            continue
        size = hypot(*(values[name] - effect.neutral for name in vector))
        reaches += [_reach(estimates[name], values[name]) for name in vector]
        if size > 0.0 and not set(vector) <= set(effect.positions):
            errors.append(hypot(*(estimates[name].value - values[name] for name in vector)) / size)
    times, held = [], []
    for end, when, found in (("onset", truth.onset_s, finding.onset), ("offset", truth.offset_s, finding.offset)):
        if when is None:
            continue
        times.append(inf if found is None else abs(found - when))
        interval = estimates.get(end)
        held.append(interval is not None and interval.low <= when <= interval.high)
    times_held = Share(sum(held), len(held))
    return EstimateErrors(truth.effect, 1, tuple(errors), tuple(reaches), tuple(times), times_held)


def _joined(effect: str, some: Sequence[EstimateErrors]) -> EstimateErrors:
    return EstimateErrors(
        effect,
        len(some),
        tuple(error for one in some for error in one.errors),
        tuple(reach for one in some for reach in one.reaches),
        tuple(error for one in some for error in one.times_s),
        Share(sum(one.times_held.count for one in some), sum(one.times_held.of for one in some)),
        tuple(each for one in some for each in one.outside),
    )


def _reach(estimate: Estimate, truth: float) -> float:
    """Return how far the truth is from an estimate, in parts of the way to the end of its interval on that side."""
    value = estimate.value
    end = estimate.high if truth > value else estimate.low
    if truth == value:
        return 0.0
    return abs(truth - value) / abs(end - value) if end != value else inf
