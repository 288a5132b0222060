"""An evaluation as text for a terminal."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.types import AXES


def render_evaluation(result: dict[str, Any]) -> str:
    """Return an evaluation as text."""
    head = result["model"]
    lines = [f"{head['name']}@{head['version']}, test data smoothed with {result['window_s']:g} s"]
    lines += [f"base: {head['base']}"] if "base" in head else []
    lines.append("")
    lines.append(f"{'':<34}" + "".join(f"{axis:>11}" for axis in AXES) + f"{'mean':>9}")
    entries = [*result["logs"], {"name": "all logs", **result["pooled"]}] if len(result["logs"]) > 1 else result["logs"]
    for entry in entries:
        lines.append(entry["name"])
        ratio = "".join(f"{_number(entry['per_axis'][axis]):>11}" for axis in AXES)
        lines.append(f"{'  MSE over the base model' + chr(39) + 's':<34}{ratio}{_number(entry['normalised_mse']):>9}")
        for label, part in (("base", "base"), ("model", "model")):
            lines.append(
                f"{'  rms error, ' + label + ' [N, N, N·m]':<34}"
                + "".join(f"{_root(entry['mse'][part][axis]):>11}" for axis in AXES)
            )
        lines.append(f"{'  R², model':<34}" + "".join(f"{_number(entry['r2']['model'][axis]):>11}" for axis in AXES))
        if "free_run" in entry:
            lines.extend(_free_run_lines(entry["free_run"]))
        lines.append(f"  {_verdict(entry)}")
        applied = entry.get("effects", {"vessel": (), "conditions": (), "left_out": ()})
        lines.extend(f"  acts, as in every log: {one['says']}" for one in applied["vessel"])
        lines.extend(f"  acts, as in this log: {one['says']}" for one in applied["conditions"])
        lines.extend(f"  {told}" for told in applied["left_out"])
        lines.extend(f"  warning: {warning}" for warning in entry.get("warnings", ()))
    return "\n".join(lines)


def _verdict(entry: dict[str, Any]) -> str:
    mean = entry["normalised_mse"]
    worse = [axis for axis in AXES if np.isfinite(entry["per_axis"][axis]) and entry["per_axis"][axis] > 1.05]
    if not np.isfinite(mean):
        return "cannot be judged: the base model makes no error here"
    better = mean < 1.0
    told = f"{abs(mean - 1.0):.0%} {'better' if better else 'worse'} than its base model here (mean square force error)"
    if not worse:
        return told
    if len(worse) == len(AXES):
        return f"{told}, on every axis"
    return f"{told}, {'but worse' if better else 'namely'} in {' and '.join(worse)}"


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
