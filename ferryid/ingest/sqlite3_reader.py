"""SQLite files of rosbag2 (.db3, also .db3.zstd and .db3.lz4)."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.bulk import Decoder, decoder_for
from ferryid.ingest.log import Loss, Series, TableLayout, Topic
from ferryid.ingest.message_compression import UnpackingDecoder
from ferryid.ingest.ros2_types import Definition, RecordedText, define, normalized
from ferryid.ingest.rosbag2_tables import Recorded, RecordedTopic, line, read_tables
from ferryid.ingest.sqlite_data import read_data
from ferryid.ingest.sqlite_database import FAULTS, Database
from ferryid.ingest.sqlite_rows import Rows, Scan, Stretch, scan_rows
from ferryid.ingest.stray_times import stray_times
from ferryid.ingest.unpack import FORMATS, message_unpacker, unpack_file, working_folder

SUFFIX = ".db3"
DECODABLE = frozenset({"cdr", "ros1", "protobuf", "json"})
# More lost stretches than these are reported as one.
MAX_STRETCHES = 50
WAL_HEADER_BYTES, WAL_FRAME_BYTES = 32, 24


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
        file, losses = self._settled(path)
        self._database = Database(file, path)
        recorded = read_tables(self._database)
        names = list(dict.fromkeys(topic.name for topic in recorded.topics))
        self._place = {name: i for i, name in enumerate(names)}
        # Topic of every number, in order of the numbers; a topic may have several.
        self._numbers = np.array(sorted(topic.number for topic in recorded.topics), np.int64)
        of = {topic.number: self._place[topic.name] for topic in recorded.topics}
        self._topic_of = np.array([of[number] for number in self._numbers.tolist()], np.int64)
        try:
            scan = scan_rows(self._database)
        except FAULTS as error:
            raise FerryIdError(
                f"{path}: the table of messages cannot be read ({line(error)}). Fix: copy the file again"
            ) from error
        self._rows, unlisted = scan.rows, 0
        # Index of the topic of every message; one without messages and topics has none.
        self._topic = self._topics_of(self._rows.topic_id)
        if (foreign := self._topic < 0).any():
            unlisted = int(foreign.sum())
            self._rows, self._topic = self._rows.take(~foreign), self._topic[~foreign]
        losses += tuple(self._lost(scan))
        if unlisted:
            losses += (Loss(str(path), "messages of topics that the file does not list", messages=unlisted),)
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
        logs = [log for log in logs if log.is_file() and log.stat().st_size > 0]
        if not logs or file != path:
            return file, losses
        # The recorder was interrupted: its last transactions stand beside the file, and SQLite puts them in.
        folder = working_folder(self)
        copy = Path(shutil.copy(path, folder))
        for log in logs:
            shutil.copy(log, folder)
        names = " and ".join(log.name for log in logs)
        try:
            with closing(sqlite3.connect(copy)) as connection:
                connection.execute("SELECT count(*) FROM sqlite_master").fetchall()
                _, _, applied = connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()
        except FAULTS as error:
            what = f"{names} cannot be applied ({line(error)}): the last messages are lost"
            return path, (Loss(str(path), what),)
        left = sum(_wal_frames(log) for log in logs if log.name.endswith("-wal")) - max(applied, 0)
        if left > 0:
            what = (
                f"{counted(left, 'page')} in {names} {verb(left, 'is')} of unfinished or damaged transactions: "
                "their messages are lost"
            )
            losses = (Loss(str(path), what),)
        return copy, losses

    def _topics_of(self, numbers: Any) -> Any:
        """Return the index of the topic of every message, -1 for one that the file does not list."""
        if not self._numbers.size:
            return np.full(numbers.size, -1)
        at = np.minimum(np.searchsorted(self._numbers, numbers), self._numbers.size - 1)
        return np.where(self._numbers[at] == numbers, self._topic_of[at], -1)

    def _lost(self, scan: Scan) -> Iterator[Loss]:
        """Report the rows that were not found."""
        path, rows, stated = str(self.paths[0]), scan.rows, self._storage.messages
        cause = "; ".join(filter(None, (self._database.cut, scan.reason)))
        if scan.invalid:
            yield Loss(path, "rows whose topic, time or data are of another type", messages=scan.invalid)
        stretches = scan.stretches
        if not scan.indexed and stated is not None and len(rows) + scan.invalid == stated:
            # All that was recorded is there: the rowids that are missing never were messages.
            stretches = ()
        known = sum(stretch.count or 0 for stretch in stretches)
        unknown = not scan.complete or any(stretch.count is None for stretch in stretches)
        rest = None if stated is None else stated - len(rows) - scan.invalid - known
        lost_ns = None
        if len(stretches) > MAX_STRETCHES:
            count = None if any(stretch.count is None for stretch in stretches) else known
            cause = f"{cause}, in {counted(len(stretches), 'place')}"
            lost_ns = _length_ns(rows, stretches)
            stretches = (Stretch(stretches[0].low, stretches[-1].high, count),)
        for stretch in stretches:
            first = int(np.searchsorted(rows.rowid, stretch.low, "right"))
            last = int(np.searchsorted(rows.rowid, stretch.high, "left"))
            count = stretch.count if stretch.count is not None or rest is None or rest <= 0 else rest
            yield Loss(
                path,
                cause,
                messages=count,
                start_ns=int(rows.time_ns[first - 1]) if first else None,
                end_ns=int(rows.time_ns[last]) if last < len(rows) else self._storage.end_ns,
                lost_ns=lost_ns,
            )
        if scan.complete or not unknown:
            return
        if rest is not None and rest > 0:
            start = int(rows.time_ns[-1]) if len(rows) else None
            yield Loss(path, cause, messages=rest, start_ns=start, end_ns=self._storage.end_ns)
        else:
            # A stated number that fits what was read proves that nothing else is lost.
            what = cause if rest == 0 else f"{cause}; messages at the end may be lost too"
            yield Loss(path, what, messages=0 if rest == 0 else None)

    def _topics(self, recorded: Recorded) -> Iterator[Topic]:
        distro = self._storage.distro or recorded.distro
        entries: dict[str, list[RecordedTopic]] = {}
        for topic in recorded.topics:
            entries.setdefault(topic.name, []).append(topic)
        counts = np.bincount(self._topic, minlength=len(entries))
        starts, ends = np.full(len(entries), np.iinfo(np.int64).max), np.full(len(entries), np.iinfo(np.int64).min)
        # Rows of all topics were received in this order: a time that contradicts it says nothing of first and last.
        consistent = np.flatnonzero(~stray_times(self._rows.time_ns)[0])
        timed = np.bincount(self._topic[consistent], minlength=len(entries))
        held = np.flatnonzero(timed)
        if held.size:
            order = np.argsort(self._compact(self._topic[consistent]), kind="stable")
            times = self._rows.time_ns[consistent[order]]
            edges = (np.cumsum(timed) - timed)[held]
            starts[held] = np.minimum.reduceat(times, edges)
            ends[held] = np.maximum.reduceat(times, edges)
        for i, (name, several) in enumerate(entries.items()):
            found, msgtype, encoding = self._definition(name, several, recorded.definitions, distro)
            self._definitions[name] = found
            yield Topic(
                name=name,
                type=msgtype,
                encoding=encoding,
                count=int(counts[i]),
                start_ns=int(starts[i]) if timed[i] else None,
                end_ns=int(ends[i]) if timed[i] else None,
                fields=found.fields,
                note=found.note,
            )

    def _definition(
        self, name: str, entries: Sequence[RecordedTopic], definitions: Mapping[str, RecordedText], distro: str
    ) -> tuple[Definition, str, str]:
        """Return the definition of a topic's type, the type and the serialisation."""
        types = sorted({normalized(entry.type) for entry in entries if entry.type is not None})
        own, digest = entries[0].encoding, entries[0].digest
        encoding = self._storage.encodings.get(name, own or "")
        note = ""
        if any(entry.type is None for entry in entries):
            note = "its type is no text"
        elif own is None and not encoding:
            note = "its serialisation is no text"
        elif encoding != "cdr":
            note = f'serialised as "{encoding}", only cdr is supported'
        elif len(types) > 1:
            note = f"recorded with the types {' and '.join(types)}"
        msgtype = types[0] if types else ""
        if note:
            return Definition(None, {}, f"cannot be decoded: {note}"), msgtype, encoding
        digest = digest or self._storage.digests.get(name, "")
        return define(msgtype, definitions.get(msgtype), digest, distro), msgtype, encoding

    def _compact(self, topics: Any) -> Any:
        """Return indices of topics in a type that is quick to sort."""
        return topics.astype(np.uint16) if len(self._place) < 1 << 16 else topics

    def _decoders(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Decoder]:
        path = self.paths[0]
        known = {topic.name: topic for topic in self.topics}
        decoders: dict[str, Decoder] = {}
        unpack = message_unpacker(self._storage.codec) if self._storage.codec else None
        for name, fields in wanted.items():
            topic = known.get(name)
            if topic is None:
                raise FerryIdError(
                    f"{path}: no topic {name}, found {counted(len(known), 'other')}. "
                    f"Fix: name one of them.{did_you_mean(name, known)}"
                )
            definition = self._definitions[name]
            if definition.typestore is None:
                raise FerryIdError(
                    f"{path}: {name} of type {topic.type} {definition.note}. "
                    "Fix: record with a newer rosbag2, which stores definitions, as cdr, or map another topic"
                )
            decoder = decoder_for("cdr", definition.typestore, topic.type, name, fields, topic.count, str(path))
            decoders[name] = UnpackingDecoder(decoder, unpack) if unpack else decoder
        return decoders

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have, or a topic that cannot be decoded.
        """
        decoders = self._decoders(wanted)
        path = str(self.paths[0])
        # SQLite keeps no checksums; what can be verified is that pages, cells and indices fit together.
        faults = self._database.integrity() if verify else []
        losses = [*self._opening_losses]
        if faults:
            losses.append(Loss(path, f"SQLite's integrity check: {'; '.join(faults)}"))
        try:
            dropped = self._feed(decoders)
        except FAULTS as error:
            raise FerryIdError(
                f"{path}: the messages cannot be read any more ({line(error)}). Fix: copy the file again"
            ) from self._database.checked(error)
        losses += [
            Loss(path, f"messages of {name} whose data cannot be read from their pages", name, count)
            for name, count in dropped.items()
            if count
        ]
        series = {name: decoder.finish() for name, decoder in decoders.items()}
        for decoder in decoders.values():
            losses += decoder.losses(path)
        self.losses = tuple(losses)
        return series

    def _feed(self, decoders: Mapping[str, Decoder]) -> dict[str, int]:
        """Give every wanted message to its decoder; return how many of each topic could not be read."""
        dropped = dict.fromkeys(decoders, 0)
        names = {self._place[name]: name for name in decoders}
        wanted = self._numbers[np.isin(self._topic_of, list(names))]
        if not wanted.size:
            return dropped
        for piece in read_data(self._database, self._rows, wanted.tolist()):
            topic = self._topics_of(piece.rows.topic_id)
            for place, lost in zip(*np.unique(topic[~piece.kept], return_counts=True), strict=True):
                if place in names:
                    dropped[names[place]] += int(lost)
            topic, times = topic[piece.kept], piece.rows.time_ns[piece.kept]
            starts = np.cumsum(piece.size) - piece.size
            order = np.argsort(self._compact(topic), kind="stable")
            for mine in np.split(order, np.flatnonzero(np.diff(topic[order])) + 1):
                if mine.size and (name := names.get(int(topic[mine[0]]))) is not None:
                    decoders[name].add(piece.data, starts[mine], piece.size[mine], times[mine])
        return dropped


def _length_ns(rows: Rows, stretches: Sequence[Stretch]) -> int:
    """Return how long lost stretches are together [ns], without those at the ends of the log."""
    firsts = np.searchsorted(rows.rowid, [stretch.low for stretch in stretches], "right")
    lasts = np.searchsorted(rows.rowid, [stretch.high for stretch in stretches], "left")
    inside = (firsts > 0) & (lasts < len(rows))
    return int((rows.time_ns[lasts[inside]] - rows.time_ns[firsts[inside] - 1]).sum())


def _wal_frames(log: Path) -> int:
    """Count the frames of a write-ahead log that were written since it was last begun anew."""
    with log.open("rb") as file:
        head = file.read(WAL_HEADER_BYTES)
        size = WAL_FRAME_BYTES + int.from_bytes(head[8:12], "big")
        count = 0
        while len(head) == WAL_HEADER_BYTES and file.read(WAL_FRAME_BYTES)[8:16] == head[16:24]:
            count += 1
            file.seek(WAL_HEADER_BYTES + count * size)
    return count


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
            f"{path}: none of its {counted(len(topics), 'topic')} can be decoded, found them serialised as "
            f"{', '.join(sorted(found))}. Fix: record with a middleware that uses CDR, as all of ROS2's own do"
        )
