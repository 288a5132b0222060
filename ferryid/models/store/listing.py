"""The stored models as a list, and one model as text."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from ferryid.effects import effects
from ferryid.models.model import Model
from ferryid.models.store.history import read_history
from ferryid.models.store.versions import StoredModel, UnreadableModel, current_problems, list_models
from ferryid.models.stored_effect import StoredEffect
from ferryid.models.training_conditions import fitted_conditions


def list_versions(out: Path) -> dict[str, Any]:
    """Return all stored models for ``ferryid models``."""
    found = current_problems(out)
    return {
        "schema": "ferryid.models/1",
        "models": [_row(stored) for stored in list_models(out)],
        **({"problems": found} if found else {}),
        **({"history": changes} if (changes := _changes(out)) else {}),
    }


def _changes(out: Path) -> dict[str, Any]:
    """Return the history of every name that has one."""
    folders = sorted({stored.path.parent for stored in list_models(out)})
    told = {folder.name: [asdict(change) for change in read_history(folder)] for folder in folders}
    return {name: changes for name, changes in told.items() if changes}


def _row(stored: StoredModel | UnreadableModel) -> dict[str, Any]:
    if isinstance(stored, UnreadableModel):
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
        "normalised_mse": None if stored.model.scores is None else stored.model.scores.force.normalised_mse,
        "logs": [str(log["name"]) for log in stored.model.training],
        "path": str(stored.path),
        **_effects_of(stored.model),
    }


def _effects_of(model: Model) -> dict[str, Any]:
    if not model.diagnosed:
        return {"conditions": fitted} if (fitted := fitted_conditions(model)) else {}
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
    return f"{title}: {values}{'' if stored.confirmed else ' (a hint)'}"
