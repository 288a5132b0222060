"""Results that are kept: a folder for each log, which counts from the moment on that its row lies in it.

Whatever kills a process leaves a folder without a row: the log is done again, and what half-done results there are is removed.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from ferryid.batch.log_result import LogFile, LogResult
from ferryid.cached import cached_property
from ferryid.files import dump_json, remove_abandoned, sync, unwritable, write_text

ROW = "row.json"
CHECK = "check"
"""Hash of the rest of a row: one that was altered or damaged counts as none."""


def read_row(folder: Path) -> LogResult | None:
    """Return the row of a folder; None where the log is not done."""
    try:
        row = json.loads((folder / ROW).read_text(encoding="utf-8"))
        return LogResult.from_json(row) if row.pop(CHECK) == _check(row) else None
    except (OSError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        return None


def _check(row: dict[str, Any]) -> str:
    return sha256(dump_json(row).encode()).hexdigest()


def write_row(folder: Path, row: LogResult) -> None:
    """Make the results in a folder count; all of them are on disk already, so that no loss of power can part them.

    Raises
    ------
    UnwritableError
        Where the disk is full.
    """
    plain = row.to_json()
    write_text(folder / ROW, dump_json({**plain, CHECK: _check(plain)}))


def clear(folder: Path) -> None:
    """Remove the results in a folder, its row first: what was begun to be removed does not count any more."""
    try:
        (folder / ROW).unlink(missing_ok=True)
        sync(folder)
        for path in folder.iterdir():
            # The lock is held by whoever calls this.
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            elif path.name != ".lock":
                path.unlink()
    except OSError as error:
        raise unwritable(folder, error) from error


def key_of(paths: Sequence[Path], stamp: Mapping[str, str]) -> str:
    """Return what names the results of a log in its place, made in one way."""
    text = json.dumps([list(map(str, paths)), dict(sorted(stamp.items()))])
    return sha256(text.encode()).hexdigest()[:12]


class Kept:
    """The rows of all folders.

    Parameters
    ----------
    results
        Folder of the folders.
    """

    def __init__(self, results: Path) -> None:
        found = [(path, read_row(path)) for path in sorted(results.glob("*")) if path.is_dir()]
        for path, _ in found:
            remove_abandoned(path)
        self._rows = {folder: row for folder, row in found if row is not None}
        self._folders: dict[tuple[LogFile, ...], list[Path]] = {}
        for folder, row in self._rows.items():
            self._folders.setdefault(row.files, []).append(folder)

    def of(
        self, folder: Path, files: tuple[LogFile, ...], stamp: Mapping[str, str], content: Callable[[], str | None]
    ) -> tuple[Path, LogResult] | None:
        """Return folder and row of a log that is done, or None.

        A log counts as done while path, size and time of change of its files are those of the row; or else while its content
        is, also under another path if nothing is left under the former.

        Parameters
        ----------
        folder
            Where its results go.
        files
            As `ferryid.batch.logs.Entry.files` has them.
        stamp
            What else they depend on.
        content
            Returns the log's hash, None where it cannot be read.
        """
        # Of a log that is not there, nothing but the place is known.
        same = self._folders.get(files, []) if files else [folder]
        for one in same:
            row = self._rows.get(one)
            if row is not None and row.stamp == stamp and row.files == files:
                return one, row
        alike = [*([folder] if folder in self._rows else []), *self._gone]
        alike = [one for one in alike if _alike(self._rows[one], files, stamp)]
        found = content() if alike else None
        for one in alike:
            if self._rows[one].sha256 == found:
                # Noted anew, so that the next time nothing is hashed.
                self._rows[one] = replace(self._rows[one], files=files)
                self._gone.discard(one)
                write_row(one, self._rows[one])
                return one, self._rows[one]
        return None

    @cached_property
    def _gone(self) -> set[Path]:
        """Folders of logs that are not any more where they were."""
        return {
            folder
            for folder, row in self._rows.items()
            if row.files and not any(os.path.exists(file.path) for file in row.files)
        }

    def differing(self, files: tuple[LogFile, ...], stamp: Mapping[str, str]) -> set[str]:
        """Return in what earlier results of the same files differ from those that are asked for; empty where there are none."""
        others = [self._rows[one].stamp for one in self._folders.get(files, [])] if files else []
        if not others or stamp in others:
            return set()
        nearest = min(others, key=lambda other: sum(other.get(name) != value for name, value in stamp.items()))
        return {name for name, value in stamp.items() if nearest.get(name) != value}


def _alike(row: LogResult, files: tuple[LogFile, ...], stamp: Mapping[str, str]) -> bool:
    """Return whether a row may be of a log, so that it is worth hashing."""
    sizes, others = (sorted(file.size_bytes for file in every) for every in (files, row.files))
    return bool(files) and row.stamp == stamp and bool(row.sha256) and sizes == others
