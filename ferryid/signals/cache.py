"""Recordings kept as Parquet under ``out/logs``: found again while log, profile and ferryid are unchanged."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.files import remove_abandoned, replacing, resolved, write_text
from ferryid.ingest.checksum import crc32
from ferryid.ingest.clocks import ClockReport
from ferryid.ingest.log import Loss, Topic
from ferryid.ingest.many_rows import THREADS
from ferryid.side_by_side import over
from ferryid.signals.parquet import TIME_COLUMNS, read_table, table_checksum, unit_of, write_table
from ferryid.signals.stream import Recording, Stream
from ferryid.vessel.profile import Profile

SCHEMA = "ferryid.recording/1"
_NOTE = "recording.json"

Damage = dict[Path, str]
"""Folder of a recording that cannot be used to what is wrong with it."""


def folder_of(out: Path, name: str, sha256: str, profile_sha256: str) -> Path:
    """Folder of one recording: ``out/logs/<name>-<hash of the log>-<hash of the profile>``, with that of its ranges between."""
    content, _, ranges = sha256.partition("#")
    part = f"-{crc32(ranges.encode()):08x}" if ranges else ""
    return out / "logs" / f"{name}-{content.rpartition(':')[2][:8]}{part}-{profile_sha256[:8]}"


def signatures(paths: Sequence[Path]) -> list[list[Any]]:
    """Path, size, time of change and inode of every file, by which an unchanged file is recognised."""
    result: list[list[Any]] = []
    for path in paths:
        state = path.stat()
        result.append([str(resolved(path)), state.st_size, state.st_mtime_ns, state.st_ino])
    return result


def has_any(out: Path, name: str, profile: Profile) -> bool:
    """True where some recording of that name and profile is kept, perhaps of another content."""
    return next(_kept(out, name, profile, {}), None) is not None


def by_files(
    out: Path, name: str, paths: Sequence[Path], profile: Profile, damage: Damage, *, verify: bool
) -> Recording | None:
    """Return the kept recording of files that did not change since, without reading any of them; None if there is none.

    Recordings that are damaged count as none, and are added to `damage`.
    """
    remove_abandoned(out / "logs")
    try:
        now = signatures(paths)
    except OSError:
        return None  # whoever opens the log next says what is wrong with it
    for folder, note in _kept(out, name, profile, damage):
        if note["files"] == now and (note["verified"] or not verify):
            return _loaded(folder, paths, damage)
    return None


def by_content(
    out: Path, name: str, sha256: str, paths: Sequence[Path], profile: Profile, damage: Damage, *, verify: bool
) -> Recording | None:
    """Return the kept recording of files that were touched but hold the same bytes; None if there is none.

    Recordings that are damaged count as none, and are added to `damage`.
    """
    now = signatures(paths)
    for folder, note in _kept(out, name, profile, damage):
        same_paths = [one[0] for one in note["files"]] == [one[0] for one in now]
        if note["recording"]["sha256"] == sha256 and same_paths and (note["verified"] or not verify):
            kept = _loaded(folder, paths, damage)
            # Noted anew so that the next time nothing is hashed; a folder that cannot be written is merely slower.
            with contextlib.suppress(FerryIdError):
                write_text(folder / _NOTE, note_text({**note, "files": now}))
            return kept
    return None


def recordings(out: Path) -> dict[Path, dict[str, Any]]:
    """Return every folder under ``out/logs`` that holds a recording, with its note, whatever its profile and version.

    Raises
    ------
    FerryIdError
        For a note that is damaged.
    """
    found = {}
    for path in sorted((out / "logs").glob(f"*/{_NOTE}")):
        note, fault = _read_note(path.parent)
        if fault:
            raise FerryIdError(
                f"{path}: the description of a log in the cache is damaged, {fault}. "
                "Fix: delete its folder, the next ingest writes it again"
            )
        if note is not None:
            found[path.parent] = note
    return found


def note_text(note: Mapping[str, Any]) -> str:
    """Return the text of a recording.json, with the checksum of what the note says."""
    return json.dumps({**note, "checksum": _note_checksum(note)}, indent=1) + "\n"


def _note_checksum(note: Mapping[str, Any]) -> int:
    """CRC-32 of what a note says, however it is laid out."""
    said = {key: value for key, value in note.items() if key != "checksum"}
    return crc32(json.dumps(said, sort_keys=True).encode())


def _read_note(folder: Path) -> tuple[dict[str, Any] | None, str]:
    """Return the note of a folder, or None and what is wrong with it; nothing is wrong where there is none."""
    try:
        note = json.loads((folder / _NOTE).read_text(encoding="utf-8"))
    except OSError:
        return None, ""
    except ValueError:
        return None, "it is no JSON"
    if not _is_whole(note):
        return None, "a part of it is missing or wrong"
    # Older versions wrote none.
    if ("checksum" in note or note["version"] == __version__) and note.get("checksum") != _note_checksum(note):
        return None, "its checksum differs"
    return note, ""


def _is_whole(note: Any) -> bool:
    """Tell whether a note says what a recording is, so that its folder counts."""
    try:
        plain = note["recording"]
        texts = (note["version"], *(plain[key] for key in ("name", "sha256", "profile_name", "profile_sha256")))
        files = note["files"]
        return (
            note["schema"] == SCHEMA and all(isinstance(one, str) for one in texts) and all(len(f) == 4 for f in files)
        )
    except (KeyError, TypeError):
        return False


def _loaded(folder: Path, paths: Sequence[Path], damage: Damage) -> Recording | None:
    """A kept recording under the present spelling of its paths; None for a damaged one, which is then made anew."""
    try:
        return replace(load(folder), files=tuple(str(path) for path in paths))
    except FerryIdError as error:
        damage[folder] = str(error).removeprefix(f"{folder}/").partition(". Fix: ")[0]
        return None


def _kept(out: Path, name: str, profile: Profile, damage: Damage) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Folders of this name and profile that this version of ferryid wrote, with their notes."""
    for folder in sorted((out / "logs").glob(f"{_escaped(name)}-????????-{profile.sha256[:8]}")):
        note, fault = _read_note(folder)
        if fault:
            damage[folder] = f"{_NOTE}: {fault}"
        elif (
            note is not None
            and note["version"] == __version__
            and note["recording"]["profile_sha256"] == profile.sha256
        ):
            yield folder, note


def _escaped(name: str) -> str:
    return name.replace("[", "[[]")


def store(out: Path, recording: Recording, files: list[list[Any]], *, verify: bool) -> Path:
    """Write a recording to its folder: first under a temporary name, then renamed, so that it is whole or absent.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written or a disk that is full.
    """
    folder = folder_of(out, recording.name, recording.sha256, recording.profile_sha256)
    tables = {topic: f"{number:03d}{_file_part(topic)}.parquet" for number, topic in enumerate(recording.streams)}
    with replacing(folder) as draft:
        draft.mkdir()
        _write_streams(draft, recording, tables)
        note = {
            "schema": SCHEMA,
            "version": __version__,
            "verified": verify,
            "files": files,
            "tables": tables,
            "checksums": {name: table_checksum(draft / name) for name in tables.values()},
            "recording": _plain(recording),
        }
        (draft / _NOTE).write_text(note_text(note), encoding="utf-8")
    return folder


def _write_streams(draft: Path, recording: Recording, tables: Mapping[str, str]) -> None:
    origin = {
        "version": __version__,
        "log": recording.name,
        "log_sha256": recording.sha256,
        "profile": recording.profile_name,
        "profile_sha256": recording.profile_sha256,
    }

    def write(stream: Stream) -> None:
        columns: dict[str, Any] = {"time_ns": stream.time_ns}
        if stream.receive_ns is not stream.time_ns:
            columns["receive_ns"] = stream.receive_ns
        columns |= stream.columns
        metadata = {
            **origin,
            "topic": stream.topic,
            "units": {name: unit_of(name) for name in columns},
            "signals": {name: recording.found[name] for name in stream.columns if name in recording.found},
            "clock": stream.clock.to_dict(),
            "losses": [asdict(loss) for loss in recording.losses if loss.topic in (None, stream.topic)],
        }
        write_table(draft / tables[stream.topic], columns, metadata)

    # Largest first, so that two threads end together.
    ordered = sorted(recording.streams.values(), key=lambda one: -len(one.time_ns) * (2 + len(one.columns)))
    over(write, ordered, most=THREADS)


def load(folder: Path) -> Recording:
    """Read a recording that `store` wrote.

    Raises
    ------
    FerryIdError
        For a folder that is incomplete or damaged.
    """
    note, fault = _read_note(folder)
    if note is None:
        raise FerryIdError(
            f"{folder / _NOTE}: this describes no recording of ferryid, {fault or 'the file is not there'}. "
            "Fix: delete its folder, the next ingest writes it again"
        )
    try:
        return _recording(folder, note)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise FerryIdError(
            f"{folder / _NOTE}: a part of it is missing or wrong ({type(error).__name__}: {error}). "
            "Fix: delete its folder, the next ingest writes it again"
        ) from error


def _recording(folder: Path, note: Mapping[str, Any]) -> Recording:
    plain, checksums = note["recording"], note["checksums"]
    read = over(lambda name: read_table(folder / name, checksums[name]), note["tables"].values(), most=THREADS)
    tables = dict(zip(note["tables"], read, strict=True))
    streams = {}
    for topic, (columns, _) in tables.items():
        time_ns = columns["time_ns"]
        signals = {name: values for name, values in columns.items() if name not in TIME_COLUMNS}
        clock = ClockReport.from_dict(plain["clocks"][topic])
        streams[topic] = Stream(topic, time_ns, signals, clock, columns.get("receive_ns", time_ns))
    return Recording(
        name=plain["name"],
        files=tuple(plain["files"]),
        sha256=plain["sha256"],
        profile_name=plain["profile_name"],
        profile_sha256=plain["profile_sha256"],
        streams=streams,
        topics=tuple(Topic(**topic) for topic in plain["topics"]),
        losses=tuple(Loss(**loss) for loss in plain["losses"]),
        found=plain["found"],
        missing=plain["missing"],
        notes=tuple(plain["notes"]),
    )


def _plain(recording: Recording) -> dict[str, Any]:
    """Everything of a recording but its columns, for JSON."""
    return {
        "name": recording.name,
        "files": list(recording.files),
        "sha256": recording.sha256,
        "profile_name": recording.profile_name,
        "profile_sha256": recording.profile_sha256,
        "clocks": {topic: stream.clock.to_dict() for topic, stream in recording.streams.items()},
        "topics": [{**asdict(topic), "fields": dict(topic.fields)} for topic in recording.topics],
        "losses": [asdict(loss) for loss in recording.losses],
        "found": dict(recording.found),
        "missing": dict(recording.missing),
        "notes": list(recording.notes),
    }


def _file_part(topic: str) -> str:
    """The topic in a form that every file system takes."""
    return "".join(c if c.isalnum() else "_" for c in topic if c.isascii())[:80]
