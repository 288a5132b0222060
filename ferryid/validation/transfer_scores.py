"""Scores on transfer logs: claimed against achieved improvement, and the diagnosis beside rival methods."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan, prod

import numpy as np
from scipy.stats import binom

from ferryid.json_record import Record
from ferryid.types import AXES
from ferryid.validation.name_scores import Share, names, wrong_names
from ferryid.validation.records import DIAGNOSED, UNKNOWN, CaseResult, TransferScore

KEPT = 0.8
"""Part of a claim that counts as keeping it."""
WORTH = 0.1
"""Share of the squared error as of which a claim on an axis is one."""


@dataclass(frozen=True)
class Claim(Record):
    """The share of the squared force error that findings claim to remove on an axis, and the one that they remove.

    Attributes
    ----------
    axis
        One of `AXES`.
    logs
        How many logs have a finding that claims something, and a transfer log.
    claimed, achieved
        Medians.
    apart, low, high
        Median of what is achieved less what is claimed, with its 95 % interval by order statistics.
    kept
        Of the claims of at least `WORTH`: those of which at least `KEPT` is achieved.
    """

    axis: str
    logs: int
    claimed: float
    achieved: float
    apart: float
    low: float
    high: float
    kept: Share


@dataclass(frozen=True)
class Method(Record):
    """What one method does on transfer logs.

    Attributes
    ----------
    name
        ``diagnosed``, or that of a rival.
    logs
        How many it was scored on.
    mse
        Median ratio of its squared force error to the base model's, by axis.
    free_run
        Median ratio of its position error in free runs to the base model's.
    first
        Logs with a truth in which its first name is one; None for a method without names.
    false
        Logs in which it names what is neither there nor allowed; None for a method without names.
    """

    name: str
    logs: int
    mse: Mapping[str, float]
    free_run: float
    first: Share | None
    false: Share | None


def claimed_improvement(result: CaseResult) -> dict[str, float]:
    """Return the share of the squared error that a diagnosis claims to remove, by axis; empty where it claims nothing.

    The diagnosis' own figure of all findings together where there is one. Else that of findings which each remove their share
    of what the others leave.
    """
    # Of several findings with one name each counts.
    found = [one.improvement for one in result.diagnosis.findings if not one.hint and one.effect != UNKNOWN]
    found = [one for one in found if one]
    if not found:
        return {}
    ratios = result.diagnosis.after.get("ratio")
    if ratios:
        return {axis: 1.0 - float(ratios[axis]["value"]) for axis in AXES}
    return {axis: 1.0 - prod(1.0 - float(one.get(axis, 0.0)) for one in found) for axis in AXES}


def claims(results: Iterable[CaseResult]) -> tuple[Claim, ...]:
    """Return claims and what became of them, by axis."""
    pairs: dict[str, list[tuple[float, float]]] = {axis: [] for axis in AXES}
    for result in results:
        claimed, score = claimed_improvement(result), _score(result, DIAGNOSED)
        if claimed and score is not None:
            for axis in AXES:
                pairs[axis].append((claimed[axis], 1.0 - _mse(score, axis)))
    return tuple(_claim(axis, some) for axis, some in pairs.items())


def methods(results: Sequence[CaseResult]) -> tuple[Method, ...]:
    """Return the diagnosis and every rival that was run on a transfer log, all on the logs on which rivals were run.

    Where a diagnosis has left the base model as it was, its errors are the base model's.
    """
    with_rivals = [result for result in results if _rivals(result)]
    results = with_rivals or results
    named = dict.fromkeys(name for result in results for name in _rivals(result))
    found = [_method(name, results) for name in (DIAGNOSED, *named)]
    return tuple(one for one in found if one.logs or (one.false is not None and one.false.of))


def failed_rivals(results: Sequence[CaseResult]) -> dict[str, str]:
    """Return why rivals never had a result that were run, by name."""
    every = [pair for result in results for pair in _rivals(result).items()]
    able = {name for name, one in every if one.complete}
    return {name: one.why for name, one in every if name not in able and one.why}


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % interval of a median by order statistics: infinite for fewer than six values."""
    ordered, n = sorted(values), len(values)
    k = int(binom.ppf(0.025, n, 0.5)) if n else 0
    return (ordered[k - 1], ordered[n - k]) if k > 0 else (-inf, inf)


def _claim(axis: str, pairs: Sequence[tuple[float, float]]) -> Claim:
    differences = [achieved - claimed for claimed, achieved in pairs]
    worth = [(claimed, achieved) for claimed, achieved in pairs if claimed >= WORTH]
    return Claim(
        axis,
        len(pairs),
        _median([claimed for claimed, _ in pairs]),
        _median([achieved for _, achieved in pairs]),
        _median(differences),
        *median_interval(differences),
        Share(sum(achieved >= KEPT * claimed for claimed, achieved in worth), len(worth)),
    )


def _method(name: str, results: Sequence[CaseResult]) -> Method:
    scores = [one for result in results if (one := _score(result, name)) is not None]
    runs = [ratio for result in results if isfinite(ratio := _free_run_ratio(result, name))]
    first, false = _diagnosed_names(results) if name == DIAGNOSED else _rival_names(name, results)
    mse = {axis: _median([_mse(one, axis) for one in scores]) for axis in AXES}
    return Method(name, len(scores), mse, _median(runs), first, false)


def _rivals(result: CaseResult) -> dict[str, TransferScore]:
    methods = {} if result.transfer is None else result.transfer.methods
    return {name: one for name, one in methods.items() if name != DIAGNOSED}


def _score(result: CaseResult, name: str) -> TransferScore | None:
    """Return what a method did on the transfer log of a case; None where it has no errors there."""
    found = None if result.transfer is None else result.transfer.methods.get(name)
    return found if found is not None and found.complete else None


def _mse(score: TransferScore, axis: str) -> float:
    value = score.mse[axis]
    return nan if value is None else value


def _free_run_ratio(result: CaseResult, name: str) -> float:
    """Return the position error of a method over the base model's, NaN where there is none."""
    score = _score(result, name)
    if score is None or result.transfer is None:
        return nan
    base = result.transfer.base.position_m if score.base_position_m is None else score.base_position_m
    return score.position_m / base if score.position_m is not None and base else nan


def _diagnosed_names(results: Sequence[CaseResult]) -> tuple[Share, Share]:
    true = [result for result in results if result.truths]
    first = sum(bool(names(one)) and names(one)[0] in {truth.key for truth in one.truths} for one in true)
    return Share(first, len(true)), Share(sum(bool(wrong_names(one)) for one in results), len(results))


def _rival_names(name: str, results: Sequence[CaseResult]) -> tuple[Share | None, Share | None]:
    """Return right first names and wrong names of a rival, which names effects and no thrusters."""
    scored = [
        (result, [one.effect for one in score.names])
        for result in results
        if (score := _rivals(result).get(name)) is not None and score.names is not None
    ]
    if not scored:
        return None, None
    first = false = true = 0
    for result, found in scored:
        present = {truth.effect for truth in result.truths}
        true += bool(present)
        first += bool(found) and found[0] in present
        false += any(one not in present and one not in result.case.allowed for one in found)
    return Share(first, true), Share(false, len(scored))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else nan
