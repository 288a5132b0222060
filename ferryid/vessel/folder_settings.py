"""What a folder says of the logs in and below it: a profile ``vessel.toml``, or a ``ferryid.toml`` with defaults of options."""

from __future__ import annotations

import glob
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.cached import cached_property
from ferryid.errors import FerryIdError
from ferryid.files import existing_parts, exists
from ferryid.ingest.remote import copies_folder
from ferryid.vessel.toml_lines import KeyPath, key_lines, line_of, too_deep

VESSEL_FILE = "vessel.toml"
"""A profile beside logs, or in a folder above them."""
SETTINGS_FILE = "ferryid.toml"
"""Defaults for options beside logs, or in a folder above them."""
LARGEST_BYTES = 1 << 20


@dataclass(frozen=True)
class FolderSettings:
    """The content of a ``ferryid.toml``: options above its tables for every command, a table for one command.

    Attributes
    ----------
    path
        The file.
    text, data
        Its source and what it means.
    """

    path: Path
    text: str
    data: Mapping[str, Any]

    @property
    def vessel(self) -> str | None:
        """Name or path of the profile that it states; a path begins at the file.

        Raises
        ------
        FerryIdError
            Where it is not text.
        """
        value = self.data.get("vessel")
        if value is None:
            return None
        if not isinstance(value, str) or not value.strip():
            raise self.fault(("vessel",), f"vessel cannot be {value!r}. Fix: give a profile's name or a path in quotes")
        return self.placed(value)

    def placed(self, value: str) -> str:
        """Return a path as seen from here where it is one of a file beside the settings; anything else as it is."""
        beside = self.path.parent / value
        return str(beside) if value.strip() and beside.exists() else value

    def fault(self, key: KeyPath, what: str) -> FerryIdError:
        """Return an error that names file and line."""
        return FerryIdError(f"{self.path}:{line_of(self._lines, key)}: {what}")

    @cached_property
    def _lines(self) -> dict[KeyPath, int]:
        return key_lines(self.text)


def log_folder(log: str) -> Path:
    """Return the folder that the search for settings begins in: a log that is a folder itself, or else the one it is in.

    Parameters
    ----------
    log
        Path, parts of one recording joined by ``+``, or a pattern (``season/**/*.mcap``).
    """
    path = Path(log)
    try:
        if not exists(path):
            path = next(iter(existing_parts(log)), path)
            while glob.has_magic(str(path)) and not exists(path):
                path = path.parent
        # The name of a link counts, not what it leads to: settings lie beside what was named.
        path = Path(os.path.abspath(path))
        if path.is_relative_to(copies_folder()):
            # Nobody keeps settings beside the copy of a log that lies elsewhere.
            return Path.cwd()
        return path if path.is_dir() else path.parent
    except (OSError, ValueError):  # whoever opens the log says what is wrong with the path
        return Path.cwd()


def common_folder(logs: Sequence[str]) -> Path:
    """Return the deepest folder that holds all logs; the working folder where none is given."""
    folders = [log_folder(log) for log in logs]
    if not folders:
        return Path.cwd()
    try:
        return Path(os.path.commonpath(folders))
    except ValueError:  # on different drives
        return folders[0]


def settings_of(folder: Path) -> FolderSettings | None:
    """Return the nearest ``ferryid.toml`` in a folder or above it, None where there is none.

    Raises
    ------
    FerryIdError
        For a file that cannot be read, or is no TOML.
    """
    for above in _upwards(folder):
        if (above / SETTINGS_FILE).is_file():
            return _read(above / SETTINGS_FILE)
    return None


def stated_vessel(folder: Path) -> tuple[str, str] | None:
    """Return the profile that the nearest ``vessel.toml`` or ``ferryid.toml`` is or states, and the file that does.

    In one folder, what ``ferryid.toml`` states counts before a ``vessel.toml``.

    Raises
    ------
    FerryIdError
        For a ``ferryid.toml`` that cannot be read.
    """
    for above in _upwards(folder):
        settings, profile = above / SETTINGS_FILE, above / VESSEL_FILE
        if settings.is_file() and (vessel := _read(settings).vessel) is not None:
            return vessel, str(settings)
        if profile.is_file():
            return str(profile), str(profile)
    return None


def _upwards(folder: Path) -> Iterator[Path]:
    yield folder
    yield from folder.parents


def _read(path: Path) -> FolderSettings:
    try:
        with path.open("rb") as file:
            text = file.read(LARGEST_BYTES).decode("utf-8-sig")
        data = tomllib.loads(text)
    # A number of thousands of digits, or thousands of brackets, ends in errors of Python rather than of TOML.
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise FerryIdError(
            f"{path}: the defaults for options cannot be read, {reason}. Fix: correct the file, or remove it"
        ) from error
    if deep := too_deep(data):
        raise FerryIdError(f"{path}: {deep}")
    return FolderSettings(path, text, data)
