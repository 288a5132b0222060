"""The stored models as a list, and one model as text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ferryid.counts import counted
from ferryid.effects import effects
from ferryid.identify.model import AXES, Model, to_json
from ferryid.identify.store import Stored, Unreadable, problems, stored_models
from ferryid.identify.stored_effect import StoredEffect


def listing(out: Path) -> dict[str, Any]:
    """Return all stored models for ``ferryid models``."""
    found = problems(out)
    return {
        "schema": "ferryid.models/1",
        "models": [_row(stored) for stored in stored_models(out)],
        **({"problems": found} if found else {}),
    }


def _row(stored: Stored | Unreadable) -> dict[str, Any]:
    if isinstance(stored, Unreadable):
        return {
            "name": stored.path.parent.name,
            "version": int(stored.path.stem),
            "current": stored.current,
            "accepted": False,
            "created": "",
            "normalised_mse": None,
            "logs": [],
            "path": str(stored.path),
            "unreadable": stored.reason,
        }
    return {
        "name": stored.model.name,
        "version": stored.model.version,
        "current": stored.current,
        "accepted": stored.model.accepted,
        "created": stored.model.created,
        "normalised_mse": stored.model.scores.get("normalised_mse"),
        "logs": [str(log["name"]) for log in stored.model.training],
        "path": str(stored.path),
        **_effects_of(stored.model),
    }


def _effects_of(model: Model) -> dict[str, Any]:
    if not model.diagnosed:
        return {}
    return {
        "vessel_effects": [*(["hull refitted"] if model.hull else []), *(_short(one) for one in model.vessel_effects)],
        "conditions": {known.log: [_short(one) for one in known.effects] for known in model.conditions},
    }


def _short(stored: StoredEffect) -> str:
    """Return an effect as a few words: its name and its values."""
    title = effects()[stored.effect].title.lower() + (f" ({stored.instance})" if stored.instance else "")
    values = ", ".join(
        f"{name} {one.value:.3g}{'' if one.unit == '-' else ' ' + one.unit}" for name, one in stored.parameters.items()
    )
    return f"{title}: {values}"


def render_listing(result: dict[str, Any], out: Path) -> str:
    """Return the list as text."""
    if not result["models"]:
        return f"no models under {out}. Make one with: ferryid fit LOG --vessel PROFILE --out {out}"
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
    lines += [
        f"{problem}. Fix: fit again, a model that is accepted becomes the current one"
        for problem in result.get("problems", ())
    ]
    return "\n".join(lines)


def _state(row: dict[str, Any]) -> str:
    if "unreadable" in row:
        return "unreadable"
    return "accepted" if row["accepted"] else "diagnosed" if "conditions" in row else "rejected"


def _some(names: Sequence[str]) -> str:
    """Name the first two logs, each cut to 40 characters, and count the others."""
    shown = [name if len(name) <= 40 else "…" + name[-39:] for name in names[:2]]
    return ", ".join(shown) + (f" and {len(names) - 2} more" if len(names) > 2 else "")


def render_model(model: Model) -> str:
    """Return one model as text: verdict, scores, and coefficients with their intervals."""
    data = to_json(model)
    settings = model.settings
    wide = max([14, *(len(term) + 2 for axis in AXES for term in data["coefficients"][axis])])
    lines = [
        f"{model.name}@{model.version}  {_verdict(model)}  {model.created}",
        f"a diagnosis of {settings.get('diagnosed_from')}, without terms of a fit"
        if model.diagnosed and not model.terms
        else fitted_with(model),
        f"trained on {', '.join(str(log['name']) for log in model.training)}",
        f"validation force MSE over the base model's: {_number(model.scores.get('normalised_mse'))} ("
        + ", ".join(f"{axis} {_number(model.scores.get('per_axis', {}).get(axis))}" for axis in AXES)
        + ")",
        "",
        f"{'term':<{wide}}{'axis':<7}{'value':>13}{'low':>13}{'high':>13}  unit",
    ]
    for axis in AXES:
        for term, entry in data["coefficients"][axis].items():
            if entry["value"] == 0.0 and entry["low"] == 0.0 and entry["high"] == 0.0:
                continue
            lines.append(
                f"{term:<{wide}}{axis:<7}{entry['value']:>13.5g}{entry['low']:>13.5g}{entry['high']:>13.5g}  {entry['unit']}"
            )
    if model.hull:
        lines += ["", f"{'hull':<14}{'value':>20}{'low':>13}{'high':>13}  unit"]
        for name, one in model.hull.items():
            lines.append(f"{name:<14}{one.value:>20.5g}{one.low:>13.5g}{one.high:>13.5g}  {one.unit}")
    for stored in model.vessel_effects:
        lines += ["", f"vessel: {stored.says()}", f"  found in {', '.join(one.log for one in stored.sources)}"]
    for known in model.conditions:
        lines += ["", f"only in {known.log}:", *(f"  {stored.says(known.sha256)}" for stored in known.effects)]
    return "\n".join(lines)


def fitted_with(model: Model) -> str:
    """Return basis, structure, components and window of a fit, those that were chosen for it as well."""
    settings = model.settings
    count: Any = settings.get("components")
    return (
        f"basis {settings.get('basis')}, {settings.get('structure')}, {counted(count, 'component')}, "
        f"window {settings.get('window_s')} s"
    )


def _verdict(model: Model) -> str:
    if model.accepted:
        return "accepted"
    # It holds for its own log; whether it does for others is not known.
    return "diagnosed" if model.diagnosed else "REJECTED"


def _number(value: Any) -> str:
    return "-" if value is None else f"{value:.3f}"
