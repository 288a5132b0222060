"""What a diagnosis names: what is right, what is wrong, and what is mistaken for what."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import beta

from ferryid.diagnose import HINT
from ferryid.effects import effects
from ferryid.effects.wording import titled

Line = Mapping[str, Any]
"""A finished case: ``case``, as `ferryid.prove.case.Case.as_json` gives it, and what was ``told`` of its log, as plain data."""
Key = tuple[str, str | None]
"""Effect and instance."""
NONE, UNKNOWN, OTHER, REFUSED = "none", "unknown", "wrong place", "refused"
"""Columns of the confusion matrix that are no effect: nothing named, something found without a name, the right effect of the
wrong thruster or other coefficients of the hull, and an error message in the place of a diagnosis."""
ELSEWHERE = "other coefficients"
"""Instance of a hull that is told wrong in coefficients which are right."""
LEVEL = 0.95
HULL = "hull_parameters"


@dataclass(frozen=True)
class Share:
    """So many of so many."""

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


@dataclass(frozen=True)
class Confusion:
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
class Cell:
    """How often what was concealed in some runs was named.

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


def truths(line: Line) -> list[Mapping[str, Any]]:
    """Return what is in the log of a case."""
    return list(line["case"]["truths"])


def key_of(one: Mapping[str, Any]) -> Key:
    """Return effect and instance of a truth or a finding."""
    return one["effect"], one["instance"]


def named(line: Line) -> list[Mapping[str, Any]]:
    """Return the findings that name something, the first first: likelier than not, and not without a name."""
    return [one for one in line["told"].get("findings", ()) if one["probability"] > HINT and one["effect"] != UNKNOWN]


def names(line: Line) -> list[Key]:
    """Return what a run names, the first first."""
    return list(told(line))


def told(line: Line) -> dict[Key, Mapping[str, Any]]:
    """Return the findings that name something, the first first; of several with one name, the first.

    A hull is the one that is in the log only if a coefficient is told that is wrong: its instance is `ELSEWHERE` otherwise.
    """
    concealed = {name for truth in truths(line) if truth["effect"] == HULL for name in truth["values"]}
    found: dict[Key, Mapping[str, Any]] = {}
    for one in named(line):
        missed = one["effect"] == HULL and concealed and not concealed & set(one["parameters"])
        found.setdefault((HULL, ELSEWHERE) if missed else key_of(one), one)
    return found


def wrong(line: Line) -> list[Key]:
    """Return what a run names that is not in the log.

    What the case allows is not wrong, nor is one of several explanations that the diagnosis says it cannot tell apart, the
    truth among them.
    """
    there = {key_of(truth) for truth in truths(line)}
    effects = {effect for effect, _ in there}
    return [
        key
        for key, one in told(line).items()
        if key not in there
        and one["effect"] not in line["case"]["allowed"]
        and not effects & set(one.get("unresolved_with", ()))
    ]


def strictly_wrong(line: Line) -> list[Key]:
    """Return what a run names that is not in the log, whatever the case allows."""
    there = {key_of(truth) for truth in truths(line)}
    return [key for key in told(line) if key not in there]


def hints_of_nothing(line: Line) -> list[Key]:
    """Return what a run takes for possible, at a probability of 0.5 or less, and is not in the log."""
    there = {key_of(truth) for truth in truths(line)}
    doubtful = [one for one in line["told"].get("findings", ()) if one["probability"] <= HINT]
    return [key_of(one) for one in doubtful if one["effect"] != UNKNOWN and key_of(one) not in there]


def instead(line: Line, key: Key) -> str:
    """Return what became of an effect that is in the log of a case and was not named."""
    said = line["told"]
    if said.get("error"):
        return REFUSED
    if any(key_of(one) == key and one["probability"] <= HINT for one in said.get("findings", ())):
        return "a hint"
    effect = effects().get(key[0])
    title = key[0] if effect is None else titled(effect.title, key[1])
    if any("suspected, but dropped" in note and title.lower() in note.lower() for note in said.get("notes", ())):
        return "dropped"
    other = first_name(line)
    return other if other in (UNKNOWN, NONE, OTHER) else f"taken for {other}"


def first_name(line: Line) -> str:
    """Return what a run names first as a column of the confusion matrix."""
    if line["told"].get("error"):
        return REFUSED
    found = names(line)
    if not found:
        return UNKNOWN if any(one["effect"] == UNKNOWN for one in line["told"].get("findings", ())) else NONE
    there = {key_of(truth) for truth in truths(line)}
    effect = found[0][0]
    return OTHER if found[0] not in there and effect in {name for name, _ in there} else effect


def confusion(lines: Iterable[Line]) -> Confusion:
    """Return what was named first, by cell."""
    counts: dict[str, dict[str, int]] = {}
    for line in lines:
        if len(truths(line)) <= 1:
            row = counts.setdefault(line["case"]["cell"], {})
            column = first_name(line)
            row[column] = row.get(column, 0) + 1
    last = (OTHER, UNKNOWN, NONE, REFUSED)
    columns = (*sorted({name for row in counts.values() for name in row} - set(last)), *last)
    return Confusion(
        tuple(counts), columns, tuple(tuple(row.get(name, 0) for name in columns) for row in counts.values())
    )


def false_names(lines: Sequence[Line]) -> dict[str, Share]:
    """Return the share of runs with a wrong name: of ``all`` and of every kind of cell."""
    kinds = {"all": list(lines)}
    for line in lines:
        kinds.setdefault(line["case"]["kind"], []).append(line)
    return {kind: Share(sum(bool(wrong(line)) for line in some), len(some)) for kind, some in kinds.items()}


def cells(lines: Iterable[Line]) -> tuple[Cell, ...]:
    """Return every cell, in the order of their first runs."""
    sorted_by: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        sorted_by.setdefault((line["case"]["cell"], line["case"]["kind"]), []).append(line)
    return tuple(_cell(cell, kind, some) for (cell, kind), some in sorted_by.items())


def _cell(cell: str, kind: str, lines: Sequence[Line]) -> Cell:
    first = every = true = 0
    for line in lines:
        there, found = {key_of(truth) for truth in truths(line)}, names(line)
        true += bool(there)
        first += bool(found) and found[0] in there
        every += bool(there) and there <= set(found)
    return Cell(
        cell,
        kind,
        len(lines),
        Share(first, true),
        Share(every, true),
        Share(sum(bool(wrong(line)) for line in lines), len(lines)),
        sum(bool(line["told"].get("error")) for line in lines),
    )
