"""Scores of runs: how often the truth was named, how large, since when; and what was named in its place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import sqrt
from typing import Any

import numpy as np

from ferryid.diagnose.result import HINT
from ferryid.effects import effects
from ferryid.prove.names import Share
from tests.reach.draw import groups
from tests.reach.places import PLACES

Line = Mapping[str, Any]
NONE, UNKNOWN, OTHER = "none", "unknown", "wrong thruster"
WITHIN = 0.1
"""Relative error of a parameter that the targets allow."""
ONSET_S = 5.0
NEUTRAL = {"yaw_rate_scale": {"factor": 1.0}, "velocity_scale": {"factor": 1.0}}
"""Neutral values of what only the checks of the sensors know."""


@dataclass(frozen=True)
class Score:
    """Scores of a cell, or of several together.

    Attributes
    ----------
    runs
        How many.
    first
        Runs whose first name is a truth, of those that have one.
    every
        Runs all of whose truths were named.
    false
        Runs in which something was named that is neither there nor allowed for.
    mentioned
        Runs without a truth in which anything is a finding at all, however improbable.
    refused
        Runs that ended in an error message.
    errors
        Relative errors of parameters of what was named rightly; of vectors, in their length.
    half_widths
        Half of the 95 % intervals, relative in the same way.
    reaches
        How far the truth is from each parameter that was found, in parts of the way to the end of its 95 % interval there.
    onsets_s
        Errors of onsets and offsets [s], infinite where none was found.
    onset_held
        Onsets whose 95 % interval holds the truth.
    seconds
        Time of each diagnosis.
    """

    runs: int
    first: Share
    every: Share
    false: Share
    mentioned: Share
    refused: int
    errors: Sequence[float] = field(default_factory=tuple)
    half_widths: Sequence[float] = field(default_factory=tuple)
    reaches: Sequence[float] = field(default_factory=tuple)
    onsets_s: Sequence[float] = field(default_factory=tuple)
    onset_held: Share = field(default_factory=lambda: Share(0, 0))
    seconds: Sequence[float] = field(default_factory=tuple)

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
        """Return how many onsets are within `ONSET_S`."""
        return Share(sum(error <= ONSET_S for error in self.onsets_s), len(self.onsets_s))


def names(line: Line) -> list[tuple[str, str | None]]:
    """Return what a run names, the first first: effect and instance."""
    return [
        (one["effect"], one["instance"])
        for one in line["findings"]
        if one["probability"] > HINT and one["effect"] != UNKNOWN
    ]


def first_name(line: Line) -> str:
    """Return what a run names first as a column of the confusion matrix."""
    found = names(line)
    if not found:
        return UNKNOWN if any(one["effect"] == UNKNOWN for one in line["findings"]) else NONE
    effect, instance = found[0]
    wrong = [truth for truth in line["draw"]["truths"] if truth["effect"] == effect and truth["instance"] != instance]
    right = [truth for truth in line["draw"]["truths"] if truth["effect"] == effect and truth["instance"] == instance]
    return OTHER if wrong and not right else effect


def score(lines: Iterable[Line]) -> Score:
    """Return the scores of some runs together."""
    lines = list(lines)
    first = every = false = mentioned = refused = true = 0
    errors: list[float] = []
    widths: list[float] = []
    reaches: list[float] = []
    onsets: list[float] = []
    onset_held: list[bool] = []
    for line in lines:
        truths = line["draw"]["truths"]
        there = {(truth["effect"], truth["instance"]) for truth in truths}
        found = names(line)
        allowed = set(line["draw"]["allowed"])
        refused += "error" in line
        true += bool(truths)
        first += bool(found) and found[0] in there
        every += bool(truths) and there <= set(found)
        false += any(one not in there and one[0] not in allowed for one in found)
        mentioned += any(one["effect"] != UNKNOWN for one in line["findings"])
        for truth in truths:
            key = truth["effect"], truth["instance"]
            told = next((one for one in line["findings"] if (one["effect"], one["instance"]) == key), None)
            if told is None or key not in found:
                continue
            acted = line.get("acted", {}).get(truth["effect"], truth["values"])
            more, wide, apart = _parameters({**truth, "values": acted}, told, line["draw"]["place"])
            errors += more
            widths += wide
            reaches += apart
            for end in ("onset", "offset"):
                when = truth.get(f"{end}_s")
                if when is None:
                    continue
                onsets.append(abs(told[end] - when) if told[end] is not None else float("inf"))
                interval = told["parameters"].get(end)
                onset_held.append(interval is not None and interval["low"] <= when <= interval["high"])
    n = len(lines)
    return Score(
        n,
        Share(first, true),
        Share(every, true),
        Share(false, n),
        Share(mentioned, n),
        refused,
        errors,
        widths,
        reaches,
        onsets,
        Share(sum(onset_held), len(onset_held)),
        [line["seconds"] for line in lines],
    )


def _parameters(
    truth: Mapping[str, Any], told: Mapping[str, Any], place: str
) -> tuple[list[float], list[float], list[float]]:
    """Return relative errors and half widths by vectors, and by parameters where in its interval the truth is (1: the end)."""
    effect = effects().get(truth["effect"])
    values = truth["values"]
    parameters = () if effect is None else effect.parameters_of(PLACES[place].profile)
    neutral = {one.name: one.neutral for one in parameters} or NEUTRAL.get(truth["effect"], {})
    vectors = [group for group in groups(parameters) if set(group) <= set(values)] or [(name,) for name in values]
    errors, widths, reaches = [], [], []
    for vector in vectors:
        known = [name for name in vector if name in told["parameters"]]
        size = sqrt(sum((values[name] - neutral.get(name, 0.0)) ** 2 for name in vector))
        if len(known) < len(vector) or size == 0.0:
            continue
        found = [told["parameters"][name] for name in vector]
        away = sqrt(sum((one["value"] - values[name]) ** 2 for one, name in zip(found, vector, strict=True)))
        errors.append(away / size)
        widths.append(sqrt(sum((0.5 * (one["high"] - one["low"])) ** 2 for one in found)) / size)
        reaches += [_reach(one, values[name]) for one, name in zip(found, vector, strict=True)]
    return errors, widths, reaches


def _reach(estimate: Mapping[str, float], truth: float) -> float:
    """Return how far the truth is from an estimate, in parts of the way to the end of its interval on that side."""
    value = estimate["value"]
    end = estimate["high"] if truth > value else estimate["low"]
    if truth == value:
        return 0.0
    return abs(truth - value) / abs(end - value) if end != value else float("inf")


def quantile(values: Sequence[float], share: float) -> float:
    """Return a quantile, NaN of nothing."""
    return float(np.quantile(np.asarray(values), share, method="inverted_cdf")) if values else float("nan")


def confusion(lines: Iterable[Line]) -> tuple[list[str], list[str], list[list[int]]]:
    """Return rows (cells with at most one truth), columns (first names) and counts."""
    counts: dict[str, dict[str, int]] = {}
    for line in lines:
        if len(line["draw"]["truths"]) > 1:
            continue
        row = counts.setdefault(line["draw"]["cell"], {})
        column = first_name(line)
        row[column] = row.get(column, 0) + 1
    columns = sorted({name for row in counts.values() for name in row} - {NONE, UNKNOWN, OTHER})
    columns += [OTHER, UNKNOWN, NONE]
    return list(counts), columns, [[row.get(name, 0) for name in columns] for row in counts.values()]
