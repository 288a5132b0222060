"""Where two models differ in physics: the coefficients of their hulls, and the effects that a diagnosis put into them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ferryid.effects import effects
from ferryid.effects.picture import COEFFICIENTS, UNITS
from ferryid.identify.estimate import hull_values
from ferryid.identify.model import Model
from ferryid.identify.stored_effect import StoredEffect, effect_json


def hull_rows(a: Model, b: Model) -> list[dict[str, Any]]:
    """Return the coefficients that differ between two hulls, with intervals where a diagnosis gave them."""
    rows = []
    for k, (name, unit) in enumerate(zip(COEFFICIENTS, UNITS, strict=True)):
        values = {"a": float(hull_values(a)[k]), "b": float(hull_values(b)[k])}
        if values["a"] == values["b"]:
            continue
        row: dict[str, Any] = {"coefficient": name, "unit": unit}
        for key, model in (("a", a), ("b", b)):
            known = model.hull.get(name)
            ends = {"low": known.low, "high": known.high} if known else {"low": None, "high": None}
            row[key] = {"value": values[key], **ends}
        rows.append(row)
    return rows


def effect_rows(a: Model, b: Model) -> list[dict[str, Any]]:
    """Return the effects that differ between two models: of the vessel, then of the logs that each was diagnosed on."""
    mine, theirs = _all(a), _all(b)
    rows = []
    for key in dict.fromkeys((*mine, *theirs)):
        one, other = mine.get(key), theirs.get(key)
        if one is not None and other is not None and effect_json(one) == effect_json(other):
            continue
        log, _, effect, instance = key
        rows.append({"effect": effect, "instance": instance, "log": log or None, "a": _told(one), "b": _told(other)})
    return rows


def render_hull(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Return hulls that differ as lines."""
    if not rows:
        return []
    lines = ["", f"  {'hull':<12}{'A':>13}{'B':>13}{'B/A':>9}  unit"]
    for row in rows:
        a, b = row["a"]["value"], row["b"]["value"]
        ratio = f"{b / a:.3f}" if a else "-"
        lines.append(f"  {row['coefficient']:<12}{a:>13.5g}{b:>13.5g}{ratio:>9}  {row['unit']}")
    return lines


def render_effects(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Return effects that differ as lines."""
    lines = [""] if rows else []
    for row in rows:
        title = effects()[row["effect"]].title + (f" ({row['instance']})" if row["instance"] else "")
        lines.append(f"  {title}, {'a condition of ' + row['log'] if row['log'] else 'a property of the vessel'}")
        lines += [f"    {who}: {row[who.lower()]['says'] if row[who.lower()] else 'not in it'}" for who in ("A", "B")]
    return lines


def _all(model: Model) -> dict[tuple[str, str, str, str | None], StoredEffect]:
    return {
        **{("", "", *one.key): one for one in model.vessel_effects},
        **{(known.log, known.sha256, *one.key): one for known in model.conditions for one in known.effects},
    }


def _told(stored: StoredEffect | None) -> dict[str, Any] | None:
    return None if stored is None else {"parameters": effect_json(stored)["parameters"], "says": stored.says()}
