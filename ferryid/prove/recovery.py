"""How near what was named rightly is to the truth: parameters, their intervals, and times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf
from typing import Any

import numpy as np

from ferryid.prove.case import vectors
from ferryid.prove.names import Line, Share, key_of, told, truths

WITHIN = 0.1
"""Relative error of a parameter that is small."""
IN_TIME_S = 5.0
"""Error of an onset or offset that is small [s]."""
FACTORS = ("thruster_gain", "fouling", "hull_parameters", "yaw_rate_scale", "velocity_scale", "shallow_water")
"""Effects whose parameters are factors, which change nothing at 1; others do so at 0."""
SIDES = {"shallow_water": ("south", "north", "west", "east")}
"""Parameters that are places on the chart, by effect: how far they are from nothing means nothing."""


@dataclass(frozen=True)
class Recovery:
    """How near some truths are found.

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
    """

    effect: str
    found: int
    errors: tuple[float, ...]
    reaches: tuple[float, ...]
    times_s: tuple[float, ...]
    times_held: Share

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


def recoveries(lines: Iterable[Line]) -> tuple[Recovery, ...]:
    """Return how near what was named rightly is to the truth: everything first, then effect by effect."""
    found: dict[str, list[Recovery]] = {}
    for line in lines:
        said = told(line)
        for truth in truths(line):
            if key_of(truth) in said:
                acted = (line.get("acted") or {}).get(truth["effect"], truth["values"])
                one = _recovery(truth, acted, said[key_of(truth)])
                found.setdefault(truth["effect"], []).append(one)
    every = [one for some in found.values() for one in some]
    return (_joined("all", every), *(_joined(effect, found[effect]) for effect in sorted(found)))


def neutral(effect: str) -> float:
    """Return the value at which a parameter of an effect changes nothing."""
    return 1.0 if effect in FACTORS else 0.0


def _recovery(truth: Mapping[str, Any], values: Mapping[str, float], told: Mapping[str, Any]) -> Recovery:
    estimates, errors, reaches = told["parameters"], [], []
    nothing, effect = neutral(truth["effect"]), truth["effect"]
    for vector in vectors(list(values)):
        if not all(name in estimates for name in vector):
            continue
        size = hypot(*(values[name] - nothing for name in vector))
        reaches += [_reach(estimates[name], values[name]) for name in vector]
        if size > 0.0 and not set(vector) <= set(SIDES.get(effect, ())):
            errors.append(hypot(*(estimates[name]["value"] - values[name] for name in vector)) / size)
    times, held = [], []
    for end in ("onset", "offset"):
        when = truth.get(f"{end}_s")
        if when is None:
            continue
        times.append(inf if told.get(end) is None else abs(told[end] - when))
        interval = estimates.get(end)
        held.append(interval is not None and interval["low"] <= when <= interval["high"])
    return Recovery(effect, 1, tuple(errors), tuple(reaches), tuple(times), Share(sum(held), len(held)))


def _joined(effect: str, some: Sequence[Recovery]) -> Recovery:
    return Recovery(
        effect,
        len(some),
        tuple(error for one in some for error in one.errors),
        tuple(reach for one in some for reach in one.reaches),
        tuple(error for one in some for error in one.times_s),
        Share(sum(one.times_held.count for one in some), sum(one.times_held.of for one in some)),
    )


def _reach(estimate: Mapping[str, float], truth: float) -> float:
    """Return how far the truth is from an estimate, in parts of the way to the end of its interval on that side."""
    value = estimate["value"]
    end = estimate["high"] if truth > value else estimate["low"]
    if truth == value:
        return 0.0
    return abs(truth - value) / abs(end - value) if end != value else inf
