"""Which logs an archive holds: the folders under ``out/logs`` whose sums add up, and none that would judge itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ferryid import __version__
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.signals import cache
from ferryid.signals.recording import log_name
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class _Ingested:
    """A log as it was ingested: name, folder of its tables, and files with their times of change [ns]."""

    name: str
    folder: Path
    files: Mapping[str, int]

    @property
    def newest_ns(self) -> int:
        """Time of change of the file that changed last [ns]."""
        return max(self.files.values(), default=0)


def archived_folders(out: Path, profile: Profile, names: Sequence[str] = ()) -> list[Path]:
    """Return the folders of the logs that were ingested with a profile, each log once.

    Parameters
    ----------
    out
        Output folder.
    profile
        The vessel.
    names
        Names or paths of the logs to take; all where none is given.

    Raises
    ------
    FerryIdError
        Where there is none; for a log of the same vessel that was ingested with another profile or version of ferryid; for
        a name that is not there; for two that were read from the same file.
    """
    fitting: dict[str, _Ingested] = {}
    differing: dict[str, tuple[_Ingested, str]] = {}
    for folder, note in cache.recordings(out).items():
        plain = note["recording"]
        one = _Ingested(plain["name"], folder, {file[0]: file[2] for file in note["files"]})
        if plain["profile_sha256"] == profile.sha256 and note["version"] == __version__:
            fitting.setdefault(plain["sha256"], one)
        elif plain["profile_name"] == profile.name:
            by = "another profile" if plain["profile_sha256"] != profile.sha256 else f"ferryid {note['version']}"
            differing[plain["sha256"]] = one, by
    if names:
        wanted = {log_name(name) for name in names}
        known = {one.name for one in (*fitting.values(), *(one for one, _ in differing.values()))}
        for name in sorted(wanted - known):
            raise FerryIdError(
                f"{name}: not among the logs that were ingested to {out}.{did_you_mean(name, known)} "
                f"Fix: ferryid ingest it with --vessel {profile.name} --out {out} first"
            )
        fitting = {key: one for key, one in fitting.items() if one.name in wanted}
        differing = {key: (one, by) for key, (one, by) in differing.items() if one.name in wanted}
    left = [(one, by) for key, (one, by) in differing.items() if key not in fitting]
    if left:
        first, by = left[0]
        more = f" (and {len(left) - 1} more)" if len(left) > 1 else ""
        raise FerryIdError(
            f"{first.name}{more}: ingested with {by} than {profile.name} as it is now, so that its sums would not add up with "
            f"the others'. Fix: ingest it again with --vessel {profile.name} --out {out}, name the logs to take, or remove "
            f"{first.folder}"
        )
    if not fitting:
        raise FerryIdError(
            f"{out / 'logs'}: no log was ingested there with the profile {profile.name}. "
            f"Fix: ferryid ingest LOG... --vessel {profile.name} --out {out} first"
        )
    chosen = sorted(fitting.values(), key=lambda one: (one.name, one.folder))
    _refuse_shared(chosen)
    return [one.folder for one in chosen]


def refuse_other_basis(first: tuple[str, str], log: tuple[str, str]) -> None:
    """Refuse a log whose basis is not that of the first; each is given as name and basis."""
    if log[1] != first[1]:
        raise FerryIdError(
            f"{log[0]}: its basis is {log[1]}, as its measurements allow, that of {first[0]} {first[1]}: they do "
            "not add up. Fix: fit them apart, naming the logs of one kind"
        )


def _refuse_shared(logs: Sequence[_Ingested]) -> None:
    """Refuse two logs that were read from one file: rows of both would train and validate at once."""
    by_file: dict[str, _Ingested] = {}
    for one in logs:
        for file in one.files:
            other = by_file.setdefault(file, one)
            if other is not one:
                older, newer = sorted((one, other), key=lambda log: log.newest_ns)
                how = "changed in between" if one.files.keys() == other.files.keys() else "is part of both"
                raise FerryIdError(
                    f"{older.folder}: read from {file}, as {newer.folder} was, which {how}, so that the same rows may train "
                    "and validate. Fix: remove the folder that is not to count"
                )
