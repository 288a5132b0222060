"""The diagnosis beside rival methods on the same cases: what each names rightly and wrongly, how exactly, and in what time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.json_record import Record
from ferryid.validation.estimate_errors import Parameters, estimate_errors
from ferryid.validation.name_scores import Share, names, wrong_names
from ferryid.validation.records import DIAGNOSED, CaseResult, Diagnosis
from ferryid.validation.rivals.naming import NAMEABLE

Compare = Callable[[CaseResult], CaseResult]
"""Returns a case with what counts of its findings, and the parameters that are to be found."""


@dataclass(frozen=True)
class RivalScores(Record):
    """What one method does on the cases on which all were run.

    Attributes
    ----------
    name
        ``diagnosed``, or that of a rival.
    right
        Cases with an effect of which all that is concealed is named.
    able
        The same of cases all effects of which it has a regressor for.
    wrong
        Cases with a name that is neither there nor allowed.
    parameters, median_error
        How many parameters of what is named rightly it estimates, and their median relative error; None of none.
    seconds
        Of the median case.
    refused
        Cases that it could not use.
    """

    name: str
    right: Share
    able: Share
    wrong: Share
    parameters: int
    median_error: float | None
    seconds: float
    refused: int


def rival_scores(
    results: Sequence[CaseResult],
    compare: Callable[[Sequence[CaseResult]], Compare],
    effects: Mapping[str, Parameters] | None = None,
) -> tuple[RivalScores, ...]:
    """Return what the diagnosis and each rival do on the cases on which rivals were run; nothing where they never were.

    Parameters
    ----------
    results
        Of finished cases.
    compare
        Makes of all results of one method what compares a case of it, such as with the recording as it was.
    effects
        As of `ferryid.validation.estimate_errors.estimate_errors`.
    """
    tried = {one.case.name: found for one in results if (found := one.rivals) is not None}
    some = [one for one in results if one.case.name in tried]
    methods = dict.fromkeys(name for found in tried.values() for name in found.methods)
    if not methods:
        return ()
    by_name: dict[str, list[CaseResult]] = {DIAGNOSED: some}
    for name in methods:
        by_name[name] = [_of_method(one, tried[one.case.name].methods.get(name)) for one in some]
    return tuple(_scored(name, found, compare(found), effects) for name, found in by_name.items())


def as_it_is(results: Sequence[CaseResult]) -> Compare:
    """Return what leaves a case as it is."""
    return lambda result: result


def _of_method(result: CaseResult, made: Diagnosis | None) -> CaseResult:
    return replace(result, diagnosis=Diagnosis("refused", 0.0, error="it was not run") if made is None else made)


def _scored(
    name: str, results: Sequence[CaseResult], compare: Compare, effects: Mapping[str, Parameters] | None
) -> RivalScores:
    compared = [compare(one) for one in results]
    true = [one for one in compared if one.truths]
    right = [one for one in true if {truth.key for truth in one.truths} <= set(names(one))]
    known = NAMEABLE.get(name)
    able = [one for one in true if known is None or {truth.effect for truth in one.truths} <= set(known)]
    able_right = [one for one in right if one in able]
    errors = estimate_errors(right, effects)[0].errors
    return RivalScores(
        name,
        Share(len(right), len(true)),
        Share(len(able_right), len(able)),
        Share(sum(bool(wrong_names(one)) for one in compared), len(compared)),
        len(errors),
        float(np.median(errors)) if errors else None,
        float(np.median([one.diagnosis.seconds for one in results])),
        sum(one.diagnosis.verdict in ("refused", "crashed") for one in results),
    )
