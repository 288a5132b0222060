"""Runs that are done stay done: one line each, under what was drawn and the sources that it was run with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import ferryid
from tests.reach.draw import Draw
from tests.reach.run import run

CONCERNED = ("*.py", "diagnose", "effects", "identify", "ingest", "signals", "simulate", "vessel")
"""What of ferryid a diagnosis of a simulated log runs through; reports and commands do not change a line."""


def version() -> str:
    """Return a hash of the sources that a run depends on."""
    root = Path(ferryid.__file__).parent
    files = set(root.glob(CONCERNED[0]))
    for folder in CONCERNED[1:]:
        files |= {path for path in (root / folder).rglob("*") if path.suffix in (".py", ".toml")}
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def key_of(draw: Draw, of: str) -> str:
    """Return the name of a run: a hash of all that was drawn, and the version."""
    text = json.dumps(draw.as_json(), sort_keys=True)
    return f"{hashlib.sha256(text.encode()).hexdigest()[:16]}-{of}"


def done_before(path: Path) -> dict[str, dict[str, Any]]:
    """Return the lines of a file by their key; a line that broke off is left out."""
    lines = {}
    if path.exists():
        for text in path.read_text("utf-8").splitlines():
            try:
                line = json.loads(text)
            except json.JSONDecodeError:
                continue
            lines[line["key"]] = line
    return lines


def run_all(draws: Sequence[Draw], of: str, path: Path, processes: int) -> Iterator[dict[str, Any]]:
    """Yield the line of every draw, those done before first; each new one is written to the file as soon as it is done.

    Parameters
    ----------
    draws
        What to run.
    of
        From `version`.
    path
        JSON lines of this and earlier times.
    processes
        How many run at once; 1 runs in this process.
    """
    before = done_before(path)
    left = []
    for draw in draws:
        key = key_of(draw, of)
        if key in before:
            yield before[key]
        else:
            left.append((key, draw))
    if not left:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    # A line that broke off must not swallow the next one.
    cut = path.exists() and path.read_bytes()[-1:] not in (b"", b"\n")
    with path.open("a", encoding="utf-8") as file:
        file.write("\n" if cut else "")
        for line in _results(left, processes):
            file.write(json.dumps(line) + "\n")
            file.flush()
            yield line


def _results(work: Sequence[tuple[str, Draw]], processes: int) -> Iterator[dict[str, Any]]:
    if processes == 1:
        yield from map(_line, work)
        return
    # Fresh processes: numba's and BLAS's threads do not survive a fork.
    with get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(_line, work)


def _line(work: tuple[str, Draw]) -> dict[str, Any]:
    key, draw = work
    return {"key": key, "draw": draw.as_json(), **run(draw)}
