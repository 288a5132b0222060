"""The folder of a run: which draw it holds, and when all has to begin from the start."""

from __future__ import annotations

import hmac
import json
import secrets
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.files import dump_json, remove_abandoned, write_text
from ferryid.json_record import Record
from ferryid.validation.commitment import ANSWERS_FILE, SEAL_FILE, commitment
from ferryid.validation.source_hash import source_hash

SALT_BYTES = 32
RUN_FILE, RESULT_FILE = "run.json", "result.json"
PAGES = ("proof", "proof-real")
"""Names of folders of runs, of their pages and of the folders of their figures."""
FILES = (
    *(RUN_FILE, SEAL_FILE, ANSWERS_FILE, RESULT_FILE, *(f"{name}.md" for name in PAGES)),
    *("lines", "logs", "models", "transfer", "scratch", *PAGES),
)
"""All that a run writes into its folder, and all that is removed where it begins from the start."""
FORMER_FILE = "answers.sealed"
"""Encrypted answers of earlier versions of ferryid."""


@dataclass(frozen=True)
class RunRecord(Record):
    """Content of ``run.json``: salt, hash of seed and settings, and hash of the sources."""

    salt: str
    request: str
    sources: str


@dataclass(frozen=True)
class RunFolder:
    """A run's folder.

    Attributes
    ----------
    path
        Absolute path.
    salt
        Of its commitment [hexadecimal].
    sources
        Hash of the sources that it is made with.
    """

    path: Path
    salt: str
    sources: str

    def lines(self, stage: str) -> Path:
        """Return the checkpoint file of a stage."""
        return self.path / "lines" / f"{stage}.jsonl"


def open_run_folder(path: Path, seed: int, settings: Mapping[str, Any], announce: Callable[[str], None]) -> RunFolder:
    """Return the folder of a run, emptied where it holds another one that is finished, or was made with other sources.

    Parameters
    ----------
    path
        Absolute path.
    seed
        Of the draw. It is not written down before the answers are published; whether it is that of the folder can be checked
        by whoever knows it.
    settings
        What else decides which cases there are.
    announce
        Called with what becomes of an earlier run.

    Raises
    ------
    FerryIdError
        Where another run is not finished, where an earlier version of ferryid made it, and where the files are of no run.
    """
    sources, found = source_hash(), _read_run(path)
    if found is None:
        return _new(path, seed, settings, sources)
    if found.sources != sources:
        announce("the sources of ferryid have changed since this folder's run began: it begins from the start")
        _clear(path)
    elif not hmac.compare_digest(_request(seed, settings, found.salt), found.request):
        if not (path / RESULT_FILE).exists():
            raise FerryIdError(
                f"{path}: holds an unfinished run of another seed, --runs or --only. "
                "Fix: go on with those that it was begun with, or choose another --out"
            )
        announce("this folder's run, of another seed, --runs or --only, is finished: another begins in its place")
        _clear(path)
    else:
        announce("completed cases of this folder's run are kept")
        remove_temporary(path)
        return RunFolder(path, found.salt, sources)
    return _new(path, seed, settings, sources)


def remove_temporary(path: Path) -> None:
    """Remove what is left half-done, and what is no longer needed."""
    shutil.rmtree(path / "scratch", ignore_errors=True)
    shutil.rmtree(path / "transfer", ignore_errors=True)
    remove_abandoned(path / "logs")


def _new(path: Path, seed: int, settings: Mapping[str, Any], sources: str) -> RunFolder:
    salt = secrets.token_hex(SALT_BYTES)
    run = RunRecord(salt, _request(seed, settings, salt), sources)
    write_text(path / RUN_FILE, dump_json(run.to_json()))
    return RunFolder(path, salt, sources)


def _request(seed: int, settings: Mapping[str, Any], salt: str) -> str:
    """Return a hash by which seed and settings are recognised."""
    return commitment({"seed": seed, **settings}, salt)


def _read_run(path: Path) -> RunRecord | None:
    """Return what ``run.json`` holds; None in a folder without any file of a run."""
    if (path / FORMER_FILE).exists():
        raise FerryIdError(
            f"{path}: holds a run of an earlier version of ferryid ({FORMER_FILE}), which this one cannot continue. "
            "Fix: remove or move the folder, or choose another --out"
        )
    try:
        return RunRecord.from_json(json.loads((path / RUN_FILE).read_text("utf-8")))
    except (OSError, ValueError):
        pass
    present = [name for name in FILES if (path / name).exists()]
    if present:
        raise FerryIdError(
            f"{path}: holds {present[0]}, but no {RUN_FILE} of a run that can be continued: other work, or an earlier "
            "version of ferryid. Fix: remove or move the folder, or choose another --out"
        )
    return None


def _clear(path: Path) -> None:
    for name in FILES:
        place = path / name
        if place.is_dir() and not place.is_symlink():
            shutil.rmtree(place)
        else:
            place.unlink(missing_ok=True)
