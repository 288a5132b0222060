"""Judge a stored model on other logs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.identify.excitation import RANGE_UNITS, payload_kg, range_columns
from ferryid.identify.model import Model
from ferryid.identify.predict import Prediction, predict, predict_before, signal_map
from ferryid.identify.scores import force_scores, outside_ranges, usable
from ferryid.identify.settings import check_window
from ferryid.identify.stored_effect import StoredEffect
from ferryid.signals.prepare import prepare
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, RunContext
from ferryid.vessel.profile import Profile

OUTSIDE_WARNING = 0.05
"""Share of rows outside a range of validity from which on a warning is given."""


def evaluate(
    model: Model,
    logs: Sequence[str],
    run: RunContext,
    *,
    profile: Profile | None = None,
    window_s: float | None = None,
) -> dict[str, Any]:
    """Compare a model's and its base model's force with the measured one, and run both free.

    The base of a model that a diagnosis has changed is the model before it.

    Parameters
    ----------
    model
        The model.
    logs
        Paths; parts of one recording joined by ``+``.
    run
        Output folder and progress.
    profile
        Signal map of the logs; the profile inside the model where None.
    window_s
        Smoothing window of the test data [s]; the model's own where None.

    Returns
    -------
    dict
        Schema ``ferryid.evaluate/1``.
    """
    profile = signal_map(model, profile)
    check_window(window_s)
    window = float(model.settings["window_s"]) if window_s is None else window_s
    smoother = str(model.settings.get("smoother", "square"))
    entries, parts = [], []
    for path in logs:
        run.progress(f"evaluating on {Path(path).name}")
        prepared = prepare(
            path,
            profile,
            run.out,
            window_s=window,
            smoother=smoother,
            rate_hz=model.settings.get("rate_hz"),
            keep_track=model.diagnosed,
        )
        motion = prepared.motion
        new = predict(model, prepared, profile, window_s=window, smoother=smoother)
        old = predict_before(model, prepared, profile, window_s=window, smoother=smoother)
        tau_base, tau_model = old.tau, new.tau
        rows = usable(motion, tau_model)
        parts.append((motion.tau[rows], tau_base[rows], tau_model[rows]))
        entries.append(
            {
                "name": motion.log,
                "sha256": prepared.recording.sha256,
                "rows": int(rows.sum()),
                "seconds": float(rows.sum() / motion.rate_hz),
                **force_scores(motion.tau, tau_base, tau_model, rows).to_json(),
                "free_run": {
                    "base": old.free_run(rows).to_json(),
                    "model": new.free_run(rows).to_json(),
                },
                **({"effects": _applied(new, prepared.recording.sha256)} if model.diagnosed else {}),
                "outside": outside_of(model, motion, rows),
                "warnings": [
                    *prepared.doubts,
                    *_warnings(prepared.recording.sha256, model, motion, rows),
                    *prepared.left_out,
                ],
                "data_quality": prepared.quality,
            }
        )
    run.progress("")
    tau, base_all, model_all = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return {
        "schema": "ferryid.evaluate/1",
        "model": {
            "name": model.name,
            "version": model.version,
            "accepted": model.accepted,
            **({"base": "the model before its diagnosis"} if model.diagnosed else {}),
        },
        "window_s": window,
        "logs": entries,
        "pooled": force_scores(tau, base_all, model_all, np.ones(len(tau), dtype=bool)).to_json(),
    }


def _applied(found: Prediction, sha256: str) -> dict[str, Any]:
    """Return the effects that act on a log, and why others do not."""

    def told(several: Iterable[StoredEffect]) -> list[dict[str, Any]]:
        return [{"effect": one.effect, "instance": one.instance, "says": one.says(sha256)} for one in several]

    return {
        "vessel": told(found.vessel),
        "conditions": told(found.conditions),
        "left_out": list(found.idle),
    }


def cautions_on(model: Model, motion: Motion, rows: Flags) -> list[str]:
    """Say where the marked rows of a log are not what a model was made for."""
    warnings = []
    if motion.payload is None and "payload_kg" in model.ranges:
        warnings.append("the model was trained with the payload known, and this log has none: it is taken as empty")
    for name, share in outside_of(model, motion, rows).items():
        if share > OUTSIDE_WARNING:
            low, high = model.ranges[name]
            warnings.append(
                f"{share:.0%} of the rows have {name} outside the model's range of validity, {low:.3g} to {high:.3g} "
                f"{RANGE_UNITS[name]}"
            )
    return warnings


def outside_of(model: Model, motion: Motion, rows: Flags) -> dict[str, float]:
    """Return the share of the marked rows that lies outside each range of a model's validity."""
    columns = range_columns(motion.nu[rows], motion.nu_dot[rows], payload_kg(motion, rows))
    return outside_ranges(columns, model.ranges)


def _warnings(sha256: str, model: Model, motion: Motion, rows: Flags) -> list[str]:
    warnings = cautions_on(model, motion, rows)
    if any(log["sha256"] == sha256 for log in model.training):
        warnings.append("the model was trained on this log: its scores here are no evidence")
    return warnings


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
                + "".join(f"{entry['mse'][part][axis] ** 0.5:>11.3g}" for axis in AXES)
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


def _number(value: float | None, factor: float = 1.0) -> str:
    return "-" if value is None or not np.isfinite(value) else f"{value * factor:.3f}"
