"""Scores of the names in a diagnosis: right, wrong, and mistaken for each other."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from scipy.stats import beta

from ferryid.effects import effects
from ferryid.effects.wording import IS_A_HINT, MEANS_LITTLE, listed, titled
from ferryid.json_record import Record
from ferryid.validation.records import UNKNOWN, CaseResult, Finding, Key

NONE, OTHER, REFUSED = "none", "wrong place", "refused"
"""Columns of the confusion matrix that are no effect: nothing named, something found without a name, the right effect of the
wrong thruster or other coefficients of the hull, and an error message in the place of a diagnosis."""
ELSEWHERE = "other coefficients"
"""Instance of a hull that is named wrong in coefficients which are right."""
LEVEL = 0.95
HULL = "hull_parameters"
NOT_CONFIRMED, NO_HULL_MODEL = "not confirmed: ", "The profile has no hull model"
"""How a finding of a campaign says why it is a hint, and how the note begins that makes findings of a single log hints."""
DROPPED = " considered, but dropped: "
"""What stands in a note between an effect and why it is none."""
SIZES = "Estimated, not confirmed: "
"""What stands there between the reason and the sizes."""
NOT_TESTED, SINCE = "Not tested: ", ", since "
"""How a note begins on effects that were not tested, and what stands before the reason."""
SMALLEST, TO_SHOW = "Would have been seen with an even chance, from: ", "To make sure: "
"""What stands before the least sizes that a comparison of groups shows, and before what would show an effect."""


@dataclass(frozen=True)
class Share(Record):
    """So many of so many."""

    DERIVED: ClassVar[Mapping[str, str]] = {"value": "value", "interval": "interval"}

    count: int
    of: int

    @property
    def value(self) -> float:
        """Return the share, NaN of none."""
        return self.count / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of Clopper and Pearson (1934)."""
        k, n, tail = self.count, self.of, 0.5 * (1.0 - LEVEL)
        low = 0.0 if k == 0 else float(beta.ppf(tail, k, n - k + 1))
        high = 1.0 if k == n else float(beta.ppf(1.0 - tail, k + 1, n - k))
        return low, high

    @property
    def text(self) -> str:
        """The share in per cent, its counts and its interval."""
        if not self.of:
            return "none"
        low, high = self.interval
        return f"{100.0 * self.value:.1f} % ({self.count}/{self.of}) [{100.0 * low:.1f}, {100.0 * high:.1f}]"


@dataclass(frozen=True)
class Confusion(Record):
    """What was named first in every kind of trial with at most one effect.

    Attributes
    ----------
    rows, columns
        Cells, and first names; the last columns are `OTHER`, `UNKNOWN`, `NONE` and `REFUSED`.
    counts
        Runs, by row and column.
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Cell(Record):
    """How often the injected effects of some runs were named.

    Attributes
    ----------
    cell, kind
        As in the cases.
    runs
        How many.
    first, every
        Of the runs with a truth: those whose first name is one, and those in which all are named.
    false
        Runs with a wrong name.
    refused
        Runs that ended in an error message.
    """

    cell: str
    kind: str
    runs: int
    first: Share
    every: Share
    false: Share
    refused: int


def names(result: CaseResult) -> list[Key]:
    """Return what a diagnosis names, the likeliest first."""
    return list(named_findings(result))


def named_findings(result: CaseResult) -> dict[Key, Finding]:
    """Return the findings that name something, the likeliest first; of several with one name, the first.

    A hull is the one that is in the log only if a wrong coefficient is named: its instance is `ELSEWHERE` otherwise.
    """
    injected = {name for truth in result.truths if truth.effect == HULL for name in truth.values}
    found: dict[Key, Finding] = {}
    for one in result.diagnosis.findings:
        if one.hint or one.effect == UNKNOWN:
            continue
        missed = one.effect == HULL and injected and not injected & set(one.parameters)
        found.setdefault((HULL, ELSEWHERE) if missed else one.key, one)
    return found


def wrong_names(result: CaseResult) -> list[Key]:
    """Return what a diagnosis names that is not in the log.

    What the case allows is not wrong, nor is one of several explanations among which the diagnosis does not decide, the truth
    among them.
    """
    effects = {truth.effect for truth in result.truths}
    return [
        key
        for key in names_not_in_log(result)
        if key[0] not in result.case.allowed and not effects & set(named_findings(result)[key].unresolved_with)
    ]


def names_not_in_log(result: CaseResult) -> list[Key]:
    """Return what a diagnosis names that is not in the log, whatever the case allows."""
    present = {truth.key for truth in result.truths}
    return [key for key in names(result) if key not in present]


def hints_not_in_log(result: CaseResult) -> list[Key]:
    """Return the hints of what is not in the log."""
    present = {truth.key for truth in result.truths}
    hints = [one for one in result.diagnosis.findings if one.hint]
    return [one.key for one in hints if one.effect != UNKNOWN and one.key not in present]


def label(key: Key) -> str:
    """Return an effect with its thruster in one word or two."""
    return key[0] if key[1] is None else f"{key[0]} ({key[1]})"


def outcome_of_missed(result: CaseResult, key: Key) -> str:
    """Return what became of an effect that is in the log of a case and was not named."""
    diagnosis = result.diagnosis
    if diagnosis.error:
        return REFUSED
    if any(one.key == key and one.hint for one in diagnosis.findings):
        return "a hint"
    if any("but dropped" in note and _title(key).lower() in note.lower() for note in diagnosis.notes):
        return "dropped"
    other = first_name(result)
    return other if other in (UNKNOWN, NONE, OTHER) else f"taken for {other}"


def why_missed(result: CaseResult, key: Key) -> str:
    """Return why an effect that is in the log of a case was not named, in the diagnosis's words; empty where it has none."""
    title = _title(key)
    hints = [one for one in result.diagnosis.findings if one.key == key and one.hint]
    reasons = [one.says.partition(NOT_CONFIRMED)[2].strip(" .:") for one in hints]
    for note in result.diagnosis.notes:
        what, found, why = note.partition(IS_A_HINT)
        if found and what.lower() == title.lower():
            reasons.append(why.removesuffix("."))
        what, found, why = note.partition(DROPPED)
        if found and title.lower() in what.lower():
            reasons.append(why.partition(SIZES)[0].strip(" ."))
    # This makes hints of findings; why there is none at all, or something without a name, it does not say.
    if hints and not any(reasons) and any(note.startswith(NO_HULL_MODEL) for note in result.diagnosis.notes):
        reasons.append("the hull was fitted to the same log, as the profile has none")
    return "; ".join(dict.fromkeys(filter(None, reasons))) or _why_not_found(result, key)


def _title(key: Key) -> str:
    effect = effects().get(key[0])
    return key[0] if effect is None else titled(effect.title, key[1])


def _why_not_found(result: CaseResult, key: Key) -> str:
    """Return why a diagnosis does not mention an effect by itself: what it says of others, and of what its logs can show."""
    undecided = [_title(one.key).lower() for one in result.diagnosis.findings if key[0] in one.unresolved_with]
    if undecided:
        return f"not distinguished from {listed(list(dict.fromkeys(undecided)))}"
    name, instance = _title((key[0], None)).lower(), key[1]
    for note in result.diagnosis.notes:
        if note.startswith(NOT_TESTED):
            what, _, why = note.removeprefix(NOT_TESTED).partition(SINCE)
            if name in what.lower():
                return f"not tested, since {why.removesuffix('.')}"
        if MEANS_LITTLE in note:
            return "the vessel hardly follows the applied force in this log"
        if note.startswith(SMALLEST):
            parts = (one.partition(", ") for one in note.removeprefix(SMALLEST).removesuffix(".").split("; "))
            least = [size for what, _, size in parts if what.lower() == _title(key).lower()]
            if least:
                return f"the logs show it with an even chance from {listed(least)} on"
        _, found, rest = note.partition(TO_SHOW)
        for part in rest.split("; ") if found else ():
            what = part.partition(", record ")[0].lower()
            mine = what.partition(name)[2].partition(")")[0]
            if name in what and (instance is None or instance.lower() in re.split(r"[(,\s]+", mine)):
                return "an effect of its usual size would not have shown in this log"
    return ""


def first_name(result: CaseResult) -> str:
    """Return what a diagnosis names first as a column of the confusion matrix."""
    if result.diagnosis.error:
        return REFUSED
    found = names(result)
    if not found:
        return UNKNOWN if any(one.effect == UNKNOWN for one in result.diagnosis.findings) else NONE
    present = {truth.key for truth in result.truths}
    effect = found[0][0]
    return OTHER if found[0] not in present and effect in {name for name, _ in present} else effect


def confusion(results: Iterable[CaseResult]) -> Confusion:
    """Return what was named first, by cell."""
    counts: dict[str, dict[str, int]] = {}
    for result in results:
        if len(result.truths) <= 1:
            row = counts.setdefault(result.case.cell, {})
            column = first_name(result)
            row[column] = row.get(column, 0) + 1
    last = (OTHER, UNKNOWN, NONE, REFUSED)
    columns = (*sorted({name for row in counts.values() for name in row} - set(last)), *last)
    return Confusion(
        tuple(counts), columns, tuple(tuple(row.get(name, 0) for name in columns) for row in counts.values())
    )


def false_names(results: Sequence[CaseResult]) -> dict[str, Share]:
    """Return the share of runs with a wrong name: of ``all`` and of every kind of cell."""
    kinds = {"all": list(results)}
    for result in results:
        kinds.setdefault(result.case.kind, []).append(result)
    return {kind: Share(sum(bool(wrong_names(result)) for result in some), len(some)) for kind, some in kinds.items()}


def cells(results: Iterable[CaseResult]) -> tuple[Cell, ...]:
    """Return every cell, in the order of their first runs."""
    sorted_by: dict[tuple[str, str], list[CaseResult]] = {}
    for result in results:
        sorted_by.setdefault((result.case.cell, result.case.kind), []).append(result)
    return tuple(_cell(cell, kind, some) for (cell, kind), some in sorted_by.items())


def _cell(cell: str, kind: str, results: Sequence[CaseResult]) -> Cell:
    first = every = true = 0
    for result in results:
        present, found = {truth.key for truth in result.truths}, names(result)
        true += bool(present)
        first += bool(found) and found[0] in present
        every += bool(present) and present <= set(found)
    return Cell(
        cell,
        kind,
        len(results),
        Share(first, true),
        Share(every, true),
        Share(sum(bool(wrong_names(result)) for result in results), len(results)),
        sum(bool(result.diagnosis.error) for result in results),
    )
