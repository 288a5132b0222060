"""The model store: numbered versions of named models under one folder, and which one is current.

``<out>/models/<name>/<version>.json`` are the models, ``<out>/models/<name>/current`` holds the number of the accepted
version in use. Versions are never overwritten.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import dump_json, write_text
from ferryid.identify.model import Model, from_json, to_json


@dataclass(frozen=True)
class Stored:
    """One stored version: its file, whether it is the current one, and which was before it was saved."""

    path: Path
    model: Model
    current: bool
    previous: int | None = None


def numbered(model: Model, out: Path) -> Model:
    """Return a model with the version that it will be stored under: the next one of its name.

    A fit that gives, timestamps apart, the same model as a stored version is that version again.
    """
    folder = _folder(out) / model.name
    present = _versions(folder)
    plain = _undated(model)
    for number in present:
        stored = load_file(folder / f"{number}.json")
        if _undated(stored) == plain:
            return stored
    return replace(model, version=max(present, default=0) + 1)


def save(model: Model, out: Path) -> Stored:
    """Store a model under its next version; an accepted one becomes current."""
    model = numbered(model, out)
    folder = _folder(out) / model.name
    path = folder / f"{model.version}.json"
    previous = _current(folder)
    if not path.exists():
        write_text(path, dump_json(to_json(model)))
    if model.accepted:
        write_text(folder / "current", f"{model.version}\n")
    return Stored(path, model, _current(folder) == model.version, previous)


def load(reference: str, out: Path) -> Model:
    """Load a model by path, ``name`` (its current version, else its newest) or ``name@version``.

    Raises
    ------
    FerryIdError
        When there is no such model, with the nearest name.
    """
    path = Path(reference)
    if path.is_file():
        return load_file(path)
    name, _, version = reference.partition("@")
    folder = _folder(out) / name
    present = _versions(folder)
    if not present:
        if path.suffix == ".json" or len(path.parts) > 1:
            raise FerryIdError(f"{reference}: no such model file. Fix: see ferryid models --out {out}")
        names = [stored.model.name for stored in stored_models(out)]
        raise FerryIdError(
            f"{reference}: no model of that name under {_folder(out)}.{did_you_mean(name, names)} "
            "Fix: list what there is with ferryid models, or give the path of a model file"
        )
    number = int(version) if version.isdigit() else (_current(folder) or max(present))
    if number not in present or (version and not version.isdigit()):
        listed = ", ".join(str(n) for n in present)
        raise FerryIdError(f"{reference}: no such version of {name}, there are {listed}. Fix: give one of these")
    return load_file(folder / f"{number}.json")


def load_file(path: Path) -> Model:
    """Load one model file."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FerryIdError(
            f"{path}: not readable as a model file ({error}). Fix: give a JSON file written by ferryid fit"
        ) from error
    if not isinstance(data, dict):
        raise FerryIdError(f"{path}: not a ferryid model, but a JSON list or value. Fix: give a file of ferryid fit")
    return from_json(data, str(path))


def stored_models(out: Path) -> list[Stored]:
    """Return every stored version, by name and number."""
    root = _folder(out)
    found = []
    for folder in sorted(root.iterdir()) if root.is_dir() else []:
        current = _current(folder)
        for number in _versions(folder):
            path = folder / f"{number}.json"
            found.append(Stored(path, load_file(path), number == current))
    return found


def _folder(out: Path) -> Path:
    return out / "models"


def _versions(folder: Path) -> list[int]:
    return sorted(int(path.stem) for path in folder.glob("*.json") if path.stem.isdigit())


def _current(folder: Path) -> int | None:
    path = folder / "current"
    text = path.read_text(encoding="utf-8").strip() if path.is_file() else ""
    return int(text) if text.isdigit() else None


def _undated(model: Model) -> str:
    return dump_json(to_json(replace(model, version=0, created="")))
