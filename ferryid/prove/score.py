"""Figures of merit of the proof, from the lines of its finished cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from ferryid.prove.calibration import calibrated
from ferryid.prove.curves import Curve, Ratio, curve, ratio
from ferryid.prove.names import (
    Cell,
    Confusion,
    Line,
    Share,
    cells,
    confusion,
    false_names,
    hints_of_nothing,
    instead,
    key_of,
    names,
    strictly_wrong,
    truths,
)
from ferryid.prove.recovery import Recovery, recoveries
from ferryid.prove.second_log import Claim, Method, claims, methods, missing

CLEAN = "clean"
"""Kind of the cells in which nothing is concealed: what an oracle gains there, it gains by chance."""
TOO_SMALL = "too small to be worth a name"
"""What became of an effect that the oracle itself finds smaller than what a diagnosis names."""
SHOWN = {Share: ("value", "interval"), Curve: ("says",), Recovery: ("median_error", "within", "covered", "in_time")}
"""Properties that stand in the plain data beside the fields."""


@dataclass(frozen=True)
class Detection:
    """How large an effect has to be to be named.

    Attributes
    ----------
    cell
        Of the cases, such as ``wind``.
    effect
        What is concealed in them in one size after another.
    blind
        By the diagnosis.
    oracle
        By an oracle, from the runs that it saw; None where it saw none.
    threshold
        Gain that the oracle had to exceed [nats], the largest of the runs.
    ratio
        The size that the diagnosis names reliably over that of the oracle.
    sizes, blind_named
        Of every run, and whether the diagnosis named the effect.
    oracle_sizes, oracle_named
        Of the runs that the oracle saw, and whether it did.
    instead
        What became of the effect in runs in which the oracle alone named it, and how often.
    """

    cell: str
    effect: str
    blind: Curve
    oracle: Curve | None
    threshold: float
    ratio: Ratio | None
    sizes: tuple[float, ...]
    blind_named: tuple[bool, ...]
    oracle_sizes: tuple[float, ...]
    oracle_named: tuple[bool, ...]
    instead: Mapping[str, int]


@dataclass(frozen=True)
class Scores:
    """All figures of merit.

    Attributes
    ----------
    runs
        How many.
    confusion
        First names.
    false_names
        Share of runs with a wrong name: of ``all``, and by kind of cell.
    strict
        Share of runs that name anything that is not in the log, whatever was said not to be wrong.
    hinted
        Share of runs with a hint of something that is not in the log.
    verdicts
        Of the runs in which nothing is concealed, how many of each.
    cells
        How often what was concealed was named.
    recoveries
        How near it is to the truth, everything first, then by effect.
    claims
        Claimed improvement against the one on a second log, by axis.
    methods
        The diagnosis beside its rivals.
    missing
        Why a rival could not be asked, by its name.
    detections
        Curves by cell.
    median_ratio
        Of the ratios of all detections that have one; NaN where none does.
    thresholds
        Of the oracle, by effect, where clean logs say more than its floor or as much [nats].
    seconds
        Of the median diagnosis, and of the slowest.
    oracle_seconds
        The same of the oracle.
    """

    runs: int
    confusion: Confusion
    false_names: Mapping[str, Share]
    strict: Share
    hinted: Share
    verdicts: Mapping[str, int]
    cells: tuple[Cell, ...]
    recoveries: tuple[Recovery, ...]
    claims: tuple[Claim, ...]
    methods: tuple[Method, ...]
    missing: Mapping[str, str]
    detections: tuple[Detection, ...]
    median_ratio: float
    thresholds: Mapping[str, float]
    seconds: tuple[float, float]
    oracle_seconds: tuple[float, float]


def score(lines: Sequence[Line]) -> Scores:
    """Return the figures of merit of finished cases.

    Parameters
    ----------
    lines
        One a case: ``case``, as `ferryid.prove.case.Case.as_json` gives it; ``told`` (``verdict``, ``findings``, ``notes``,
        and ``error`` where the log was refused); ``seconds``; and, where they were made, ``oracle``, as
        `ferryid.prove.oracle.Told.as_json` gives it (of clean logs by `ferryid.prove.oracle.oracle_of_each`), ``acted`` (what
        a disturbance really did, in the place of a truth's values), ``second`` (errors on a second log by method) and
        ``rival_names``.
    """
    thresholds = calibrated(
        one for line in lines if line["case"]["kind"] == CLEAN and not truths(line) for one in _recovered(line)
    )
    found = detections(lines, thresholds)
    ratios = [one.ratio.value for one in found if one.ratio is not None and one.ratio.value is not None]
    return Scores(
        len(lines),
        confusion(lines),
        false_names(lines),
        Share(sum(bool(strictly_wrong(line)) for line in lines), len(lines)),
        Share(sum(bool(hints_of_nothing(line)) for line in lines), len(lines)),
        Counter(
            str(line["told"].get("verdict")) for line in lines if not truths(line) and line["case"]["kind"] == CLEAN
        ),
        cells(lines),
        recoveries(lines),
        claims(lines),
        methods(lines),
        missing(lines),
        found,
        float(np.median(ratios)) if ratios else nan,
        thresholds,
        _times([float(line["seconds"]) for line in lines]),
        _times([float(line["oracle"]["seconds"]) for line in lines if _recovered(line)]),
    )


def detections(lines: Sequence[Line], thresholds: Mapping[str, float]) -> tuple[Detection, ...]:
    """Return the detection curves of all cells whose cases have a level.

    Parameters
    ----------
    lines
        As in `score`.
    thresholds
        Of the oracle, by effect, from `ferryid.prove.calibration.calibrated`; its own floor where there is none.
    """
    by_cell: dict[str, list[Line]] = {}
    for line in lines:
        if line["case"]["level"] is not None and line["case"]["size"] > 0.0 and truths(line):
            by_cell.setdefault(line["case"]["cell"], []).append(line)
    return tuple(_detection(cell, some, thresholds) for cell, some in by_cell.items())


def to_json(scores: Any) -> Any:
    """Return scores, or any part of them, as plain data; what is not finite becomes None."""
    if is_dataclass(scores):
        plain = {one.name: to_json(getattr(scores, one.name)) for one in fields(scores)}
        return plain | {name: to_json(getattr(scores, name)) for name in SHOWN.get(type(scores), ())}
    if isinstance(scores, Mapping):
        return {str(key): to_json(value) for key, value in scores.items()}
    if isinstance(scores, list | tuple):
        return [to_json(value) for value in scores]
    if isinstance(scores, float):
        return scores if isfinite(scores) else None
    return scores


def _detection(cell: str, lines: Sequence[Line], thresholds: Mapping[str, float]) -> Detection:
    sizes, blind, told, least, lost = [], [], [], list[float](), Counter[str]()
    for line in lines:
        # Beside a gust there is its wind: the cell is called after what its size is of.
        own = next((one for one in truths(line) if one["effect"] == cell), truths(line)[0])
        sizes.append(float(line["case"]["size"]))
        blind.append(key_of(own) in names(line))
        one = next((one for one in _recovered(line) if key_of(one) == key_of(own)), None)
        if one is not None:
            least.append(max(float(one["floor"]), thresholds.get(own["effect"], 0.0)))
        told.append(None if one is None else bool(one["gain"] > least[-1]))
        if told[-1] and not blind[-1]:
            lost[TOO_SMALL if one and one.get("idle") else instead(line, key_of(own))] += 1
    effect = next((one["effect"] for one in truths(lines[0]) if one["effect"] == cell), truths(lines[0])[0]["effect"])
    seen = [k for k, answer in enumerate(told) if answer is not None]
    seen_sizes, answers = [sizes[k] for k in seen], [bool(told[k]) for k in seen]
    return Detection(
        cell,
        effect,
        curve(sizes, blind),
        curve(seen_sizes, answers) if seen else None,
        max(least, default=nan),
        ratio(seen_sizes, [blind[k] for k in seen], answers) if seen else None,
        tuple(sizes),
        tuple(blind),
        tuple(seen_sizes),
        tuple(answers),
        dict(lost.most_common()),
    )


def _recovered(line: Line) -> list[Mapping[str, Any]]:
    return list((line.get("oracle") or {}).get("recovered") or ())


def _times(seconds: Sequence[float]) -> tuple[float, float]:
    return (float(np.median(seconds)), max(seconds)) if seconds else (nan, nan)
