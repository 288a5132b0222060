"""What a fit estimated of its single training logs beside the hull: a current, a load, the error of a heading."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ferryid.models.model import Model

CONDITION_TITLES = {
    "wind": "wind",
    "current": "current",
    "payload": "load",
    "heading_bias": "heading error",
    "velocity_offset": "velocity offset",
    "yaw_rate_offset": "yaw-rate offset",
}
"""Kinds of conditions by their names in files."""


def fitted_conditions(model: Model) -> dict[str, list[str]]:
    """Return by the name of a training log what was estimated of it, a text for every kind; empty where nothing was."""
    return {str(log["name"]): _told(log["conditions"]) for log in model.training if log.get("conditions")}


def _told(conditions: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> list[str]:
    return [f"{CONDITION_TITLES.get(kind, kind)}: {_values(values)}" for kind, values in conditions.items()]


def _values(values: Mapping[str, Mapping[str, Any]]) -> str:
    """Return parameters with their 95 % intervals."""
    parts = []
    for name, one in values.items():
        value, reach = float(one["value"]), 1.96 * float(one["standard_error"])
        parts.append(f"{name} {value:.3g} ({value - reach:.3g} to {value + reach:.3g}) {one['unit']}")
    return ", ".join(parts)
