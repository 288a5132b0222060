"""Folders of ROS2 recordings: a metadata.yaml, and SQLite or MCAP files that are one log together."""

from __future__ import annotations

import mmap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import remove_scratch, scratch_folder
from ferryid.ingest.formats.mcap import SUFFIX as MCAP
from ferryid.ingest.formats.rosbag2 import NAME
from ferryid.ingest.formats.sqlite3_bag import SUFFIX as SQLITE
from ferryid.ingest.formats.sqlite3_bag import matches as is_sqlite
from ferryid.ingest.join import join
from ferryid.ingest.log import Loss, Reader, Series, Topic
from ferryid.ingest.mcap_reader import McapLog
from ferryid.ingest.message_compression import UnpackingDecoder
from ferryid.ingest.rosbag2_metadata import File, Metadata, read_metadata
from ferryid.ingest.sqlite3_reader import Sqlite3Log, Storage, refuse_foreign
from ferryid.ingest.unpack import FORMATS, message_unpacker, unpack_file

ENDINGS = tuple(end + packed for end in (SQLITE, MCAP) for packed in ("", *FORMATS.values()))


class FolderLog:
    """Reader of a recording's folder: its files joined, and held against what its metadata.yaml states.

    Parameters
    ----------
    folder
        Folder with a metadata.yaml.

    Raises
    ------
    FerryIdError
        None of the recording's files is there or can be read, or none of its topics can be decoded.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        stated = read_metadata(folder / NAME)
        losses: list[Loss] = []
        if isinstance(stated, str):
            losses.append(Loss(str(folder / NAME), f"the file {stated}; the recording was read without it", messages=0))
            stated = Metadata((), (), {}, "", "", "")
        if stated.mode and stated.codec not in FORMATS:
            raise FerryIdError(
                f"{folder}: compressed per {stated.mode} in a format that cannot be read, found {stated.codec!r}, "
                f"supported are {' and '.join(FORMATS)}. Fix: convert it with ros2 bag convert"
            )
        self._stated = stated
        files, missing = self._files()
        losses += missing
        parts: list[Reader] = []
        for path, about in files:
            try:
                parts.append(self._open(path, about))
            except FerryIdError as error:
                if len(files) == 1:
                    raise
                losses.append(_loss(path, about, f"the file cannot be read: {_cause(error, path)}"))
        if not parts:
            raise FerryIdError(
                f"{folder}: none of the recording's {counted(len(files), 'file')} can be read; {losses[-1].file}: "
                f"{losses[-1].what}. Fix: copy the folder from the recorder again"
            )
        self._joined = join(parts)
        self.paths: tuple[Path, ...] = (*self._joined.paths, folder / NAME)
        self._opening = tuple(losses)
        self._only_stated = tuple(self._uncounted())
        self.losses: tuple[Loss, ...] = (*self._opening, *self._joined.losses, *self._only_stated)
        self.topics: tuple[Topic, ...] = self._described()
        refuse_foreign(folder, self.topics)

    def _files(self) -> tuple[list[tuple[Path, File]], list[Loss]]:
        """Return the files to read, and what is missing or left out."""
        there = {
            file.name: file for file in sorted(self._folder.iterdir()) if file.name.endswith(ENDINGS) and file.is_file()
        }
        found: list[tuple[Path, File]] = []
        losses: list[Loss] = []
        for about in self._stated.files:
            # A file may have been packed or unpacked by hand since.
            bare = about.name.removesuffix(".zstd").removesuffix(".lz4")
            name = next((n for n in (about.name, bare, bare + ".zstd", bare + ".lz4") if n in there), None)
            if name is None:
                what = "the file is named in metadata.yaml but is not in the folder"
                losses.append(_loss(self._folder / about.name, about, what))
            else:
                found.append((there.pop(name), about))
        if found:
            losses += [
                Loss(
                    str(path),
                    "the file is not named in metadata.yaml and was not read; without a metadata.yaml it would be",
                )
                for path in there.values()
            ]
        elif there:
            # Renamed since, or of another recording: what metadata.yaml counts is compared in the end.
            found = [(path, File(path.name, None, None, None)) for path in there.values()]
            names = ", ".join(sorted(path.name for path in there.values())[:3])
            losses = [
                replace(
                    loss, what=f"{loss.what}; {names} there was read instead", messages=0, start_ns=None, end_ns=None
                )
                for loss in losses
            ]
        if not found:
            names = ", ".join(about.name for about in self._stated.files) or "none"
            raise FerryIdError(
                f"{self._folder}: the folder holds no recording, metadata.yaml names: {names}. "
                "Fix: copy its .db3 or .mcap files from the recorder too"
            )
        return found, losses

    def _open(self, path: Path, about: File) -> Reader:
        if path.stat().st_size == 0:
            raise FerryIdError(f"{path}: the file is empty, a recording was expected. Fix: copy it again")
        codec = self._stated.codec if self._stated.mode == "message" else ""
        with path.open("rb") as file:
            head = file.read(64)
        if is_sqlite(path, head):
            return Sqlite3Log(
                path,
                Storage(
                    codec=codec,
                    distro=self._stated.distro,
                    digests=self._stated.digests,
                    encodings={topic.name: topic.encoding for topic in self._stated.topics},
                    messages=about.messages,
                    end_ns=about.end_ns,
                ),
            )
        if path.suffix not in FORMATS.values():
            return _McapLog(path, None, codec)
        folder = scratch_folder()
        try:
            unpacked, losses = unpack_file(path, folder)
            with unpacked.open("rb") as file:
                # The mapping keeps the bytes after the file's name is gone.
                content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        finally:
            remove_scratch(folder)
        return _McapLog(path, content, codec, losses)

    def _described(self) -> tuple[Topic, ...]:
        """Hold the topics found against those stated."""
        stated = {topic.name: topic for topic in self._stated.topics}
        topics = []
        for topic in self._joined.topics:
            about = stated.pop(topic.name, None)
            notes = [topic.note] if topic.note else []
            if about is not None and about.count < topic.count:
                notes.append(f"metadata.yaml counts {counted(about.count, 'message')}, the files hold {topic.count}")
            if about is not None and about.type != topic.type:
                notes.append(f"metadata.yaml gives the type {about.type}")
            topics.append(replace(topic, note="; ".join(notes)))
        # A topic without messages need not be in the files at all.
        return (
            *topics,
            *(replace(about, count=0, note="only in metadata.yaml") for about in stated.values()),
        )

    def _uncounted(self) -> Iterator[Loss]:
        """Report the messages that only metadata.yaml knows of."""
        losses = [*self._opening, *self._joined.losses]
        if any(loss.messages is None for loss in losses):
            return
        held = {topic.name: topic.count for topic in self._joined.topics}
        short = {
            topic.name: topic.count - held.get(topic.name, 0)
            for topic in self._stated.topics
            if topic.count > held.get(topic.name, 0)
        }
        # What a damaged or missing file took with it is reported already, though not topic by topic, and a topic may
        # have another name here and there.
        stated = sum(topic.count for topic in self._stated.topics)
        reported = sum(loss.messages or 0 for loss in losses)
        rest = min(sum(short.values()), stated - sum(held.values())) - reported
        where, what = str(self._folder / NAME), "the file counts more messages than the recording holds"
        if rest == sum(short.values()):
            for topic, count in short.items():
                yield Loss(where, what, topic, count)
        elif rest > 0:
            yield Loss(where, what, messages=rest)

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics in every file.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have, or a topic that cannot be decoded.
        """
        series = self._joined.read(wanted, verify=verify)
        self.losses = (*self._opening, *self._joined.losses, *self._only_stated)
        return series


class _McapLog(McapLog):
    """An MCAP file of a folder, whose messages may be compressed one by one."""

    def __init__(self, path: Path, content: Any, codec: str, losses: tuple[Loss, ...] = ()) -> None:
        super().__init__(path, content)
        self._codec = codec
        self._opening = (*losses, *self._opening)
        self.losses = self._opening

    def _groups(self, wanted: Mapping[str, Sequence[str]]) -> Any:
        groups, losses = super()._groups(wanted)
        if self._codec:
            unpack = message_unpacker(self._codec)
            groups = [replace(group, decoder=UnpackingDecoder(group.decoder, unpack)) for group in groups]
        return groups, losses


def _loss(path: Path, about: File, what: str) -> Loss:
    return Loss(str(path), what, None, about.messages, about.start_ns, about.end_ns)


def _cause(error: FerryIdError, path: Path) -> str:
    """Return the middle of an error line, which in a loss comes after the file and needs no remedy."""
    return str(error).removeprefix(f"{path}: ").partition(" Fix: ")[0].rstrip(".")
