"""An evaluation as text for a terminal."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.report.scale import scale_words
from ferryid.types import AXES

_ROWS = ("row by row, MSE / base", "  rms error, {} [N, N, N·m]", "  R² against applied force")
_WINDOWS = ("squared prediction error / base", "  rms, {} [N, N, N·m]", "  R² against applied force")
HULL = "the profile's hull"
NOT_ACCEPTED = (
    "marked as rejected: the diagnosis stored it without accepting it, so that it did not become the current one"
)
"""What a model is that a diagnosis led to and did not accept, alike where it is stored and where it is judged."""
_BESIDE_HULL = "  squared error / profile's hull"


def render_evaluation(result: dict[str, Any]) -> str:
    """Return an evaluation as text."""
    head = result["model"]
    lines = [f"{head['name']}@{head['version']}, test data smoothed with {result['window_s']:g} s"]
    lines += [] if head.get("accepted", True) else [f"warning: {_rejected(diagnosed='base' in head)}"]
    lines += [f"base: {head['base']}"] if "base" in head else []
    scale = scale_words(head.get("scale", {}))
    if scale and "base" not in head:
        lines.append(f"base: the base model as fitted ({scale}), not the profile's hull")
    lines.append("")
    lines.append(f"{'':<34}" + "".join(f"{axis:>11}" for axis in AXES) + f"{'mean':>9}")
    entries = [*result["logs"], {"name": "all logs", **result["pooled"]}] if len(result["logs"]) > 1 else result["logs"]
    for entry in entries:
        lines.append(entry["name"])
        # A fit is judged by its predictions: they stand first, and the noisier errors of single rows below them.
        beside_hull = entry.get("prediction_beside_hull", {"windows": 0})
        if entry.get("prediction", {}).get("windows"):
            lines.append(f"  {_verdict(entry['prediction'], 'squared prediction error in windows')}")
        if beside_hull["windows"]:
            lines.append(f"  {_verdict(beside_hull, 'squared prediction error in windows', HULL)}")
        lines.append(f"  {_verdict(entry, 'mean square force error, row by row')}")
        if "prediction" in entry:
            lines.extend(_prediction_lines(entry["prediction"]))
        if beside_hull["windows"]:
            lines.extend(_beside_hull_lines(beside_hull))
        if "free_run" in entry:
            lines.extend(_free_run_lines(entry["free_run"]))
        lines.extend(_score_lines(entry, _ROWS))
        applied = entry.get("effects", {"vessel": (), "conditions": (), "left_out": ()})
        lines.extend(f"  acts, as in every log: {one['says']}" for one in applied["vessel"])
        lines.extend(f"  acts, as in this log: {one['says']}" for one in applied["conditions"])
        lines.extend(f"  {told}" for told in applied["left_out"])
        lines.extend(f"  warning: {warning}" for warning in entry.get("warnings", ()))
    pooled = result.get("pooled", {}).get("prediction", {})
    if result.get("warnings"):
        lines += ["", *(f"warning: {warning}" for warning in result["warnings"])]
    if pooled.get("windows"):
        lines += ["", *_explained(pooled["window_s"], "base" in head)]
    return "\n".join(lines)


def _rejected(*, diagnosed: bool) -> str:
    """Return what it means that a model was not accepted."""
    if diagnosed:
        return f"this model is {NOT_ACCEPTED}. Use it only where its errors below are the smaller ones"
    return "this model is marked as rejected, as its fit was not accepted"


def _score_lines(scores: dict[str, Any], labels: tuple[str, str, str]) -> list[str]:
    """Return the errors of base model and model as lines, with labels of squares, roots and R²."""
    squares, root, r2 = labels
    ratio = "".join(f"{_number(scores['per_axis'][axis]):>11}" for axis in AXES)
    lines = [f"{f'  {squares}':<34}{ratio}{_number(scores['normalised_mse']):>9}"]
    for part in ("base", "model"):
        values = "".join(f"{_root(scores['mse'][part][axis]):>11}" for axis in AXES)
        lines.append(f"{'  ' + root.format(part):<34}{values}")
    lines.append(f"{f'  {r2}':<34}" + "".join(f"{_number(scores['r2']['model'][axis]):>11}" for axis in AXES))
    return lines


def _prediction_lines(scores: dict[str, Any]) -> list[str]:
    if not scores["windows"]:
        return [f"  no prediction error: no unbroken stretch of {scores['window_s']:.3g} s"]
    lines = _score_lines(scores, _WINDOWS)
    if (still := scores["mse"].get("constant_velocity")) is None:
        return lines
    root = "".join(f"{_root(still[axis]):>11}" for axis in AXES)
    lines.insert(-1, f"{'    rms, constant velocity':<34}{root}")
    worse = [axis for axis in AXES if scores["mse"]["model"][axis] > still[axis]]
    if worse:
        lines.append(
            f"  warning: in {' and '.join(worse)} the model predicts worse than a velocity that does not change"
        )
    return lines


def _beside_hull_lines(scores: dict[str, Any]) -> list[str]:
    """Return the ratio over the profile's hull, and what that errs; the model's own errors stand above."""
    ratio = "".join(f"{_number(scores['per_axis'][axis]):>11}" for axis in AXES)
    root = "".join(f"{_root(scores['mse']['base'][axis]):>11}" for axis in AXES)
    return [
        f"{_BESIDE_HULL:<34}{ratio}{_number(scores['normalised_mse']):>9}",
        f"{'    rms, hull [N, N, N·m]':<34}{root}",
    ]


def _explained(window_s: float, diagnosed: bool) -> list[str]:
    """Return what the two kinds of errors are, as lines; the base of a diagnosed model sees all that was measured."""
    predicted = [
        "prediction error: the acceleration predicted from force and velocity, against the measured one, averaged over",
        f"  windows of {window_s:.3g} s, as force on the base model's mass, as fit judges. Little of the noise is in it.",
    ]
    return [
        *predicted,
        *([] if diagnosed else ["  The base model is without measured wind, current and payload there."]),
        "row by row: the applied force estimated from the motion, against the measured one. The noise of the differentiated",
        "  velocity is in it, and is the most of it in many logs. It is in the model's own thrust: one that takes thrusters",
        "  and hull for half as much moves alike, with half that error.",
    ]


def _verdict(entry: dict[str, Any], error: str, base: str = "its base model") -> str:
    mean = entry["normalised_mse"]
    worse = [axis for axis in AXES if np.isfinite(entry["per_axis"][axis]) and entry["per_axis"][axis] > 1.05]
    if np.isinf(mean):
        return f"cannot be judged: the model has no mass matrix that can be inverted ({error})"
    if not np.isfinite(mean):
        return f"cannot be judged: {base.replace('its', 'the')} makes no error here"
    better = mean < 1.0
    # Hardly any error is left, but some.
    digits = 1 if 0.0 < mean < 0.005 else 0
    size = f"{100.0 * abs(mean - 1.0):.{digits}f} %"
    # No percentage of a change is one: "0 % worse" names a side that the figure does not have.
    change = "as good as" if size == "0 %" else f"{size} {'better' if better else 'worse'} than"
    told = f"{change} {base} here ({error})"
    if not worse:
        return told
    if len(worse) == len(AXES):
        return f"{told}, on every axis"
    return f"{told}, {'namely' if mean >= 1.0 and size != '0 %' else 'but worse'} in {' and '.join(worse)}"


def _free_run_lines(runs: dict[str, Any]) -> list[str]:
    lines = []
    horizons = runs["model"]["horizons_s"]
    lines.append(f"{'  free run, horizon [s]':<34}" + "".join(f"{horizon:>11g}" for horizon in horizons))
    for part in ("base", "model"):
        run = runs[part]
        for key, label, factor in (
            ("position_m", "position [m]", 1.0),
            ("heading_rad", "heading [deg]", np.degrees(1.0)),
        ):
            values = "".join(f"{_number(value, factor):>11}" for value in run[key])
            lines.append(f"{'  ' + label + ', ' + part:<34}{values}")
        if run["note"]:
            lines.append(f"  {part}: {run['note']}")
    return lines


def _root(value: float) -> str:
    return f"{value**0.5:.3g}" if np.isfinite(value) else "-"


def _number(value: float | None, factor: float = 1.0) -> str:
    return "-" if value is None or not np.isfinite(value) else f"{value * factor:.3f}"
