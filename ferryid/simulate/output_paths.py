"""Where a simulated trial is written: nothing is replaced unasked, and nothing that is not of the same kind."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import check_result, resolved, taken, unwritable
from ferryid.ingest import log_suffixes
from ferryid.ingest.formats.rosbag2 import NAME

STORAGES = ("sqlite3", "mcap")
STARTS = {".mcap": b"\x89MCAP0\r\n", ".bag": b"#ROSBAG V"}
"""The suffixes of logs that are one file, and how these begin."""
PARQUET = b"PAR1"
LONGEST_NAME = 200
"""Longest name in bytes; while it is written, a file has a longer one, and 255 is the most that file systems take."""


def log_path(scenario: str, out: Path, log: Path | None) -> Path:
    """Return the path of a trial's log: `log`, or else an MCAP file in the folder `out`, named after the scenario.

    Raises
    ------
    FerryIdError
        When `out` is named like a log.
    """
    if out.name.endswith(log_suffixes()) and not out.is_dir():
        raise FerryIdError(f"--out: is the folder for results, found the name of a log, {out}. Fix: use --log {out}")
    return log or out / f"{scenario}.mcap"


def check_output(
    out: Path,
    truth: Path | None = None,
    *,
    storage: str = "sqlite3",
    overwrite: bool = False,
    json: Path | None = None,
    inputs: Iterable[Path] = (),
) -> None:
    """Refuse names and places that cannot or must not be written to.

    Parameters
    ----------
    out, truth, storage, overwrite
        As for `ferryid.simulate.write_log`.
    json
        File for the result, None for no such file.
    inputs
        Files that are read, none of which is ever replaced.

    Raises
    ------
    FerryIdError
        For the first place or name that will not do.
    """
    if storage not in STORAGES:
        raise FerryIdError(
            f'{out}: storage of a ROS2 folder cannot be "{storage}".{did_you_mean(storage, STORAGES)} '
            f"Fix: use one of {', '.join(STORAGES)}"
        )
    suffix = out.suffix.lower()
    if suffix not in ("", *STARTS):
        raise FerryIdError(
            f'{out}: the suffix says which format to write, found "{suffix}". '
            "Fix: end the name in .mcap, .bag (ROS1), or nothing for a ROS2 folder"
        )
    places = {"log": out, "truth": truth, "--json": json}
    asked = {what: path for what, path in places.items() if path is not None}
    try:
        _check_apart(asked, list(inputs))
        for path in asked.values():
            _check_writable(path)
        _check_free(out, STARTS.get(suffix), overwrite=overwrite)
        if truth is not None:
            _check_free(truth, PARQUET, overwrite=overwrite)
    except OSError as error:
        raise unwritable(Path(error.filename or out), error) from error
    if json is not None:
        check_result(json)


def _check_apart(asked: dict[str, Path], inputs: list[Path]) -> None:
    """Refuse two outputs in one place, one inside the other, and an output in the place of an input."""
    places = list(asked.items())
    for index, (what, path) in enumerate(places):
        here = resolved(path)
        for other, another in places[:index]:
            there = resolved(another)
            if here == there:
                raise FerryIdError(f"{path}: {other} and {what} cannot be the same file. Fix: give one another name")
            if here.is_relative_to(there) or there.is_relative_to(here):
                raise FerryIdError(f"{path}: {other} and {what} cannot lie in each other. Fix: give one another name")
        for one in inputs:
            if resolved(one).is_relative_to(here) or (path.exists() and one.exists() and one.samefile(path)):
                raise FerryIdError(
                    f"{path}: the {what.removeprefix('--')} cannot take the place of what it is made from, {one}. "
                    "Fix: give it another name"
                )


def _check_writable(path: Path) -> None:
    """Refuse a place in which no file can be made; missing folders are made later."""
    if len(os.fsencode(path.name)) > LONGEST_NAME:
        raise FerryIdError(f"{path}: the name is longer than {LONGEST_NAME} bytes. Fix: give a shorter one")
    folder = next((parent for parent in path.absolute().parents if os.path.lexists(parent)), Path("/"))
    if not folder.is_dir():
        raise FerryIdError(f"{path}: cannot be written, {folder} is no folder. Fix: choose another place")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FerryIdError(f"{path}: cannot be written, {folder} is closed. Fix: choose a folder you may write to")


def _check_free(path: Path, start: bytes | None, *, overwrite: bool) -> None:
    """Refuse to replace anything unasked, and anything else than a file that begins so, or a recording's folder."""
    if not os.path.lexists(path):
        return
    if not overwrite:
        raise taken(path)
    found = ""
    if path.is_dir():
        found = "a folder" if start else "" if _is_recording(path) else "a folder that is no ROS2 recording alone"
    elif start is None or not path.is_file():
        found = "a file" if path.exists() else "a link that leads nowhere"
    else:
        with path.open("rb") as file:
            begins = file.read(len(start))
        found = "" if begins in (start, b"") else "a file of another kind"
    if found:
        raise FerryIdError(f"{path}: cannot be replaced, found {found}. Fix: choose another name")


def _is_recording(folder: Path) -> bool:
    """Tell whether a folder is a recording, and holds nothing but what its metadata.yaml lists."""
    if not (folder / NAME).is_file():
        return False
    from ferryid.ingest.rosbag2_metadata import read_metadata

    stated = read_metadata(folder / NAME)
    if isinstance(stated, str):
        return False
    listed = {NAME, *(file.name for file in stated.files)}
    return all(entry.name in listed and entry.is_file() for entry in folder.iterdir())
