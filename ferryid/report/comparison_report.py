"""From a comparison to files: a page, its figures, JSON and text; what ``ferryid compare`` leaves."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from ferryid.compare import Coefficient, CommonErrors, Comparison, ComparisonResult
from ferryid.report import comparison_words
from ferryid.report.comparison_figures import looks
from ferryid.report.comparison_page import MAX_LOGS, render
from ferryid.report.comparison_words import render_effects
from ferryid.report.fit_timeline import comparison_timeline
from ferryid.report.folder import made, place_of, write_folder
from ferryid.report.interactive import make_interactive
from ferryid.report.outcome import Report

NARROW = 3
"""Columns of coefficients up to which their intervals are beside them."""
NAMED = 2
"""Models and logs that the folder's name holds; a sum stands for the others."""


def report(comparison: Comparison, out: Path, command: Sequence[str] = (), logs: Sequence[str] = ()) -> Report:
    """Write page, figures and JSON to a folder in ``reports``; a later comparison of the same models and logs replaces it.

    `command` are the words that the comparison was asked for with, which the page repeats, and `logs` the paths of its logs.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written; nothing half-written is left.
    """
    result = comparison.result
    place = place_of(out / "reports", _folder(result), logs, command)
    file = place.page
    plain = {**result.to_json(), "headline": comparison_words.headline(result), "report": str(file)}
    look = looks(result.models)
    timelines = {k: comparison_timeline(log, result.models, look) for k, log in enumerate(comparison.logs[:MAX_LOGS])}
    interactive = make_interactive(timelines, place.folder, out)
    page, drawings = render(result, comparison.logs, made(command), interactive)
    write_folder(place, page, drawings, plain, "compare.json", scripts=interactive.files())
    return Report(plain, f"{as_text(result)}\n\nreport  {file}{place.note}", file)


def as_text(result: ComparisonResult) -> str:
    """Return a comparison for a terminal."""
    wide = max(map(len, result.labels)) + 2
    lines = [comparison_words.headline(result), ""]
    lines += [f"{model.label:<{wide}}{comparison_words.model_line(model)}" for model in result.models]
    lines += [f"warning: {warning}" for warning in result.warnings]
    for on, title, scope in comparison_words.scopes(result):
        lines += ["", f"{title}: {comparison_words.about(scope)}", *_score_table(result, scope, wide)]
        tracking = comparison_words.tracking_line(scope)
        lines += [f"  {tracking}"] if tracking else []
        lines += [
            *_outcome_table(result, on),
            *(f"  {sentence}" for sentence in comparison_words.sentences(result, on)),
        ]
        lines += [f"  warning: {warning}" for warning in comparison_words.warnings_of(scope)]
    if result.logs:
        lines += ["", comparison_words.about_errors(result)]
    lines += ["", *_coefficient_table(result)]
    effects = render_effects(result.effects)
    return "\n".join([*lines, *(["", *effects] if effects else [])])


def _coefficient_table(result: ComparisonResult) -> list[str]:
    """Return the coefficients of every model, with their intervals where there is room for them."""
    narrow, fitted = len(result.labels) <= NARROW, comparison_words.estimated(result)
    rows = comparison_words.physical_table(result)
    cells = {
        label: [_with_interval(values[label], narrow, label in fitted) for _, _, values in rows]
        for label in result.labels
    }
    columns = {label: max(12, 2 + max(map(len, (label, *column)))) for label, column in cells.items()}
    lines = [f"{'equations of motion':<18}" + "".join(f"{label:>{width}}" for label, width in columns.items())]
    for number, (name, unit, _) in enumerate(rows):
        line = "".join(f"{cells[label][number]:>{width}}" for label, width in columns.items())
        lines.append(f"  {name:<16}{line}  {unit}")
    held = f"; {comparison_words.HELD}: not estimated, as in the profile"
    shown = any(comparison_words.HELD in one for column in cells.values() for one in column)
    also = f"In parentheses: 95 % intervals{held if shown else ''}. T" if narrow else "Intervals, and t"
    return [*lines, f"{also}erms that are no hull's, such as wind and the constant: in the report."]


def _with_interval(one: Coefficient | None, shown: bool, of_fit: bool) -> str:
    value, interval = comparison_words.cell(one, of_fit=of_fit)
    return f"{value} ({interval})" if shown and interval else value


def _score_table(result: ComparisonResult, scope: CommonErrors, wide: int) -> list[str]:
    heads = comparison_words.score_columns(scope)
    lines = [f"  {'':<{wide}}" + "".join(f"{head:>{max(10, len(head) + 2)}}" for head in heads)]
    for label, cells in comparison_words.score_rows(result, scope):
        shown = "".join(f"{cell:>{max(10, len(head) + 2)}}" for head, cell in zip(heads, cells, strict=True))
        lines.append(f"  {label:<{wide}}{shown}")
    return lines


def _outcome_table(result: ComparisonResult, on: str | None) -> list[str]:
    """Return which of every two models is better in what."""
    heads, rows = comparison_words.outcomes(result, on)
    if not rows or not heads:
        return []
    wide = max(len(pair) for pair, _ in rows) + 2
    columns = [2 + max(len(head), *(len(cells[k]) for _, cells in rows)) for k, head in enumerate(heads)]
    table = [("", heads), *rows]
    lines = [
        f"  {pair:<{wide}}" + "".join(f"{cell:<{width}}" for cell, width in zip(cells, columns, strict=True))
        for pair, cells in table
    ]
    return ["", *(line.rstrip() for line in lines), ""]


def _folder(result: ComparisonResult) -> str:
    """Return a name that tells what was compared on what, and is another one for other models or logs."""
    models = [f"{model.name}-v{model.version}" for model in result.models if not model.is_base]
    logs = [log.name for log in result.logs]
    what = repr([list(result.labels), [log.sha256 for log in result.logs]])
    parts = ["compare", *_some(models), *(["on", *_some(logs)] if logs else [])]
    if len(models) > NAMED or len(logs) > NAMED:
        parts.append(hashlib.sha256(what.encode()).hexdigest()[:8])
    return re.sub(r"[^\w.+-]+", "_", "-".join(parts))


def _some(names: Sequence[str]) -> list[str]:
    short = [name[:60] for name in names[:NAMED]]
    return [*short, f"and-{len(names) - NAMED}-more"] if len(names) > NAMED else short
