"""Figures of merit of a validation run, from the results of its cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from ferryid.json_record import Record
from ferryid.validation.detection_curves import Curve, Ratio, curve, ratio
from ferryid.validation.estimate_errors import EstimateErrors, estimate_errors
from ferryid.validation.name_scores import (
    Cell,
    Confusion,
    Share,
    cells,
    confusion,
    false_names,
    hints_not_in_log,
    names,
    names_not_in_log,
    outcome_of_missed,
)
from ferryid.validation.oracle_calibration import calibrated_thresholds
from ferryid.validation.records import CaseResult, OracleEstimate
from ferryid.validation.rival_scores import RivalScores, as_it_is, rival_scores
from ferryid.validation.sea_scores import SEA, SeaScores, sea_scores
from ferryid.validation.transfer_scores import Claim, Method, claims, failed_rivals, methods

CLEAN = "clean"
"""Kind of the cells in which nothing is injected: what an oracle gains there, it gains by chance."""
TOO_SMALL = "too small to be worth a name"
"""What became of an effect that the oracle itself finds smaller than what a diagnosis names."""


@dataclass(frozen=True)
class Detection(Record):
    """How large an effect has to be to be named.

    Attributes
    ----------
    cell
        Of the cases, such as ``wind``.
    effect
        What is injected into them in one size after another.
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
class Scores(Record):
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
        Share of runs that name anything that is not in the log, whatever the cases allow.
    hinted
        Share of runs with a hint of something that is not in the log.
    verdicts
        Of the runs in which nothing is injected, how many of each.
    cells
        How often injected effects were named.
    recoveries
        Errors of what was named rightly, of everything first, then by effect.
    claims
        Claimed improvement against the one on a transfer log, by axis.
    methods
        The diagnosis beside its rivals.
    missing
        Why a rival has no result, by its name.
    detections
        Curves by cell.
    median_ratio
        Of the ratios of all detections that have one; NaN where none does.
    thresholds
        Of the oracle, by effect, at least its floor, from clean logs [nats].
    seconds
        Of the median diagnosis, and of the slowest; campaigns count only where there is nothing else.
    oracle_seconds
        The same of the oracle.
    rivals
        The diagnosis beside other methods, on the cases on which these were run.
    sea
        Of the campaigns at sea, which no other figure counts; None where there are none.
    """

    runs: int
    confusion: Confusion
    false_names: Mapping[str, Share]
    strict: Share
    hinted: Share
    verdicts: Mapping[str, int]
    cells: tuple[Cell, ...]
    recoveries: tuple[EstimateErrors, ...]
    claims: tuple[Claim, ...]
    methods: tuple[Method, ...]
    missing: Mapping[str, str]
    detections: tuple[Detection, ...]
    median_ratio: float
    thresholds: Mapping[str, float]
    seconds: tuple[float, float]
    oracle_seconds: tuple[float, float]
    rivals: tuple[RivalScores, ...] = ()
    sea: SeaScores | None = None


def score(every: Sequence[CaseResult]) -> Scores:
    """Return the figures of merit of finished cases."""
    results = [result for result in every if result.case.kind != SEA]
    clean = [result for result in results if result.case.kind == CLEAN and not result.truths]
    thresholds = calibrated_thresholds(one for result in clean for one in _estimates(result))
    found = detections(results, thresholds)
    ratios = [one.ratio.value for one in found if one.ratio is not None and one.ratio.value is not None]
    oracles = [result.oracle for result in results if result.oracle is not None and result.oracle.recovered]
    return Scores(
        len(results),
        confusion(results),
        false_names(results),
        Share(sum(bool(names_not_in_log(result)) for result in results), len(results)),
        Share(sum(bool(hints_not_in_log(result)) for result in results), len(results)),
        Counter(result.diagnosis.verdict for result in clean),
        cells(results),
        estimate_errors(results),
        claims(results),
        methods(results),
        failed_rivals(results),
        found,
        float(np.median(ratios)) if ratios else nan,
        thresholds,
        # Of campaigns where there is nothing else.
        _median_and_most([result.diagnosis.seconds for result in results or every]),
        _median_and_most([one.seconds for one in oracles]),
        rival_scores(results, as_it_is),
        sea_scores([result for result in every if result.case.kind == SEA]),
    )


def detections(results: Sequence[CaseResult], thresholds: Mapping[str, float]) -> tuple[Detection, ...]:
    """Return the detection curves of all cells whose cases have a level.

    Parameters
    ----------
    results
        Of finished cases.
    thresholds
        Of the oracle, by effect, from `ferryid.validation.oracle_calibration.calibrated_thresholds`; its own floor where there
        is none.
    """
    by_cell: dict[str, list[CaseResult]] = {}
    for result in results:
        if result.case.level is not None and result.case.size > 0.0 and result.truths:
            by_cell.setdefault(result.case.cell, []).append(result)
    return tuple(_detection(cell, some, thresholds) for cell, some in by_cell.items())


def _detection(cell: str, results: Sequence[CaseResult], thresholds: Mapping[str, float]) -> Detection:
    sizes, blind, by_oracle, least, lost = [], [], [], list[float](), Counter[str]()
    for result in results:
        # Beside a gust there is its wind: the cell is called after what its size is of.
        own = next((one for one in result.truths if one.effect == cell), result.truths[0])
        sizes.append(result.case.size)
        blind.append(own.key in names(result))
        one = next((one for one in _estimates(result) if one.key == own.key), None)
        if one is not None:
            least.append(max(one.floor, thresholds.get(own.effect, 0.0)))
        by_oracle.append(None if one is None else bool(one.gain > least[-1]))
        if by_oracle[-1] and not blind[-1]:
            lost[TOO_SMALL if one and one.idle else outcome_of_missed(result, own.key)] += 1
    truths = results[0].truths
    effect = next((one.effect for one in truths if one.effect == cell), truths[0].effect)
    seen = [k for k, answer in enumerate(by_oracle) if answer is not None]
    seen_sizes, answers = [sizes[k] for k in seen], [bool(by_oracle[k]) for k in seen]
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


def _estimates(result: CaseResult) -> tuple[OracleEstimate, ...]:
    return () if result.oracle is None else result.oracle.recovered


def _median_and_most(seconds: Sequence[float]) -> tuple[float, float]:
    return (float(np.median(seconds)), max(seconds)) if seconds else (nan, nan)
