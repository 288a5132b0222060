"""The page of a validation run: what was injected, what was found, and how near a diagnosis comes to the oracle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, isinf
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.report.validation_figures import Detected, confusion_matrix, detection_curves
from ferryid.types import AXES
from ferryid.validation.case_sampling import KINDS, SEA_LOGS, cells
from ferryid.validation.estimate_errors import EstimateErrors
from ferryid.validation.page_parts import (
    BEYOND,
    answers,
    error_figure,
    error_row,
    few,
    how_well_known,
    outside_row,
    percent,
    render,
)
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.scores import CLEAN, Detection, Scores
from ferryid.validation.sea_scores import WIND, SeaScores
from ferryid.validation.targets import MOST_RATIO, targets
from ferryid.validation.transfer_scores import Claim, Method

HEADINGS: Mapping[str, str] = {
    "clean": "Nothing injected",
    "single": "One effect, from invisible to gross",
    "span": "One effect in a part of the trial",
    "vessel": "Other vessels",
    "pair": "Two effects",
    "triple": "Three effects",
    "weather": "One effect under gusty wind and waves, none of them measured",
    "crossings": "Poor excitation: crossings only",
    "short": "Five minutes",
    "wrong base": "A base model with masses and damping at 40 %",
    "outside": "Out of the library",
}
"""Of the kinds of cells in the table of names; campaigns at sea have a section of their own."""


def figures(scores: Scores) -> dict[str, str]:
    """Return the page's figures by file name, as SVG text."""
    # In the order of the cells, whatever that of the cases.
    place = _places()
    ordered = sorted(zip(scores.confusion.rows, scores.confusion.counts, strict=True), key=lambda row: place[row[0]])
    rows, counts = [row for row, _ in ordered], [count for _, count in ordered]
    drawn = {"confusion.svg": confusion_matrix(rows, scores.confusion.columns, counts)} if rows else {}
    if scores.detections:
        drawn["detection.svg"] = detection_curves([_detected(one) for one in _ordered(scores.detections)])
    return drawn | error_figure(scores.recoveries)


def page(result: Mapping[str, Any], scores: Scores) -> str:
    """Return the page as Markdown; figures lie in the folder ``proof`` beside it.

    Parameters
    ----------
    result
        Seed, commitment, counts and settings of the run.
    scores
        Of its cases.
    """
    context = {
        "scores": scores,
        "vessels": [vessel.title for vessel in VESSELS.values()],
        "detections": [_detection(one) for one in _ordered(scores.detections)],
        "how_well_known": how_well_known([one.blind for one in scores.detections]),
        "kinds": [_kind(kind, scores) for kind in KINDS if any(one.kind == kind for one in scores.cells)],
        "claims": [_claim(one) for one in scores.claims],
        "axes": AXES,
        "methods": [_method(one) for one in scores.methods],
        "sea": None if scores.sea is None else _sea(scores.sea),
    }
    return render("validation.md", result, scores.seconds, targets(scores), scores.recoveries, context)


def _places() -> dict[str, int]:
    """Return the place of every cell in the order of the report."""
    return {cell.name: place for place, cell in enumerate(cells())}


def _ordered(detections: Sequence[Detection]) -> list[Detection]:
    place = _places()
    return sorted(detections, key=lambda one: place[one.cell])


def _detected(one: Detection) -> Detected:
    effect = plant_effects()[one.cell]
    least, most = effect.sizes
    return Detected(
        one.cell,
        effect.unit,
        (least / BEYOND, BEYOND * most),
        answers(one.sizes, one.blind_named, one.blind),
        None if one.oracle is None else answers(one.oracle_sizes, one.oracle_named, one.oracle),
    )


def _kind(kind: str, scores: Scores) -> dict[str, Any]:
    titles, place = {cell.name: cell.title for cell in cells()}, _places()
    some = sorted((one for one in scores.cells if one.kind == kind), key=lambda one: place[one.cell])
    verdicts = [f"{count} {name.replace('_', ' ')}" for name, count in scores.verdicts.items()] if kind == CLEAN else []
    rows = [(titles[one.cell], one.runs, few(one.first), few(one.every), few(one.false)) for one in some]
    return {"heading": HEADINGS[kind], "wrong": scores.false_names[kind], "verdicts": verdicts, "rows": rows}


def _detection(one: Detection) -> tuple[str, ...]:
    ratio = ""
    note = ", ".join(f"{count} {what}" for what, count in one.instead.items())
    if one.ratio is not None:
        value = "" if one.ratio.value is None else f"{one.ratio.value:.2g} "
        ratio = f"{value}[{_end(one.ratio.low)}, {_end(one.ratio.high)}]"
        if (one.ratio.value is not None and one.ratio.value > MOST_RATIO) or one.ratio.low > MOST_RATIO:
            note = f"**more than {MOST_RATIO}**: {note}"
    oracle = "" if one.oracle is None else one.oracle.text
    return one.cell, plant_effects()[one.cell].unit, one.blind.text, oracle, ratio, note


def _sea(scores: SeaScores) -> dict[str, Any]:
    every = sorted(scores.campaigns, key=lambda one: (one.effect != "", one.effect))
    units = {name: one.unit for name, one in plant_effects().items()}
    rows = [
        (
            one.effect or "nothing but the wind",
            f"{one.size:.3g} {units[one.effect]}" if one.effect else "",
            f"{one.seen:.1f}" if one.effect else "",
            ("yes" if one.named else f"no ({one.missed})" if one.missed else "no") if one.effect else "",
            f"{one.wind_seen:.1f}",
            {True: "yes", False: "no"}[one.wind_named],
            ", ".join(one.wrong),
        )
        for one in every
    ]
    first, *others = scores.recoveries
    return {
        "scores": scores,
        "rows": rows,
        "campaigns": counted(len(rows), "campaign"),
        "logs": SEA_LOGS,
        "every": first,
        "median_error": percent(first.median_error),
        "outside": [outside_row(one) for one in first.outside],
        "apart": _winds_apart(others),
        "errors": [error_row(one) for one in others],
    }


def _winds_apart(found: Sequence[EstimateErrors]) -> str:
    """Return the median error of the winds of the day and that of all else, as a phrase; winds are most of what is named."""
    winds, rest = (
        [error for one in found if (one.effect == WIND) is wind for error in one.errors] for wind in (True, False)
    )
    if not winds or not rest:
        return ""
    return ", ".join(
        f"{percent(float(np.median(errors)))} of {counted(len(errors), name)}"
        for errors, name in ((winds, "wind"), (rest, "other"))
    )


def _claim(one: Claim) -> tuple[Any, ...]:
    difference = f"{percent(one.apart)} [{percent(one.low)}, {percent(one.high)}]"
    return one.axis, one.logs, percent(one.claimed), percent(one.achieved), difference, one.kept.text


def _method(one: Method) -> tuple[Any, ...]:
    first, false = ("" if share is None else share.text for share in (one.first, one.false))
    return one.name, one.logs, *(_number(one.mse.get(axis)) for axis in AXES), _number(one.free_run), first, false


def _number(value: float | None) -> str:
    return "none" if value is None or not isfinite(value) else f"{value:.2f}"


def _end(value: float) -> str:
    return "∞" if isinf(value) else f"{value:.2g}"
