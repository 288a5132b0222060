"""The model store: numbered versions of named models under one folder, and which one is current.

``<out>/models/<name>/<version>.json`` are the models, ``<out>/models/<name>/current`` holds the number of the accepted
version in use, and ``history.jsonl`` what was current before. Versions are never overwritten.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import dump_json, remove_abandoned, write_text
from ferryid.models.model import Model, model_from_json, model_to_json
from ferryid.models.store.history import earlier_versions, make_current


@dataclass(frozen=True)
class StoredModel:
    """One stored version: its file, whether it is the current one, and which was before it was saved."""

    path: Path
    model: Model
    current: bool
    previous: int | None = None


@dataclass(frozen=True)
class UnreadableModel:
    """One stored version whose file is damaged, or of a newer ferryid, and why it cannot be read."""

    path: Path
    current: bool
    reason: str


NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,79}")


def check_name(name: str) -> str:
    """Return a name that a model may be stored under.

    Raises
    ------
    FerryIdError
        For a name that would be a path, hidden, or confused with a version.
    """
    if not NAME.fullmatch(name):
        raise FerryIdError(
            f"--name: {name[:80]!r} cannot name a model. Fix: use up to 80 letters, digits, points, dashes or underscores"
        )
    return name


def assign_version(model: Model, out: Path) -> Model:
    """Return a model with the version that it will be stored under: the next one of its name.

    A fit that gives, timestamps apart, the same model as a stored version is that version again. Files that cannot be read
    keep their numbers.
    """
    folder = _folder(out) / model.name
    if model.accepted and (folder / "current").is_dir():
        raise FerryIdError(
            f"{folder / 'current'}: the number of the current version is stored in this file, found a folder. "
            "Fix: move or delete that folder and fit again, or fit with another --name"
        )
    remove_abandoned(folder)
    present = _versions(folder)
    plain = _undated(model)
    for number in present:
        with suppress(FerryIdError):
            stored = load_file(folder / f"{number}.json")
            if _undated(stored) == plain:
                return stored
    return replace(model, version=max(present, default=0) + 1)


def plan(model: Model, out: Path) -> StoredModel:
    """Return what `save` will leave for a model that has its number."""
    folder = _folder(out) / model.name
    previous = _current(folder)
    return StoredModel(folder / f"{model.version}.json", model, model.accepted or previous == model.version, previous)


def save(model: Model, out: Path) -> StoredModel:
    """Store a model under its next version; an accepted one becomes current.

    Raises
    ------
    FerryIdError
        For a model that could not be read again; nothing is written then.
    """
    model = assign_version(model, out)
    stored = plan(model, out)
    if not stored.path.exists():
        text = dump_json(model_to_json(model))
        try:
            model_from_json(json.loads(text), str(stored.path))
        except FerryIdError as error:
            raise FerryIdError(
                f"{str(error).partition(' Fix: ')[0]} The model is not stored, as nobody could read it: this is a bug. "
                "Fix: report it with the logs"
            ) from error
        write_text(stored.path, text)
    if model.accepted:
        action = "diagnose" if model.diagnosed else "fit"
        make_current(stored.path.parent, stored.previous, model.version, action, "It was accepted.")
    return stored


def current_version(name: str, out: Path) -> int | None:
    """Return which version of a model is current, None where none is."""
    return _current(_folder(out) / name)


def promote(
    model: Model, out: Path, reason: str, *, logs: Sequence[Mapping[str, str]] = (), forced: bool = False
) -> None:
    """Make a stored version the current one; see `Change` for the arguments."""
    folder = _folder(out) / model.name
    make_current(folder, _current(folder), model.version, "promote", reason, logs=logs, forced=forced)


def roll_back(name: str, out: Path, to: int | None = None) -> tuple[int | None, int]:
    """Make the version current that was it before, or one that was it earlier; returns the version left and the new one.

    Raises
    ------
    FerryIdError
        Where no such version was current, or its file is not there or damaged.
    """
    folder = _folder(out) / name
    present = _versions(folder)
    if not present:
        find(name, out)
    before = _current(folder)
    earlier = [version for version in earlier_versions(folder, before) if version != before]
    if to is None and not earlier:
        raise FerryIdError(
            f"{name}: no version that was current before is known. Fix: choose one with ferryid models promote {name}@VERSION"
        )
    target = earlier[-1] if to is None else to
    if target not in earlier:
        listed = ", ".join(str(version) for version in sorted(set(earlier))) or "none"
        raise FerryIdError(
            f"{name}@{target}: not among the versions that a rollback can return to: {listed}. Fix: choose one of them, or use "
            f"ferryid models promote {name}@{target}"
        )
    load_file(folder / f"{target}.json")
    reason = "Back to the version before." if to is None else "Back to a version that had been current."
    make_current(folder, before, target, "rollback", reason)
    return before, target


def load(reference: str, out: Path) -> Model:
    """Load a model by path, ``name`` (its current version, else its newest) or ``name@version``.

    Raises
    ------
    FerryIdError
        When there is no such model, with the nearest name.
    """
    return load_file(find(reference, out))


def find(reference: str, out: Path) -> Path:
    """Return the file of a model; see `load`."""
    path = Path(reference)
    if path.is_file():
        return path
    name, _, version = reference.partition("@")
    folder = _folder(out) / name
    present = _versions(folder)
    if not present:
        if path.suffix == ".json" or len(path.parts) > 1:
            raise FerryIdError(f"{reference}: no such model file. Fix: see ferryid models --out {out}")
        names = [one.name for one in _models(out)]
        raise FerryIdError(
            f"{reference}: no model of that name under {_folder(out)}.{did_you_mean(name, names)} "
            "Fix: list what there is with ferryid models, or give the path of a model file"
        )
    listed = ", ".join(str(n) for n in present)
    if version:
        number = int(version) if _is_number(version) else -1
        if number not in present:
            raise FerryIdError(f"{reference}: no such version of {name}, there are {listed}. Fix: give one of these")
    else:
        problem = current_problem(folder)
        if problem:
            raise FerryIdError(
                f"{problem}. Fix: give a version as {name}@NUMBER, there are {listed}, or fit again: a model that is "
                "accepted becomes the current one"
            )
        number = _current(folder) or max(present)
    return folder / f"{number}.json"


def current_problem(folder: Path) -> str:
    """Return what is wrong with the note of the current version of a model, an empty string where nothing is."""
    path = folder / "current"
    if not os.path.lexists(path):
        return ""
    number = _current(folder)
    if number is None:
        return f"{path}: damaged, it holds no number of the current version"
    if number not in _versions(folder):
        return f"{path}: names version {number} as the current one, which does not exist"
    return ""


def load_file(path: Path) -> Model:
    """Load one model file."""
    try:
        text = path.read_text(encoding="utf-8")
        if not text.strip("\0 \r\n\t"):
            raise ValueError(
                f"its {counted(len(text), 'byte')} {verb(len(text), 'holds')} nothing, as after a loss of power"
            )
        data = json.loads(text)
    except UnicodeDecodeError as error:
        raise FerryIdError(f"{path}: {_binary(path)}, where a model file (JSON) is wanted. {NO_MODEL}") from error
    # Thousands of brackets, or of digits, end in errors of Python rather than of JSON.
    except (OSError, ValueError, RecursionError) as error:
        raise FerryIdError(
            f"{path}: not readable as a model file ({error}). Fix: give another version or a file written by ferryid fit, "
            "or fit again: the next free number is taken"
        ) from error
    if not isinstance(data, dict):
        raise FerryIdError(f"{path}: not a ferryid model, but a JSON list or value. Fix: give a file of ferryid fit")
    return model_from_json(data, str(path))


NO_MODEL = (
    "Fix: give the name or the file of a model; logs stand after it (ferryid evaluate MODEL LOG), and to export one needs "
    "--mcap FILE"
)


def _binary(path: Path) -> str:
    """Return what a file that is no text is."""
    from ferryid.ingest import supported_formats

    with path.open("rb") as file:
        head = file.read(64)
    name = next((one.name for one in supported_formats() if one.matches(path, head)), "")
    return f"is a log ({name})" if name else "is no text"


def list_models(out: Path) -> list[StoredModel | UnreadableModel]:
    """Return every stored version, by name and number."""
    found: list[StoredModel | UnreadableModel] = []
    for folder in _models(out):
        current = _current(folder)
        for number in _versions(folder):
            path = folder / f"{number}.json"
            try:
                model = load_file(path)
                model_to_json(model)  # reads the profile in it
                found.append(StoredModel(path, model, number == current))
            except FerryIdError as error:
                reason = str(error)
                found.append(
                    UnreadableModel(path, number == current, reason if str(path) in reason else f"{path}: {reason}")
                )
    return found


def current_problems(out: Path) -> list[str]:
    """Return what is wrong with the notes of current versions."""
    return [problem for folder in _models(out) if _versions(folder) and (problem := current_problem(folder))]


def _models(out: Path) -> list[Path]:
    root = _folder(out)
    return sorted(path for path in root.iterdir() if path.is_dir()) if root.is_dir() else []


def _folder(out: Path) -> Path:
    return out / "models"


def _versions(folder: Path) -> list[int]:
    return sorted(int(path.stem) for path in folder.glob("*.json") if _is_number(path.stem))


def _current(folder: Path) -> int | None:
    path = folder / "current"
    text = ""
    with suppress(OSError):
        text = path.read_text(encoding="utf-8", errors="replace").strip() if path.is_file() else ""
    return int(text) if _is_number(text) else None


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) < 10


def _undated(model: Model) -> str:
    return dump_json(model_to_json(replace(model, version=0, created="")))
