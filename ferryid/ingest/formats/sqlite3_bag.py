"""SQLite files of rosbag2 (.db3, also .db3.zstd and .db3.lz4)."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.bulk import Decoder, decoder_for
from ferryid.ingest.log import Format, Loss, Series, TableLayout, Topic
from ferryid.ingest.ros2_types import Definition, RecordedText, define, normalized
from ferryid.ingest.sqlite_pages import (
    LAST_ROWID,
    MAGIC,
    Damage,
    Pages,
    Rows,
    find_rows,
    read_runs,
)
from ferryid.ingest.unpack import FORMATS, message_unpacker, unpack_file, unpacked_batches, working_folder

DECODABLE = frozenset({"cdr", "ros1", "protobuf", "json"})
MESSAGE_COLUMNS = ["id", "topic_id", "timestamp", "data"]


@dataclass(frozen=True)
class Storage:
    """What the metadata.yaml of a folder knows about one of its SQLite files.

    Attributes
    ----------
    codec
        Compression of every single message: ``"zstd"``, ``"lz4"``, or an empty string.
    distro
        ROS distribution that recorded, or an empty string.
    digests, encodings
        Topic name to type hash and to serialisation; the latter counts more than the file's own word for it.
    messages, end_ns
        Number of messages and time of the last [ns], None where they are not stated.
    """

    codec: str = ""
    distro: str = ""
    digests: Mapping[str, str] = field(default_factory=dict)
    encodings: Mapping[str, str] = field(default_factory=dict)
    messages: int | None = None
    end_ns: int | None = None


@dataclass(frozen=True)
class Recorded:
    """The tables beside the messages: topics as (id, name, type, serialisation, type hash) and definitions."""

    root: int
    topics: tuple[tuple[int, str, str, str, str], ...]
    definitions: Mapping[str, RecordedText]
    distro: str


class Sqlite3Log:
    """Reader of one SQLite file; nothing is ever written beside it.

    Parameters
    ----------
    path
        The file, compressed as a whole or not.
    storage
        What the folder's metadata says about it.

    Raises
    ------
    FerryIdError
        Not a database of rosbag2, or one whose lists of tables and topics are damaged.
    """

    def __init__(self, path: Path, storage: Storage | None = None) -> None:
        self.paths: tuple[Path, ...] = (path,)
        self._storage = storage or Storage()
        self._file, losses = self._settled(path)
        self._ids: dict[str, list[int]] = {}
        with Pages(self._file) as pages:
            cut = f"the file ends after {pages.bytes} bytes of {pages.stated}" if pages.bytes < pages.stated else ""
            recorded = self._recorded(cut)
            for number, name, *_ in recorded.topics:
                self._ids.setdefault(name, []).append(number)
            known = {number for number, *_ in recorded.topics}
            self._rows, damages = find_rows(pages, recorded.root, known)
        losses += tuple(self._told(damages, cut))
        foreign = ~np.isin(self._rows.topic_id, sorted(known))
        if foreign.any():
            losses += (Loss(str(path), "messages of topics that the file does not list", messages=int(foreign.sum())),)
        self._definitions: dict[str, Definition] = {}
        self.topics: tuple[Topic, ...] = tuple(self._topics(recorded))
        self.losses: tuple[Loss, ...] = losses
        self._opening_losses = losses

    def _settled(self, path: Path) -> tuple[Path, tuple[Loss, ...]]:
        """Return an uncompressed file in which all finished transactions are, a temporary copy where it takes one."""
        file = path
        losses: tuple[Loss, ...] = ()
        if path.suffix in FORMATS.values():
            file, losses = unpack_file(path, working_folder(self))
        logs = [path.with_name(path.name + end) for end in ("-wal", "-journal")]
        logs = [log for log in logs if log.exists() and log.stat().st_size > 0]
        if not logs or file != path:
            return file, losses
        # The recorder was interrupted: its last transactions stand beside the file, and SQLite puts them in.
        folder = working_folder(self)
        copy = Path(shutil.copy(path, folder))
        for log in logs:
            shutil.copy(log, folder)
        try:
            with closing(sqlite3.connect(copy)) as connection:
                connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
                connection.execute("SELECT count(*) FROM sqlite_master").fetchall()
        except sqlite3.DatabaseError as error:
            names = " and ".join(log.name for log in logs)
            return path, (Loss(str(path), f"{names} cannot be applied ({error}): the last messages are lost"),)
        return copy, losses

    def _connect(self) -> sqlite3.Connection:
        # Immutable: no lock and no -shm file, so a read-only folder will do. A writable schema, which nothing writes,
        # makes SQLite open a truncated file.
        connection = sqlite3.connect(f"{self._file.resolve().as_uri()}?immutable=1", uri=True)
        connection.text_factory = lambda raw: raw.decode(errors="replace")
        connection.execute("PRAGMA writable_schema=ON")
        return connection

    def _recorded(self, cut: str) -> Recorded:
        path = self.paths[0]
        try:
            with closing(self._connect()) as connection:
                tables = dict(
                    connection.execute("SELECT name, rootpage FROM sqlite_master WHERE type='table'").fetchall()
                )
                columns = {
                    name: [row[1] for row in connection.execute(f"PRAGMA table_info('{name}')")]
                    for name in ("topics", "messages", "message_definitions", "schema")
                    if name in tables
                }
                if columns.get("messages") != MESSAGE_COLUMNS or not {"id", "name", "type"} <= {
                    *columns.get("topics", ())
                }:
                    if cut:
                        raise sqlite3.DatabaseError(cut)
                    found = ", ".join(sorted(tables)) or "none"
                    raise FerryIdError(
                        f"{path}: an SQLite database but not one of rosbag2, found the tables: {found}. "
                        "Fix: give the .db3 file that rosbag2 recorded"
                    )
                serialization = "serialization_format" if "serialization_format" in columns["topics"] else "'cdr'"
                digest = "type_description_hash" if "type_description_hash" in columns["topics"] else "''"
                topics = connection.execute(
                    f"SELECT id, name, type, {serialization}, {digest} FROM topics ORDER BY id"
                ).fetchall()
                definitions = {}
                if "message_definitions" in tables:
                    for name, encoding, text in connection.execute(
                        "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
                    ):
                        definitions[normalized(name)] = RecordedText(encoding, text)
                distro = ""
                if "ros_distro" in columns.get("schema", ()):
                    distro = next((row[0] for row in connection.execute("SELECT ros_distro FROM schema")), "")
        except sqlite3.DatabaseError as error:
            raise FerryIdError(
                f"{path}: the list of topics cannot be read, the SQLite file is damaged or cut off ({error}). "
                "Fix: copy it from the recorder again, or recover it with sqlite3's .recover"
            ) from error
        return Recorded(tables["messages"], tuple(topics), definitions, distro)

    def _told(self, damages: Sequence[Damage], cut: str) -> Iterator[Loss]:
        """Say what stretches of lost rows cost; neighbouring ones are one loss."""
        merged: list[Damage] = []
        for damage in damages:
            if merged and damage.low <= merged[-1].high:
                last = merged.pop()
                where = last.where if last.where.endswith("others") else f"{last.where} and others"
                counts = (last.rows, damage.rows)
                count = None if counts[0] is None or counts[1] is None else counts[0] + counts[1]
                damage = Damage(last.low, max(damage.high, last.high), where, count)
            merged.append(damage)
        rows, told = self._rows, 0
        for damage in merged:
            first, last = np.searchsorted(rows.rowid, [damage.low, damage.high], "right")
            lost = damage.rows
            if lost is None and damage.high != LAST_ROWID:
                lost = damage.high - damage.low - int(last - first)
            elif lost is None and self._storage.messages is not None:
                lost = max(0, self._storage.messages - len(rows) - told)
            if lost == 0:
                continue
            told += lost or 0
            yield Loss(
                str(self.paths[0]),
                "; ".join(filter(None, (cut, damage.where))),
                messages=lost,
                start_ns=int(rows.time_ns[first - 1]) if first else None,
                end_ns=int(rows.time_ns[last]) if last < len(rows) else self._storage.end_ns,
            )

    def _topics(self, recorded: Recorded) -> Iterator[Topic]:
        distro = self._storage.distro or recorded.distro
        for name, numbers in self._ids.items():
            entries = [entry for entry in recorded.topics if entry[0] in numbers]
            types = sorted({normalized(entry[2]) for entry in entries})
            _, _, _, own_encoding, digest = entries[0]
            encoding = self._storage.encodings.get(name, own_encoding)
            times = self._rows.time_ns[np.isin(self._rows.topic_id, numbers)]
            if encoding != "cdr":
                found = Definition(None, {}, f'cannot be decoded: serialised as "{encoding}", only cdr is supported')
            elif len(types) > 1:
                found = Definition(None, {}, f"cannot be decoded: recorded with the types {' and '.join(types)}")
            else:
                digest = digest or self._storage.digests.get(name, "")
                found = define(types[0], recorded.definitions.get(types[0]), digest, distro)
            self._definitions[name] = found
            yield Topic(
                name=name,
                type=types[0],
                encoding=encoding,
                count=times.size,
                start_ns=int(times.min()) if times.size else None,
                end_ns=int(times.max()) if times.size else None,
                fields=found.fields,
                note=found.note,
            )

    def _decoders(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Decoder]:
        path = self.paths[0]
        known = {topic.name: topic for topic in self.topics}
        decoders: dict[str, Decoder] = {}
        for name, fields in wanted.items():
            topic = known.get(name)
            if topic is None:
                raise FerryIdError(
                    f"{path}: no topic {name}, found {len(known)} others. "
                    f"Fix: name one of them.{did_you_mean(name, known)}"
                )
            definition = self._definitions[name]
            if definition.typestore is None:
                raise FerryIdError(
                    f"{path}: {name} of type {topic.type} {definition.note}. "
                    "Fix: record with a newer rosbag2, which stores definitions, as cdr, or map another topic"
                )
            decoders[name] = decoder_for("cdr", definition.typestore, topic.type, name, fields, topic.count, str(path))
        return decoders

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have, or a topic that cannot be decoded.
        """
        decoders = self._decoders(wanted)
        # SQLite keeps no checksums; what can be verified is that pages, cells and indices fit together.
        losses = list(self._opening_losses) + (self._integrity() if verify else [])
        dropped = self._feed(decoders)
        path = str(self.paths[0])
        losses += [
            Loss(path, f"messages of {name} that cannot be unpacked or whose pages are lost", name, count)
            for name, count in dropped.items()
            if count
        ]
        series = {name: decoder.finish() for name, decoder in decoders.items()}
        for decoder in decoders.values():
            losses += decoder.losses(path)
        self.losses = tuple(losses)
        return series

    def _feed(self, decoders: Mapping[str, Decoder]) -> dict[str, int]:
        """Give every wanted message to its decoder; return how many of each topic could not be."""
        ids = {number: name for name in decoders for number in self._ids[name]}
        rows = self._rows
        if len(ids) < len(self.topics):
            rows = rows.take(np.isin(rows.topic_id, sorted(ids)))
        dropped = dict.fromkeys(decoders, 0)
        with Pages(self._file) as pages:
            # A message never begins its page, though an empty one may stand behind its last byte.
            numbers = (rows.start - 1) // pages.size + 1
            for first, last, buffer, base in read_runs(pages, numbers):
                part = rows.take(slice(first, last))
                one_by_one = self._storage.codec or (part.local < part.size).any()
                for number, name in ids.items():
                    mine = np.flatnonzero(part.topic_id == number)
                    if one_by_one:
                        dropped[name] += self._add_one_by_one(pages, part.take(mine), decoders[name])
                    else:
                        starts = part.start[mine] - base
                        decoders[name].add(buffer, starts, part.size[mine], part.time_ns[mine])
        return dropped

    def _add_one_by_one(self, pages: Pages, rows: Rows, decoder: Decoder) -> int:
        """Give messages to a decoder that are compressed or lie on several pages; return how many are lost."""
        unpack = message_unpacker(self._storage.codec) if self._storage.codec else bytes
        lost = len(rows)
        for batch, starts, sizes, numbers in unpacked_batches(unpack, (pages.blob(rows, i) for i in range(len(rows)))):
            decoder.add(batch, starts, sizes, rows.time_ns[numbers])
            lost -= len(numbers)
        return lost

    def _integrity(self) -> list[Loss]:
        try:
            with closing(self._connect()) as connection:
                faults = [row[0] for row in connection.execute("PRAGMA integrity_check(10)")]
        except sqlite3.DatabaseError as error:
            faults = [str(error)]
        told = [" ".join(fault.split()) for fault in faults if fault != "ok"]
        return [Loss(str(self.paths[0]), f"SQLite's integrity check: {'; '.join(told)}")] if told else []


def matches(path: Path, head: bytes) -> bool:
    """Take SQLite files by their first bytes, and compressed or damaged ones by their name."""
    name = path.name.removesuffix(".zstd").removesuffix(".lz4")
    return head.startswith(MAGIC) or (bool(head) and name.endswith(".db3"))


def open_file(path: Path, layout: TableLayout | None = None) -> Sqlite3Log:
    """Open one SQLite file of rosbag2."""
    log = Sqlite3Log(path)
    refuse_foreign(path, log.topics)
    return log


def refuse_foreign(path: Path, topics: Sequence[Topic]) -> None:
    """Refuse a log none of whose topics is serialised in a way that can be decoded.

    Raises
    ------
    FerryIdError
        Naming the serialisation found.
    """
    found = {topic.encoding for topic in topics}
    if found and found.isdisjoint(DECODABLE):
        raise FerryIdError(
            f"{path}: none of its {len(topics)} topics can be decoded, found them serialised as "
            f"{', '.join(sorted(found))}. Fix: record with a middleware that uses CDR, as all of ROS2's own do"
        )


FORMAT = Format("ROS2 SQLite file (.db3)", matches, open_file, order=30)
