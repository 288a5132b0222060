"""Writing a model in one of the forms of export."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.export.exported import Exported, exported
from ferryid.export.format import Format
from ferryid.export.formats import formats
from ferryid.export.names import identifier
from ferryid.export.words import MARK
from ferryid.files import taken, unwritable, write_bytes
from ferryid.models.store import find, load_file

SCHEMA = "ferryid.export/1"
FOLDER = "exports"
"""Folder in the output folder for what is given no name."""
_HEAD_BYTES = 4096
MUCH = 0.25
"""Share of the force from which on an error of another program is a warning."""


def export_model(
    reference: str, to: str, out: Path, *, file: Path | None = None, overwrite: bool = False
) -> dict[str, Any]:
    """Write a model in a form of export; the same model gives the same bytes.

    Parameters
    ----------
    reference
        Path, name or name@version of the model.
    to
        Name of the form, as of `ferryid.export.formats.formats`.
    out
        Output folder, with the model store, and ``exports`` for the file.
    file
        Where to write instead.
    overwrite
        Replace what is there, if that is an export.

    Returns
    -------
    dict
        Schema ``ferryid.export/1``.

    Raises
    ------
    FerryIdError
        For an unknown form or model, a model that cannot be exported, or a place that cannot or must not be written to.
    """
    form = chosen(to)
    source = find(reference, out)
    model = load_file(source)
    name = identifier(model.name, model.version)
    place = file or out / FOLDER / f"{name}{form.suffix}"
    _check_suffix(place, form)
    if form.names_file:
        name = _name_of(place, form)
    one = exported(model, hashlib.sha256(source.read_bytes()).hexdigest(), name)
    text = form.render(one)
    content = text.encode() if isinstance(text, str) else text
    _check_place(place, source, content, overwrite=overwrite or file is None)
    write_bytes(place, content, by="--out" if file is None else "--file")
    checked = None if form.check is None else form.check(one, str(text))
    return {
        "schema": SCHEMA,
        "kind": "model",
        "format": form.name,
        "file": str(place),
        "sha256": hashlib.sha256(content).hexdigest(),
        "name": one.name,
        "model": {
            "name": model.name,
            "version": model.version,
            "accepted": model.accepted,
            "sha256": one.sha256,
        },
        "effects": _effects(one),
        "cases": len(one.cases),
        "warnings": [*one.warnings(), *_errors(checked)],
        "left_out": list(one.left_out()),
        **({} if checked is None else {"check": checked}),
    }


def _errors(checked: Mapping[str, Any] | None) -> list[str]:
    """Return a warning where another program's equations get much of the force wrong."""
    large = [] if checked is None else [(v, k) for k, v in checked["error_share"]["velocity"].items() if v > MUCH]
    if checked is None or not large:
        return []
    parts = ", ".join(f"{100.0 * value:.0f} % of the {axis} force" for value, axis in sorted(large, reverse=True))
    return [
        f"the equations of {checked['equations']} get {parts} wrong: do not simulate manoeuvres with it that depend on it."
    ]


def chosen(to: str) -> Format:
    """Return a form by its name.

    Raises
    ------
    FerryIdError
        For one that does not exist, with the nearest that does.
    """
    if to not in formats():
        raise FerryIdError(
            f'--to: there is no form "{to}" to export a model in.{did_you_mean(to, formats())} '
            f"Fix: choose one of {', '.join(formats())}"
        )
    return formats()[to]


def _check_suffix(place: Path, form: Format) -> None:
    """Refuse a name that says that a file is of another form."""
    name = place.name.lower()
    other = next((one for one in formats().values() if name.endswith(one.suffix)), form)
    if not name.endswith(form.suffix) and other is not form:
        raise FerryIdError(
            f"{place}: {other.suffix} is the suffix of {other.title}, and --to {form.name} writes {form.title}. "
            f"Fix: end --file in {form.suffix}, or give --to {other.name}"
        )


def _name_of(place: Path, form: Format) -> str:
    """Return what a function in a file has to be called."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", place.stem) or place.suffix != form.suffix:
        raise FerryIdError(
            f"{place}: {form.title} is called as its file, found a name that it cannot have. "
            f"Fix: give --file a name of up to 63 letters, digits and underscores that ends in {form.suffix}"
        )
    return place.stem


def _check_place(place: Path, source: Path, content: bytes, *, overwrite: bool) -> None:
    """Refuse to write over a model, over anything that is no export, and unasked over anything else than the same."""
    try:
        if not place.exists():
            return
        if not place.is_file():
            raise FerryIdError(f"{place}: cannot be replaced, found no file. Fix: give --file another name")
        with place.open("rb") as there:
            start = there.read(_HEAD_BYTES)
        if place.samefile(source) or (start and MARK.encode() not in start):
            raise FerryIdError(f"{place}: cannot be replaced, found no export. Fix: give --file another name")
        if not overwrite and place.read_bytes() != content:
            raise taken(place)
    except OSError as error:
        raise unwritable(place, error, "--file") from error


def _effects(one: Exported) -> list[dict[str, Any]]:
    return [
        {
            "effect": acting.stored.effect,
            "instance": acting.stored.instance,
            "acts_on": acting.on,
            "name": acting.name,
            "parameters": {
                name: {"value": quantity.value, "unit": quantity.unit} for name, quantity in acting.parameters.items()
            },
            "says": acting.stored.says(),
        }
        for acting in one.acting
    ]
