"""The recordings in which effects are concealed: a TOML file, or one log with its vessel."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import parts_of
from ferryid.validation.recorded.effects import concealments
from ferryid.validation.recorded.log import name_of_log

SCHEMA = "ferryid.recordings/1"
KEYS = ("name", "log", "campaign", "before", "vessel", "runs", "only")
LARGEST_BYTES = 1 << 20
MOST_RUNS = 1e3


@dataclass(frozen=True)
class Recording:
    """One recording, or several that are a campaign.

    Attributes
    ----------
    name
        For people, and of cases.
    logs
        Paths; parts of one recording joined by ``+``.
    vessel
        Name of a bundled profile, or path of a TOML file.
    runs
        Factor on the number of runs: fewer for a recording whose diagnosis takes long.
    only
        Effects that are concealed in it; every one if empty.
    before
        Paths of logs of the same vessel that stay as they are: what is concealed is to be found as what changed since.
    """

    name: str
    logs: tuple[str, ...]
    vessel: str
    runs: float = 1.0
    only: tuple[str, ...] = ()
    before: tuple[str, ...] = ()


def load_recordings(real: str, vessel: str | None) -> tuple[Recording, ...]:
    """Return the recordings of a manifest, or a log as the only one.

    Parameters
    ----------
    real
        A TOML file, else a log.
    vessel
        Profile of the log; None beside a manifest, which names its own.

    Raises
    ------
    FerryIdError
        For a manifest that cannot be used, and a log without a vessel.
    """
    path = Path(real)
    if path.suffix.lower() != ".toml":
        if vessel is None:
            raise FerryIdError(
                f"{real}: where its signals are is not known, found neither a manifest (.toml) nor --vessel. "
                "Fix: give --vessel with the profile of this log"
            )
        if not all(Path(part).exists() for part in parts_of(real)):
            raise FerryIdError(f"{real}: there is no such log or manifest. Fix: correct the path after --real")
        return (Recording(Path(name_of_log(real)).stem, (real,), vessel),)
    if vessel is not None:
        raise FerryIdError(
            f"{real}: a manifest names its vessels, found --vessel {vessel} too. Fix: leave --vessel out"
        )
    return _read(path)


def fingerprint(recordings: Sequence[Recording]) -> str:
    """Return a hash of names, vessels, and names and sizes of files: what tells one set of recordings from another."""
    digest = sha256()
    for one in recordings:
        digest.update(repr((one.name, one.vessel, one.runs, one.only, len(one.before))).encode())
        for log in (*one.logs, *one.before):
            for part in parts_of(log):
                root = Path(part)
                files = sorted(path for path in root.rglob("*") if path.is_file()) if root.is_dir() else [root]
                for file in files:
                    digest.update(repr((file.name, file.stat().st_size if file.exists() else -1)).encode())
    return digest.hexdigest()[:16]


def _read(path: Path) -> tuple[Recording, ...]:
    try:
        with path.open("rb") as file:
            data = tomllib.loads(file.read(LARGEST_BYTES).decode("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise FerryIdError(
            f"{path}: cannot be read as a list of recordings, {reason}. Fix: give a TOML file"
        ) from error
    if data.get("schema") != SCHEMA:
        raise FerryIdError(
            f'{path}: needs schema = "{SCHEMA}", found {data.get("schema")!r}. Fix: begin the file with it'
        )
    entries = data.get("recording")
    if not isinstance(entries, list) or not entries or not all(isinstance(one, dict) for one in entries):
        raise FerryIdError(f"{path}: names no recording. Fix: add a table [[recording]] with log and vessel")
    found = [_entry(path, number, one) for number, one in enumerate(entries, 1)]
    names = [one.name for one in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise FerryIdError(f'{path}: two recordings are called "{twice}". Fix: give each a name of its own')
    return tuple(found)


def _entry(path: Path, number: int, entry: Mapping[str, Any]) -> Recording:
    where = f"{path}: recording {number}"
    for key in entry:
        if key not in KEYS:
            raise FerryIdError(f'{where}: there is no key "{key}".{did_you_mean(key, KEYS)} Fix: use {", ".join(KEYS)}')
    logs = entry.get("campaign", entry.get("log"))
    if isinstance(logs, str):
        logs = [logs]
    if ("log" in entry) == ("campaign" in entry) or not _texts(logs):
        raise FerryIdError(f'{where}: needs either log = "..." or campaign = ["...", ...]. Fix: give one of the two')
    before = entry.get("before", [])
    if not _texts(before) and before != []:
        raise FerryIdError(f"{where}: before is a list of logs, found {before!r}. Fix: name logs, or leave it out")
    vessel = entry.get("vessel")
    if not isinstance(vessel, str) or not vessel:
        raise FerryIdError(f"{where}: needs vessel, found {vessel!r}. Fix: name a bundled profile or a TOML file")
    name = entry.get("name", Path(name_of_log(logs[0])).stem)
    if not isinstance(name, str) or not name:
        raise FerryIdError(f'{where}: "name" is text, found {name!r}. Fix: write it in quotes')
    runs = entry.get("runs", 1.0)
    if isinstance(runs, bool) or not isinstance(runs, int | float) or not 0.0 < runs < MOST_RUNS:
        raise FerryIdError(
            f"{where}: runs is a factor above 0, found {runs!r}. Fix: give one such as 0.4, or leave it out"
        )
    only = entry.get("only", [])
    if not _texts(only) and only != []:
        raise FerryIdError(f"{where}: only is a list of effects, found {only!r}. Fix: name effects, or leave it out")
    for effect in only:
        if effect not in concealments():
            raise FerryIdError(
                f'{where}: only names "{effect}", which is no effect that can be concealed.'
                f"{did_you_mean(effect, concealments())} Fix: give some of {', '.join(concealments())}"
            )
    beside = path.parent
    placed, earlier = (
        tuple("+".join(str(beside / part) for part in log.split("+")) for log in some) for some in (logs, before)
    )
    profile = str(beside / vessel) if vessel.endswith(".toml") else vessel
    return Recording(name, placed, profile, float(runs), tuple(only), earlier)


def _texts(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, str) and one for one in value)
