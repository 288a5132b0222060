"""Stored models as text: the list of versions, and one model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.models import Model, fitted_conditions, model_to_json
from ferryid.models.coefficients import EQUATION_UNITS, equation_coefficients
from ferryid.models.store import Change
from ferryid.report.rounding import without_rounding
from ferryid.types import AXES

MOST_CHANGES = 10
"""Changes of the current version that the list shows, the latest ones."""


def render_listing(result: dict[str, Any], out: Path) -> str:
    """Return the list as text."""
    if not result["models"]:
        return f"no models under {out}. Make one with: ferryid fit LOG --vessel PROFILE --out {quote(str(out))}"
    lines = [f"  {'model':<28}{'verdict':<12}{'MSE/base':>9}  {'created':<22}trained on"]
    for model in result["models"]:
        mark = "*" if model["current"] else " "
        score = model["normalised_mse"]
        lines.append(
            f"{mark} {model['name'] + '@' + str(model['version']):<28}"
            f"{_state(model):<12}"
            f"{'-' if score is None else format(score, '9.3f'):>9}  {model['created']:<22}{_some(model['logs'])}"
        )
        if "unreadable" in model:
            lines.append(f"      {model['unreadable']}")
        lines += [f"      vessel: {told}" for told in model.get("vessel_effects", ())]
        for log, shown in model.get("conditions", {}).items():
            lines += [f"      {_some([log])}: {told}" for told in shown]
    if any(model["current"] for model in result["models"]):
        lines.append("* current")
    for name, changes in result.get("history", {}).items():
        lines += ["", f"{name}, which version was current since when"]
        lines += [f"  {Change(**change).sentence}" for change in changes[-MOST_CHANGES:]]
    lines += [
        f"{problem}. Fix: fit again, a model that is accepted becomes the current one"
        for problem in result.get("problems", ())
    ]
    return "\n".join(lines)


def _state(row: dict[str, Any]) -> str:
    if "unreadable" in row:
        return "unreadable"
    return "accepted" if row["accepted"] else "diagnosed" if "vessel_effects" in row else "rejected"


def _some(names: Sequence[str]) -> str:
    """Name the first two logs, each cut to 40 characters, and count the others."""
    shown = [name if len(name) <= 40 else "…" + name[-39:] for name in names[:2]]
    return ", ".join(shown) + (f" and {len(names) - 2} more" if len(names) > 2 else "")


def render_model(model: Model) -> str:
    """Return one model as text: verdict, scores, and coefficients with their intervals."""
    data = model_to_json(model)
    settings = model.settings
    force = None if model.scores is None else model.scores.force
    measure = "" if model.scores is None else model.scores.measure
    mean, ratio = (None, [None] * 3) if force is None else (force.normalised_mse, force.ratio.tolist())
    wide = max([14, *(len(term) + 2 for axis in AXES for term in data["coefficients"][axis])])
    lines = [
        f"{model.name}@{model.version}  {_verdict(model)}  {model.created}",
        f"a diagnosis of {settings.get('diagnosed_from')}, without terms of a fit"
        if model.diagnosed and not model.terms
        else describe_settings(model),
        f"trained on {', '.join(str(log['name']) for log in model.training)}",
        f"validation {measure} MSE over the base model's: {_number(mean)} ("
        + ", ".join(f"{axis} {_number(value)}" for axis, value in zip(AXES, ratio, strict=True))
        + ")",
        *_equations(model),
    ]
    corrected = [
        f"{term:<{wide}}{axis:<7}{entry['value']:>13.5g}{entry['low']:>13.5g}{entry['high']:>13.5g}  {entry['unit']}"
        for axis in AXES
        for term, entry in data["coefficients"][axis].items()
        if any(entry[each] != 0.0 for each in ("value", "low", "high"))
    ]
    # A model of a diagnosis may have no terms: its coefficients are those of the equations above, and no more.
    if corrected:
        lines += [
            "",
            "correction of the base model, term by term, as the model file has it (95 % intervals)",
            f"{'term':<{wide}}{'axis':<7}{'value':>13}{'low':>13}{'high':>13}  unit",
            *corrected,
        ]
    if model.hull and corrected:
        lines += ["", f"{'hull':<14}{'value':>20}{'low':>13}{'high':>13}  unit"]
        shown = without_rounding({name: np.array([one.value, one.low, one.high]) for name, one in model.hull.items()})
        for name, one in model.hull.items():
            value, low, high = shown[name].tolist()
            lines.append(f"{name:<14}{value:>20.5g}{low:>13.5g}{high:>13.5g}  {one.unit}")
    for stored in model.vessel_effects:
        lines += ["", f"vessel: {stored.says()}", f"  found in {', '.join(one.log for one in stored.sources)}"]
    if fitted := fitted_conditions(model):
        lines += ["", "estimated of single logs with the hull, not in the model (95 % intervals):"]
        lines += [f"  {log}: {one}" for log, told in fitted.items() for one in told]
    for known in model.conditions:
        lines += ["", f"only in {known.log}:", *(f"  {stored.says(known.sha256)}" for stored in known.effects)]
    return "\n".join(lines)


def _equations(model: Model) -> list[str]:
    """Return the coefficients of the equations of motion as a table: in the model, in the base model, and the change."""
    found = without_rounding(equation_coefficients(model))
    before = without_rounding(equation_coefficients(replace(model, hull={}, theta=np.zeros_like(model.theta))))
    lines = [
        "",
        "equations of motion, base model and correction together (95 % intervals)",
        f"{'coefficient':<14}{'value':>13}{'low':>13}{'high':>13}{'base model':>13}{'change':>10}  unit",
    ]
    for name, unit in EQUATION_UNITS.items():
        # No negative zero, which an opposite of none is.
        (value, low, high), base = found[name].tolist(), float(before[name][0]) + 0.0
        if base == 0.0 and not np.nan_to_num(found[name]).any():
            continue
        ends = "".join(f"{end:>13.5g}" if math.isfinite(end) else f"{'-':>13}" for end in (low, high))
        change = f"{100.0 * (value / base - 1.0):+.1f} %" if base else "-"
        lines.append(f"{name:<14}{value:>13.5g}{ends}{base:>13.5g}{change:>10}  {unit}")
    return lines


def describe_settings(model: Model) -> str:
    """Return basis, structure, components and window of a fit, those that were chosen for it as well."""
    settings = model.settings
    count: Any = settings.get("components")
    return (
        f"basis {settings.get('basis')}, {settings.get('structure')}, {counted(count, 'component')}, "
        f"window {settings.get('window_s')} s"
        + (f", weak form over {settings['weak_window_s']:.3g} s" if settings.get("estimator") == "weak" else "")
        + (", coefficients from all rows" if settings.get("estimated_from") else "")
    )


def _verdict(model: Model) -> str:
    if model.accepted:
        return "accepted"
    # It holds for its own log; whether it does for others is not known.
    return "diagnosed" if model.diagnosed else "REJECTED"


def error_ratio(value: float) -> str:
    """Return a squared error over another with three decimals, a huge one, as over hardly any error, by its power of ten."""
    return f"{value:.3f}" if value < 1000.0 else f"{value:.1e}"


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3f}"
