"""A comparison of models as one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ferryid.compare import Coefficient, CommonErrors, ComparedLog, ComparisonResult
from ferryid.report import comparison_figures, comparison_words
from ferryid.report.comparison_words import render_effects
from ferryid.report.html import template
from ferryid.report.interactive import STATIC, Interactive
from ferryid.report.structure import worst_minute

MAX_LOGS = 6
"""Logs that are drawn; the page stays readable."""


def render(
    result: ComparisonResult,
    logs: Sequence[ComparedLog],
    made: Mapping[str, str],
    interactive: Interactive = STATIC,
) -> tuple[str, dict[str, str]]:
    """Return the page and its drawings (SVG) by name; `made` are date, version and command."""
    known = comparison_words.scopes(result)
    labels = result.labels
    reference = labels[0]
    # What counts most comes first: all logs together.
    ordered = [*known[len(logs) :], *known[: len(logs)]]
    drawn = [log.name for log in logs[:MAX_LOGS]]
    left = [log.name for log in logs[MAX_LOGS:]]
    shown = [(title, scope) for on, title, scope in ordered if on is None or on in drawn]
    overall = _overall(result, shown, reference) if shown else []
    sections: list[dict[str, Any]] = []
    for on, title, scope in ordered:
        place = next((k for k, one in enumerate(logs[:MAX_LOGS]) if one.name == on), None)
        heads, outcome_rows = comparison_words.outcomes(result, on)
        sections.append(
            {
                "outcome_heads": heads,
                "outcomes": outcome_rows,
                "title": title,
                "about": comparison_words.about(scope),
                "heads": comparison_words.score_columns(scope),
                "rows": comparison_words.score_rows(result, scope),
                "sentences": comparison_words.sentences(result, on),
                "tracking": comparison_words.tracking_line(scope),
                "warnings": comparison_words.warnings_of(scope),
                "timeline": 0 if place is None else interactive.number(place),
                "figures": _figures(result, logs[place]) if place is not None else [],
            }
        )
    fitted = comparison_words.estimated(result)
    page = template("compare.html").render(
        title=" · ".join([result.vessel, *(model.label for model in result.models if not model.is_base)]),
        headline=comparison_words.headline(result),
        made=made,
        assets=interactive.assets,
        warnings=result.warnings,
        models=[(model.label, comparison_words.model_line(model)) for model in result.models],
        overall=overall,
        sections=sections,
        about_p=comparison_words.about_errors(result) if known else "",
        omitted=f"Not drawn, but part of every number: {', '.join(left)}." if left else "",
        labels=labels,
        coefficients=[_row(*row, labels, fitted) for row in comparison_words.coefficient_table(result)],
        terms=[_row(*row, labels, fitted) for row in comparison_words.term_table(result)],
        effects=[line.strip() for line in render_effects(result.effects)],
    )
    figures = [*overall, *(figure for section in sections for figure in section["figures"])]
    return page, {figure["file"]: figure["svg"] for figure in figures}


def _overall(
    result: ComparisonResult, shown: Sequence[tuple[str, CommonErrors]], reference: str
) -> list[dict[str, str]]:
    title, scope = shown[0]
    figures = [
        {
            "file": "mse-ratios",
            "svg": comparison_figures.mse_ratios(result, shown, reference),
            "caption": f"Mean squared prediction error in windows of {result.prediction_window_s:.3g} s over that of "
            f"{reference}, with 95 % intervals from blocks of each log, in pairs; left of the line is better. Hollow marks "
            "have too few blocks for an interval.",
        }
    ]
    if any(scope.free_run.counted):
        figures.append(
            {
                "file": "free-runs",
                "svg": comparison_figures.free_runs(result, scope, reference),
                "caption": f"Free runs on {title}: root-mean-square error against horizon, all from the same starts, each "
                f"with the measured state once and then only the measured forces. Below: over that of {reference}, with 95 % "
                "intervals where there are enough runs that do not overlap.",
            }
        )
    return figures


def _figures(result: ComparisonResult, log: ComparedLog) -> list[dict[str, Any]]:
    start = worst_minute(log.motion, log.taus, log.rows, comparison_figures.MINUTE_S)
    which = "This log" if start is None else f"The minute in which the models err most, from {start:.0f} s"
    found: list[dict[str, Any]] = [
        {
            "file": f"forces-{log.name}" + ("" if start is None else "-worst-minute"),
            "svg": comparison_figures.forces(result, log, start),
            "caption": f"{which}: force measured at the actuators, and what each model makes of the same motion; below each "
            "the residual, measured less estimated.",
            "over_time": True,
        }
    ]
    runs = comparison_figures.runs_to_draw(log)
    if runs:
        found.append(
            {
                "file": f"free-run-tracks-{log.name}",
                "svg": comparison_figures.free_run_tracks(result, log, runs),
                "caption": "Free runs from the measured state at the dot on: where the vessel went and where each model takes "
                "it. Of all runs those with the least, the median and the greatest error of position at the end.",
            }
        )
    return found


def _row(
    name: str, unit: str, values: Mapping[str, Coefficient], labels: Sequence[str], fitted: Collection[str]
) -> dict[str, Any]:
    cells = [comparison_words.cell(values.get(label), of_fit=label in fitted) for label in labels]
    return {"name": name, "unit": unit, "cells": cells}
