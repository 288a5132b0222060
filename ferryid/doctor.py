"""The state of an installation: versions, optional parts, the cache of compiled loops, the machine; ``ferryid.doctor/1``."""

from __future__ import annotations

import importlib
import os
import platform
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import ferryid
from ferryid.compiler import CacheState, cache_state
from ferryid.counts import counted
from ferryid.report.interactive import available

SCHEMA = "ferryid.doctor/1"
DEVELOPING = ("bench", "docs", "test")
"""Extras for work on ferryid itself."""
LOOPS = {
    "recursive_filter": ("_filtered",),
    "effects.equations_of_motion": ("accelerations", "required", "slopes"),
    "simulate.loop": ("run",),
}
"""Modules and their compiled functions that a first fit, diagnosis and simulation wait for."""
LEAST_DISK = 1 << 29
"""Bytes that a log and its report need."""
_GIB = 1 << 30
_REQUIREMENT = re.compile(r"""^([A-Za-z0-9._-]+)[^;]*?((?:[<>=!~][^;\s]*)?)\s*(?:;.*extra == ['"]([^'"]+)['"])?\s*$""")


def examine(out: Path) -> dict[str, Any]:
    """Return the state of this installation.

    Parameters
    ----------
    out
        Output folder that is to be used.

    Returns
    -------
    dict
        Schema ``ferryid.doctor/1``; ``problems`` are what stops a command, each with its remedy, and ``notes`` what slows one.
    """
    packages, optional = _packages()
    cache = _cache()
    place = _place(out)
    result: dict[str, Any] = {
        "schema": SCHEMA,
        "version": ferryid.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "installed_at": str(Path(ferryid.__file__).parent),
        "packages": packages,
        "optional": optional,
        "compile_cache": cache,
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
        "memory_gib": _memory_gib(),
        "out": place,
    }
    return {**result, "problems": list(_problems(result)), "notes": list(_notes(result))}


def render(result: Mapping[str, Any]) -> str:
    """Return the state as text."""
    cache, out, memory = result["compile_cache"], result["out"], result["memory_gib"]
    lines = [
        f"ferryid {result['version']}, Python {result['python']}, {result['platform']}",
        f"installed in {result['installed_at']}",
        "",
        "packages",
        *(f"  {one['name']:<16} {one['version'] or 'missing'}" for one in result["packages"]),
        "",
        "optional parts",
        *(f"  {one['extra']:<16} {_parts(one)}" for one in result["optional"]),
        "",
        f"compile cache    {cache['compiled']} of {counted(cache['functions'], 'loop')} compiled, "
        f"{'can' if cache['writable'] else 'cannot'} be written: {', '.join(cache['folders']) or 'no folder'}",
        f"cores            {result['cores']}",
        f"memory           {'not known' if memory is None else f'{memory:.1f} GiB'}",
        f"output folder    {out['folder']}, {out['free_gib']:.1f} GiB free, "
        f"{'can' if out['writable'] else 'cannot'} be written",
        "",
    ]
    lines += [f"problem: {one}" for one in result["problems"]]
    lines += [f"note: {one}" for one in result["notes"]]
    return "\n".join(lines if result["problems"] or result["notes"] else [*lines, "no problem found"])


def _parts(one: Mapping[str, Any]) -> str:
    found = ", ".join(f"{name} {version or 'missing'}" for name, version in one["packages"].items())
    return found if one["complete"] else f"{found} (pip install 'ferryid[{one['extra']}]')"


def _packages() -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the packages that ferryid needs, and those of its extras."""
    needed: list[dict[str, Any]] = []
    extras: dict[str, dict[str, str | None]] = {}
    try:
        requirements = metadata.requires("ferryid") or []
    except metadata.PackageNotFoundError:
        requirements = []
    for text in requirements:
        found = _REQUIREMENT.match(text)
        if found is None:
            continue
        name, wanted, extra = found.groups()
        if extra is None:
            version = _version(name)
            needed.append({"name": name, "version": version, "wanted": wanted, "enough": _enough(version, wanted)})
        elif extra not in DEVELOPING and name != "ferryid":
            extras.setdefault(extra, {})[name] = _version(name)
    optional = [
        {"extra": extra, "packages": packages, "complete": all(packages.values())}
        for extra, packages in sorted(extras.items())
    ]
    return sorted(needed, key=lambda one: str(one["name"])), optional


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _enough(version: str | None, wanted: str) -> bool:
    """Tell whether a version is the least that is wanted or newer, by its leading numbers."""
    if version is None:
        return False
    if not wanted.startswith(">="):
        return True
    have, least = (_leading(text) for text in (version, wanted[2:].partition(",")[0]))
    return have >= least


def _leading(version: str) -> tuple[int, ...]:
    """Return the numbers that a version begins with, without zeros at their end: 2.0 and 2 are the same."""
    numbers = [int(one) for one in re.findall(r"\d+", re.match(r"[\d.]*", version)[0])]  # type: ignore[index]
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)


def _cache() -> dict[str, Any]:
    states: list[CacheState] = []
    for module, names in LOOPS.items():
        there = importlib.import_module(f"ferryid.{module}")
        states += [cache_state(getattr(there, name)) for name in names]
    folders = sorted({str(one.folder) for one in states if one.folder is not None})
    return {
        "folders": folders,
        "writable": bool(folders) and all(one.folder is not None and _writable(one.folder) for one in states),
        "functions": len(states),
        "compiled": sum(one.compiled for one in states),
    }


def _writable(folder: Path) -> bool:
    """Tell whether a file can be made in a folder, by making one: permissions alone do not tell of a full or locked disk."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _place(out: Path) -> dict[str, Any]:
    there = out.absolute()
    while not there.exists() and there != there.parent:
        there = there.parent
    usable = there.is_dir()
    return {
        "folder": str(out),
        "writable": usable and _writable(there),
        "free_gib": shutil.disk_usage(there).free / _GIB,
    }


def _memory_gib() -> float | None:
    """Return the memory of the machine; None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / _GIB
    except (AttributeError, ValueError, OSError):
        return None


def _problems(result: Mapping[str, Any]) -> Iterator[str]:
    for one in result["packages"]:
        if not one["enough"]:
            found = "it is missing" if one["version"] is None else f"found {one['version']}"
            yield f"{one['name']}{one['wanted']} is needed, {found}. Fix: pip install --upgrade '{one['name']}{one['wanted']}'"
    out = result["out"]
    if not out["writable"]:
        yield f"{out['folder']}: cannot be written. Fix: give --out another folder"
    elif out["free_gib"] * _GIB < LEAST_DISK:
        yield f"{out['folder']}: {out['free_gib']:.2f} GiB are free. Fix: free some, or give --out a folder on another disk"


def _notes(result: Mapping[str, Any]) -> Iterator[str]:
    cache = result["compile_cache"]
    if not cache["writable"]:
        yield (
            "compiled loops cannot be kept, and are compiled at every start, which takes 20 to 30 s. Fix: set NUMBA_CACHE_DIR "
            "to a folder that can be written"
        )
    elif cache["compiled"] < cache["functions"]:
        yield "the first simulate, fit or diagnose compiles its inner loops, which takes 20 to 30 s once"
    if not available():
        yield (
            "figures of reports cannot be zoomed, as uPlot, which draws them, is no part of this installation. Fix: make uplot "
            "in the sources of ferryid (it needs npm), then install them again"
        )
    if not result["packages"]:
        yield f"ferryid runs from its sources without being installed ({sys.executable}): its requirements are not known"
