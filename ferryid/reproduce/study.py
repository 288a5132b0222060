"""What a study hands on to the page: a question, numbers theirs beside ours, sentences that follow from them, drawings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ferryid.report.drawing import Drawing


@dataclass(frozen=True)
class Row:
    """One quantity: what the thesis says, and ours, one value a seed.

    Attributes
    ----------
    quantity
        What was measured, as a phrase.
    unit
        Unit of both; ``"%"`` for changes.
    theirs
        A number, a phrase, or None where the thesis gives none.
    ours
        One value a seed.
    """

    quantity: str
    unit: str
    theirs: float | str | None
    ours: tuple[float, ...]

    @property
    def median(self) -> float:
        """Median over the seeds; NaN without any."""
        return median(self.ours)


@dataclass(frozen=True)
class Table:
    """A table of ours alone, where the thesis has nothing to set beside it."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Study:
    """One study, carried out.

    Attributes
    ----------
    name
        Short name, for files and ``--only``.
    title, question
        Headline, and what was to be found out.
    method
        Sentences on what was flown and how it was judged.
    rows
        Theirs beside ours.
    tables
        Further tables.
    findings
        Sentences computed from the numbers.
    drawings
        Figures.
    data
        Further numbers, for the JSON result alone.
    """

    name: str
    title: str
    question: str
    method: tuple[str, ...]
    rows: tuple[Row, ...] = ()
    tables: tuple[Table, ...] = ()
    findings: tuple[str, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)


def plain(study: Study) -> dict[str, Any]:
    """Return a study as the object in the JSON result; figures by the name of their file."""
    return {
        "name": study.name,
        "title": study.title,
        "question": study.question,
        "method": list(study.method),
        "rows": [
            {
                "quantity": row.quantity,
                "unit": row.unit,
                "theirs": row.theirs,
                "ours": {"median": row.median, "low": low(row.ours), "high": high(row.ours), "values": list(row.ours)},
            }
            for row in study.rows
        ],
        "tables": [
            {"caption": table.caption, "header": list(table.header), "rows": [list(row) for row in table.rows]}
            for table in study.tables
        ],
        "findings": list(study.findings),
        "figures": [{"file": f"{drawing.name}.svg", "caption": drawing.caption} for drawing in study.drawings],
        "data": dict(study.data),
    }


def median(values: Sequence[float]) -> float:
    """Return the median; NaN of nothing."""
    return float(np.median(values)) if len(values) else float("nan")


def low(values: Sequence[float]) -> float:
    """Return the least value; NaN of nothing."""
    return float(np.min(values)) if len(values) else float("nan")


def high(values: Sequence[float]) -> float:
    """Return the greatest value; NaN of nothing."""
    return float(np.max(values)) if len(values) else float("nan")


def change(new: float, old: float) -> float:
    """Return by how many per cent `new` differs from `old`."""
    return 100.0 * (new / old - 1.0)


def changes(new: Sequence[float], old: Sequence[float]) -> tuple[float, ...]:
    """Return by how many per cent each of `new` differs from its partner in `old`."""
    return tuple(change(float(a), float(b)) for a, b in zip(new, old, strict=True))


def spread(values: Sequence[float], unit: str = "", *, signed: bool = False) -> str:
    """Return ``median (least to greatest)`` of several runs as text."""
    form = "+" if signed else ""
    middle, least, most = (
        percent(value, form) if unit == "%" else number(value, form)
        for value in (median(values), low(values), high(values))
    )
    unit = f" {unit}" if unit else ""
    return f"{middle}{unit} ({least} to {most})" if len(values) > 1 else f"{middle}{unit}"


def number(value: float, form: str = "") -> str:
    """Return a number with three digits that count, whole from 100 on."""
    if not np.isfinite(value):
        return "–"
    size = abs(value)
    digits = 0 if size >= 99.95 or value == int(value) else 1 if size >= 9.995 else 2 if size >= 0.9995 else 3
    text = f"{value:{form}.{digits}f}"
    return text.replace("-", "−")


def percent(value: float, form: str = "+") -> str:
    """Return a percentage with one decimal, whole from 100 on; its sign always, unless `form` is empty."""
    if not np.isfinite(value):
        return "–"
    rounded = round(value, 1) + 0.0  # no minus before a zero
    digits = 0 if abs(rounded) >= 100.0 or rounded == int(rounded) != 0 else 1
    return f"{rounded:{form if rounded else ''}.{digits}f}".replace("-", "−")
