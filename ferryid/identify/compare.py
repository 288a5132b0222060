"""Compare two models: their coefficients, and on logs their errors on the same rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.identify.model import AXES, Model
from ferryid.identify.physics_rows import effect_rows, hull_rows, render_effects, render_hull
from ferryid.identify.predict import predict
from ferryid.identify.scores import by_axis, free_run_plain, mean_square, r_squared, usable
from ferryid.identify.settings import check_window
from ferryid.signals.prepare import prepare
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
BLOCK_S = 30.0
DRAWS = 2000
CONSTANT = "1"
"""Name of the constant among the terms, as in a model file."""


def compare(
    a: Model,
    b: Model,
    logs: Sequence[str],
    out: Path,
    *,
    profile: Profile | None = None,
    window_s: float = 1.0,
    progress: Callable[[str], None],
) -> dict[str, Any]:
    """Compare two models of one vessel.

    Both are judged on the same rows of test data smoothed alike, whatever window each was trained with. The difference of
    their MSE comes with a 95 % interval from resampling blocks of 30 s, in pairs.

    Raises
    ------
    FerryIdError
        When the models belong to different vessels.

    Returns
    -------
    dict
        Schema ``ferryid.compare/1``.
    """
    hull_a = parse_profile(a.profile_text, a.name)
    hull_b = parse_profile(b.profile_text, b.name)
    if hull_a.name != hull_b.name:
        raise FerryIdError(
            f"{_label(a)} and {_label(b)}: models of different vessels ({hull_a.name}, {hull_b.name}) cannot be compared. "
            "Fix: give two models of one vessel"
        )
    check_window(window_s)
    profile = profile or hull_b
    entries = []
    for path in logs:
        progress(f"comparing on {Path(path).name}")
        prepared = prepare(path, profile, out, window_s=window_s, keep_track=a.diagnosed or b.diagnosed)
        motion = prepared.motion
        one, other = (predict(model, prepared, profile, window_s=window_s, smoother="square") for model in (a, b))
        tau_a, tau_b = one.tau, other.tau
        rows = usable(motion, tau_a, tau_b)
        difference = _paired(motion.tau, tau_a, tau_b, rows, round(BLOCK_S * motion.rate_hz))
        entries.append(
            {
                "name": motion.log,
                "rows": int(rows.sum()),
                "warnings": [
                    f"{_label(model)} was trained on this log: its scores here are no evidence"
                    for model in (a, b)
                    if any(log["sha256"] == prepared.recording.sha256 for log in model.training)
                ],
                "mse": {
                    "a": by_axis(mean_square(motion.tau, tau_a, rows)),
                    "b": by_axis(mean_square(motion.tau, tau_b, rows)),
                },
                "r2": {
                    "a": by_axis(r_squared(motion.tau, tau_a, rows)),
                    "b": by_axis(r_squared(motion.tau, tau_b, rows)),
                },
                "b_over_a": {
                    axis: {"value": value, "low": low, "high": high, "says": _says(low, high, axis)}
                    for axis, (value, low, high) in zip(AXES, difference, strict=True)
                },
                "free_run": {
                    "a": free_run_plain(one.free_run(rows)),
                    "b": free_run_plain(other.free_run(rows)),
                },
            }
        )
    progress("")
    return {
        "schema": "ferryid.compare/1",
        "a": _entry(a),
        "b": _entry(b),
        "window_s": window_s,
        "coefficients": _coefficients(a, b),
        **({"hull": hull_rows(a, b), "effects": effect_rows(a, b)} if a.diagnosed or b.diagnosed else {}),
        "logs": entries,
    }


def _label(model: Model) -> str:
    return f"{model.name}@{model.version}"


def _entry(model: Model) -> dict[str, Any]:
    return {
        "name": model.name,
        "version": model.version,
        "accepted": model.accepted,
        "validation": model.scores.get("per_axis"),
        "normalised_mse": model.scores.get("normalised_mse"),
    }


def _coefficients(a: Model, b: Model) -> list[dict[str, Any]]:
    """Return the terms that either model has, with both values per axis."""
    rows = []
    for term in dict.fromkeys((*a.terms, *b.terms, CONSTANT)):
        row: dict[str, Any] = {"term": term}
        for j, axis in enumerate(AXES):
            values = {}
            for key, model in (("a", a), ("b", b)):
                if term == CONSTANT:
                    values[key] = {
                        "value": float(model.intercept[j]),
                        "low": float(model.intercept_low[j]),
                        "high": float(model.intercept_high[j]),
                        "unit": "N·m" if axis == "yaw" else "N",
                    }
                elif term in model.terms:
                    k = model.terms.index(term)
                    values[key] = {
                        "value": float(model.theta[k, j]),
                        "low": float(model.low[k, j]),
                        "high": float(model.high[k, j]),
                        "unit": model.units[k][j],
                    }
            row[axis] = values
        rows.append(row)
    return rows


def _paired(tau: Floats, a: Floats, b: Floats, rows: NDArray[np.bool_], block: int) -> list[tuple[float, float, float]]:
    """Return the ratio of b's MSE to a's per axis with a 95 % interval from paired block resampling."""
    used = np.flatnonzero(rows)
    pieces = np.array_split(used, max(1, round(len(used) / max(1, block))))
    sum_a = np.array([np.sum((tau[p] - a[p]) ** 2, axis=0) for p in pieces])
    sum_b = np.array([np.sum((tau[p] - b[p]) ** 2, axis=0) for p in pieces])
    draws = np.random.default_rng(0).integers(0, len(pieces), (DRAWS, len(pieces)))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = sum_b[draws].sum(axis=1) / sum_a[draws].sum(axis=1)
        value = sum_b.sum(axis=0) / sum_a.sum(axis=0)
    # Fewer than five blocks give no interval worth the name.
    spread = np.quantile(ratios, [0.025, 0.975], axis=0) if len(pieces) >= 5 else np.full((2, 3), np.nan)
    return [(float(value[j]), float(spread[0, j]), float(spread[1, j])) for j in range(3)]


def _says(low: float, high: float, axis: str) -> str:
    if not np.isfinite(low + high):
        return f"too little data to tell on {axis}"
    if high < 1.0:
        return f"B is better than A on {axis}"
    if low > 1.0:
        return f"A is better than B on {axis}"
    return f"no difference that this data can show on {axis}"


def render_comparison(result: dict[str, Any]) -> str:
    """Return a comparison as text."""
    a, b = result["a"], result["b"]
    lines = [f"A = {a['name']}@{a['version']}", f"B = {b['name']}@{b['version']}", ""]
    for entry in result["logs"]:
        lines.append(f"{entry['name']}: {entry['rows']} rows smoothed with {result['window_s']:g} s")
        lines.append(f"  {'':<8}{'rms A':>12}{'rms B':>12}{'MSE B/A':>10}{'95 % interval':>18}")
        for axis in AXES:
            ratio = entry["b_over_a"][axis]
            interval = f"{_number(ratio['low'])} .. {_number(ratio['high'])}"
            lines.append(
                f"  {axis:<8}{entry['mse']['a'][axis] ** 0.5:>12.4g}{entry['mse']['b'][axis] ** 0.5:>12.4g}"
                f"{_number(ratio['value']):>10}{interval:>18}  {ratio['says']}"
            )
        for key, label, factor in (
            ("position_m", "position [m]", 1.0),
            ("heading_rad", "heading [deg]", np.degrees(1.0)),
        ):
            for who in ("a", "b"):
                run = entry["free_run"][who]
                pairs = zip(run["horizons_s"], run[key], strict=True)
                values = ", ".join(f"{h:g} s: {_number(value, factor)}" for h, value in pairs)
                lines.append(f"  free run {label} {who.upper()}: {values}{'; ' + run['note'] if run['note'] else ''}")
        lines.extend(f"  warning: {warning}" for warning in entry["warnings"])
        lines.append("")
    lines.append(f"  {'term':<24}" + "".join(f"{axis + ' A':>13}{axis + ' B':>13}" for axis in AXES))
    for row in result["coefficients"]:
        cells = "".join(
            f"{format(row[axis][who]['value'], '.4g') if who in row[axis] else '-':>13}"
            for axis in AXES
            for who in ("a", "b")
        )
        lines.append(f"  {row['term']:<24}{cells}")
    lines += render_hull(result.get("hull", ())) + render_effects(result.get("effects", ()))
    return "\n".join(lines)


def _number(value: float | None, factor: float = 1.0) -> str:
    return "-" if value is None or not np.isfinite(value) else f"{value * factor:.3f}"
