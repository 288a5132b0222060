"""What a shell offers when a word is completed: names of vessels, models, effects, forms of export and scenarios."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import typer

OUT = Path("ferryid-out")
"""The output folder where none is given."""


def vessel_names(incomplete: str) -> list[str]:
    """Return the names of profiles that begin so, and TOML files."""
    from ferryid.vessel import known

    return _begin(sorted(known()), incomplete) + _files(incomplete, ".toml")


def model_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return models of the store under ``--out`` that begin so: names, versions once a name is there, and files.

    For simulate, the store is that of ``--models``.
    """
    given = (ctx.params.get(name) for name in ("models", "out"))
    out = next((Path(one) for one in given if one and isinstance(one, str | Path)), OUT)
    versions: dict[str, list[int]] = {}
    for path in (out / "models").glob("*/*.json"):
        if path.stem.isdigit():
            versions.setdefault(path.parent.name, []).append(int(path.stem))
    if "@" in incomplete:
        names = [f"{name}@{number}" for name, numbers in sorted(versions.items()) for number in sorted(numbers)]
    else:
        names = sorted(versions)
    return _begin(names, incomplete) + _files(incomplete, ".json")


def model_or_log(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return models that begin so, and any file."""
    return list(dict.fromkeys([*model_names(ctx, incomplete), *_files(incomplete, "")]))


def effect_names(incomplete: str) -> list[str]:
    """Return lists of effects, with commas between, whose last one begins so."""
    from ferryid.effects import effects

    before, comma, last = incomplete.rpartition(",")
    taken = before.split(",")
    return [f"{before}{comma}{name}" for name in _begin(sorted(effects()), last) if name not in taken]


def format_names(incomplete: str) -> list[str]:
    """Return the forms of export that begin so."""
    from ferryid.export.formats import names

    return _begin(names(), incomplete)


def scenario_names(incomplete: str) -> list[str]:
    """Return the bundled scenarios that begin so, and TOML files."""
    from importlib.resources import files

    names = (one.name for one in files("ferryid.simulate.scenarios").iterdir())
    bundled = sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))
    return _begin(bundled, incomplete) + _files(incomplete, ".toml")


def _begin(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _files(incomplete: str, suffix: str) -> list[str]:
    """Return files of a suffix that begin so, and the folders on the way, each with a slash; none for no letter at all."""
    if not incomplete:
        return []
    folder, _, start = incomplete.rpartition("/")
    try:
        there = sorted(os.scandir(f"{folder}/" if "/" in incomplete else "."), key=lambda one: one.name)
    except OSError:
        return []
    before = f"{folder}/" if "/" in incomplete else ""
    return [
        f"{before}{one.name}{'/' if one.is_dir() else ''}"
        for one in there
        if one.name.startswith(start) and (one.is_dir() or one.name.endswith(suffix)) and not one.name.startswith(".")
    ]
