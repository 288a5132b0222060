"""The page of a validation run: what was injected, what was found, and how near a diagnosis comes to the oracle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, isinf
from typing import Any

import numpy as np

from ferryid.report.html import template
from ferryid.report.validation_figures import Answers, Detected, confusion_matrix, detection_curves, parameter_errors
from ferryid.types import AXES
from ferryid.validation.case_sampling import KINDS, cells
from ferryid.validation.detection_curves import Curve
from ferryid.validation.estimate_errors import WITHIN, EstimateErrors
from ferryid.validation.name_scores import Share
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.scores import CLEAN, Detection, Scores
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
BEYOND = 1.3
"""How far the axis of a detection curve goes beyond the sizes tried, as a factor."""


def figures(scores: Scores) -> dict[str, str]:
    """Return the page's figures by file name, as SVG text."""
    # In the order of the cells, whatever that of the cases.
    place = _places()
    ordered = sorted(zip(scores.confusion.rows, scores.confusion.counts, strict=True), key=lambda row: place[row[0]])
    rows, counts = [row for row, _ in ordered], [count for _, count in ordered]
    drawn = {"confusion.svg": confusion_matrix(rows, scores.confusion.columns, counts)}
    if scores.detections:
        drawn["detection.svg"] = detection_curves([_detected(one) for one in _ordered(scores.detections)])
    found = {one.effect: one.errors for one in scores.recoveries[1:] if one.errors}
    if found:
        drawn["errors.svg"] = parameter_errors(found, WITHIN)
    return drawn


def page(result: Mapping[str, Any], scores: Scores) -> str:
    """Return the page as Markdown; figures lie in the folder ``proof`` beside it.

    Parameters
    ----------
    result
        Seed, commitment, counts and settings of the run.
    scores
        Of its cases.
    """
    every = scores.recoveries[0]
    usual_s, slowest_s = scores.seconds
    context = {
        "result": result,
        "scores": scores,
        "command": _command(result),
        "lost": [f"{result['counts'][name]} {name}" for name in ("refused", "crashed") if result["counts"][name]],
        "seconds": (f"{usual_s:.0f}", f"{slowest_s:.0f}"),
        "vessels": [vessel.title for vessel in VESSELS.values()],
        "targets": targets(scores),
        "detections": [_detection(one) for one in _ordered(scores.detections)],
        "kinds": [_kind(kind, scores) for kind in KINDS if any(one.kind == kind for one in scores.cells)],
        "every": every,
        "median_error": _percent(every.median_error),
        "errors": [_errors(one) for one in scores.recoveries[1:]],
        "has_errors": any(one.errors for one in scores.recoveries[1:]),
        "claims": [_claim(one) for one in scores.claims],
        "axes": AXES,
        "methods": [_method(one) for one in scores.methods],
    }
    return template("validation.md").render(context)


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
        _answers(one.sizes, one.blind_named, one.blind),
        None if one.oracle is None else _answers(one.oracle_sizes, one.oracle_named, one.oracle),
    )


def _answers(sizes: Sequence[float], named: Sequence[bool], fitted: Curve) -> Answers:
    x = np.geomspace(fitted.least, fitted.most, 120)
    return Answers(np.asarray(sizes), np.asarray(named, dtype=bool), x, fitted.share(x))


def _kind(kind: str, scores: Scores) -> dict[str, Any]:
    titles, place = {cell.name: cell.title for cell in cells()}, _places()
    some = sorted((one for one in scores.cells if one.kind == kind), key=lambda one: place[one.cell])
    verdicts = [f"{count} {name.replace('_', ' ')}" for name, count in scores.verdicts.items()] if kind == CLEAN else []
    rows = [(titles[one.cell], one.runs, _few(one.first), _few(one.every), _few(one.false)) for one in some]
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


def _errors(one: EstimateErrors) -> tuple[Any, ...]:
    return one.effect, one.found, _percent(one.median_error), _few(one.within), _few(one.covered), _few(one.in_time)


def _claim(one: Claim) -> tuple[Any, ...]:
    difference = f"{_percent(one.apart)} [{_percent(one.low)}, {_percent(one.high)}]"
    return one.axis, one.logs, _percent(one.claimed), _percent(one.achieved), difference, one.kept.text


def _method(one: Method) -> tuple[Any, ...]:
    first, false = ("" if share is None else share.text for share in (one.first, one.false))
    return one.name, one.logs, *(_number(one.mse.get(axis)) for axis in AXES), _number(one.free_run), first, false


def _command(result: Mapping[str, Any]) -> str:
    only = result["settings"]["only"]
    return f"ferryid prove --seed {result['seed']}" + (f" --only {','.join(only)}" if only else "")


def _few(share: Share) -> str:
    return f"{share.count}/{share.of}" if share.of else ""


def _percent(value: float) -> str:
    return f"{100.0 * value:.1f} %" if isfinite(value) else "none"


def _number(value: float | None) -> str:
    return "none" if value is None or not isfinite(value) else f"{value:.2f}"


def _end(value: float) -> str:
    return "∞" if isinf(value) else f"{value:.2g}"
