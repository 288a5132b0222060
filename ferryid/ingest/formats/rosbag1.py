"""ROS1 bags: by their index where they have one, by a walk over their records where they don't."""

from __future__ import annotations

import mmap
import re
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.base import TypesysError
from rosbags.typesys.msg import normalize_msgtype

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.bulk import Decoder, decoder_for, leaf_fields
from ferryid.ingest.definitions import DefinitionError, md5sum, parse_definition
from ferryid.ingest.layout import EMPTY_MEMBER, stamp_path
from ferryid.ingest.log import Format, Loss, Series, TableLayout, Topic
from ferryid.ingest.rosbag1_records import (
    MAGIC,
    Chunk,
    Connection,
    Entries,
    Messages,
    RecordError,
    Records,
    decompressed,
    read_index,
)
from ferryid.ingest.rosbag1_recovery import walk

SUFFIXES = (".bag", ".bag.active")
NS = 1_000_000_000
SEVERAL_TYPES = "recorded with different message types or definitions: cannot be read as one topic"
# Chunks decompressed ahead in threads where decompression is slow (bz2).
AHEAD = 4


def matches(path: Path, head: bytes) -> bool:
    """Tell a bag by its first bytes, or by its name so that a damaged one gets a clear line."""
    return head.startswith(b"#ROSBAG") or (path.is_file() and path.name.endswith(SUFFIXES))


def open_bag(path: Path, layout: TableLayout | None) -> Rosbag1Reader:
    """Open a ROS1 bag; `layout` has no meaning for it.

    Raises
    ------
    FerryIdError
        For a file that is no bag of version 2.0, or that holds no record at all.
    """
    return Rosbag1Reader(path)


FORMAT = Format(name="ROS1 bag (.bag)", matches=matches, open=open_bag, order=20)


@dataclass
class _Tally:
    """Messages lost in one place, with the receive times known of them."""

    count: int = 0
    times: list[int] = field(default_factory=list)

    def add(self, receive_ns: NDArray[np.int64]) -> None:
        """Count the messages received at these times."""
        if len(receive_ns):
            self.count += len(receive_ns)
            self.times += [int(receive_ns.min()), int(receive_ns.max())]


class Rosbag1Reader:
    """One ROS1 bag. Opening reads its index; only chunks that hold wanted topics are decompressed."""

    def __init__(self, path: Path) -> None:
        self.paths: tuple[Path, ...] = (path,)
        self._data = _mapped(path)
        self._check_version(path)
        self._opening: list[Loss] = []
        try:
            connections, chunks = read_index(Records(self._data))
        except RecordError as error:
            connections, chunks = self._recovered(error)
        self._chunks = chunks
        self._note_strangers({connection.number for connection in connections})
        self._by_topic: dict[str, list[Connection]] = {}
        for connection in connections:
            self._by_topic.setdefault(connection.topic, []).append(connection)
        # Shared, because rosbags compiles code for every type that a store holds.
        self._store = get_typestore(Stores.EMPTY)
        self._definitions: dict[tuple[str, str], Mapping[str, Any]] = {}
        self._faults: dict[tuple[str, str], str] = {}
        self.topics: tuple[Topic, ...] = tuple(self._topic(name) for name in sorted(self._by_topic))
        self.losses: tuple[Loss, ...] = tuple(self._opening)

    def _check_version(self, path: Path) -> None:
        head = bytes(self._data[:64])
        if head.startswith(MAGIC):
            return
        version = re.match(rb"#ROSBAG V(\d+\.\d+)\n", head)
        if version:
            raise FerryIdError(
                f"{path}: ferryid reads ROS1 bags of version 2.0, found version {version[1].decode()}. "
                "Fix: convert it with rosbag fix"
            )
        raise FerryIdError(
            f"{path}: not a ROS1 bag, found a file that begins with {head[:12]!r}. Fix: check that it was copied whole"
        )

    def _recovered(self, error: RecordError) -> tuple[list[Connection], list[Chunk]]:
        """Read the bag without its index, and note what is not there any more."""
        path, size = self.paths[0], len(self._data)
        records = Records(self._data)
        try:
            index = records.at(len(MAGIC)).number(b"index_pos")
        except RecordError:
            index = 0
        found = walk(records)
        if not found.connections:
            raise FerryIdError(
                f"{path}: no message can be recovered from the bag, {error}. Fix: copy it from the recorder again"
            ) from error

        def lost(
            what: str, messages: int | None = None, start_ns: int | None = None, end_ns: int | None = None
        ) -> None:
            self._opening.append(Loss(str(path), what, None, messages, start_ns, end_ns))

        count = sum(chunk.count(number) for chunk in found.chunks for number in chunk.connections)
        lost(f"the index cannot be used ({error}): a walk over all records found {count} messages without it", 0)
        for chunk in found.chunks:
            if chunk.end > size:
                kept = sum(len(entries) for entries in chunk.walked.values())
                lost(
                    f"the file ends in the chunk at byte {chunk.position}, which has {size - chunk.start} of its "
                    f"{chunk.end - chunk.start} bytes: {kept} messages of it are intact"
                )
        if index > size:
            lost(*_estimate(self._data, found.chunks, index))
        for place, messages, start_ns, end_ns in found.missing:
            lost(f"the chunk at byte {place} is damaged: its {messages} messages are lost", messages, start_ns, end_ns)
        told = {place for place, *_ in found.missing}
        for first, end in found.gaps:
            # Damage to the index itself, the end of a cut file and chunks with a count have been told already.
            if first not in told and not 0 < index <= first and not (end >= size and index > size):
                lost(f"bytes {first} to {end} are damaged: what they held is lost")
        return list(found.connections.values()), found.chunks

    def _note_strangers(self, known: set[int]) -> None:
        strangers = [(chunk, number) for chunk in self._chunks for number in chunk.connections - known]
        if strangers:
            count = sum(chunk.count(number) for chunk, number in strangers)
            what = f"{count} messages belong to a connection whose topic and type are lost"
            self._opening.append(Loss(str(self.paths[0]), what, None, count))

    def _topic(self, name: str) -> Topic:
        connections = self._by_topic[name]
        kinds = {(one.msgtype, one.md5sum) for one in connections}
        numbers = {one.number for one in connections}
        msgtypes = sorted({normalize_msgtype(one.msgtype) for one in connections})
        start_ns, end_ns = self._times(numbers)
        fields: Mapping[str, str] = {}
        note = ""
        if len(kinds) > 1:
            note = SEVERAL_TYPES
        else:
            store = get_typestore(Stores.EMPTY)
            # To list the fields the parsed definitions will do; registering them compiles code, which only `read` needs.
            store.fielddefs.update(self._parsed(connections[0]))
            fields = leaf_fields(store, msgtypes[0])
            if not fields and not _is_empty(store, msgtypes[0]):
                note = "its message definition cannot be read"
            elif stamp_path(store, msgtypes[0]) is None:
                note = "no header: receive times only"
        return Topic(
            name=name,
            type=", ".join(msgtypes),
            encoding="ros1",
            count=sum(chunk.count(number) for chunk in self._chunks for number in numbers),
            start_ns=start_ns,
            end_ns=end_ns,
            fields=fields,
            note=note,
        )

    def _times(self, numbers: set[int]) -> tuple[int | None, int | None]:
        """First and last receive time of some connections, from as few index records as tell."""
        chunks = [chunk for chunk in self._chunks if any(chunk.count(number) for number in numbers)]
        first: int | None = None
        for chunk in sorted(chunks, key=lambda one: one.start_ns or 0):
            # A chunk that begins later than what was found cannot hold anything earlier.
            if first is not None and chunk.start_ns is not None and chunk.start_ns >= first:
                break
            times = self._receive_ns(chunk, numbers)
            first = min(first, int(times.min())) if first is not None else int(times.min())
        last: int | None = None
        for chunk in sorted(chunks, key=lambda one: -(one.end_ns or 2**63)):
            if last is not None and chunk.end_ns is not None and chunk.end_ns <= last:
                break
            times = self._receive_ns(chunk, numbers)
            last = max(last, int(times.max())) if last is not None else int(times.max())
        return first, last

    def _receive_ns(self, chunk: Chunk, numbers: set[int]) -> NDArray[np.int64]:
        return np.concatenate([_nanoseconds(chunk.entries(self._data, number)) for number in numbers])

    def _parsed(self, connection: Connection) -> Mapping[str, Any]:
        """Return the definitions of a connection's type and of those it is made of; empty if unreadable."""
        key = connection.msgtype, connection.md5sum
        if key not in self._definitions:
            parsed: Mapping[str, Any]
            try:
                parsed = parse_definition(connection.definition, normalize_msgtype(connection.msgtype), "ros1msg")
            except DefinitionError as error:
                parsed = {}
                self._faults[key] = str(error)
            self._definitions[key] = parsed
        return self._definitions[key]

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics; `losses` is complete afterwards.

        Raises
        ------
        FerryIdError
            For a topic or field that the bag does not have, or a topic whose definition cannot be used.
        """
        losses = list(self._opening)
        decoders = {name: self._decoder(name, paths, losses) for name, paths in wanted.items()}
        numbers = {name: [one.number for one in self._by_topic[name]] for name in wanted}
        every = {number for group in numbers.values() for number in group}
        chunks = [chunk for chunk in self._chunks if verify or not every.isdisjoint(chunk.connections)]
        messages = Messages()
        for chunk, (buffer, fault) in zip(chunks, self._decompressed(chunks, verify), strict=True):
            tally = self._decode(chunk, buffer, messages, decoders, numbers)
            # That a chunk is cut off by the end of the file was noted at opening.
            if tally.count or (fault and chunk.end <= len(self._data)):
                losses.append(self._loss(chunk, fault, tally))
        path = str(self.paths[0])
        self.losses = (*losses, *(loss for decoder in decoders.values() for loss in decoder.losses(path)))
        return {name: decoder.finish() for name, decoder in decoders.items()}

    def _decoder(self, name: str, paths: Sequence[str], losses: list[Loss]) -> Decoder:
        file = self.paths[0]
        if name not in self._by_topic:
            raise FerryIdError(
                f"{file}: no topic {name}, found {len(self._by_topic)} others. "
                f"Fix: name a topic of the bag.{did_you_mean(name, self._by_topic)}"
            )
        topic = next(topic for topic in self.topics if topic.name == name)
        connection = self._by_topic[name][0]
        if topic.note == SEVERAL_TYPES:
            raise FerryIdError(
                f"{file}: topic {name} cannot be read, found it recorded with different types or definitions "
                f"({topic.type}). Fix: record the publishers under topics of their own"
            )
        store = self._registered(connection, topic)
        if topic.type not in store.fielddefs:
            fault = self._faults.get((connection.msgtype, connection.md5sum), "describes other types")
            raise FerryIdError(
                f"{file}: topic {name} cannot be decoded, found no readable definition of {topic.type}: it {fault}. "
                "Fix: copy the bag from the recorder again, or record with a valid message file"
            )
        if connection.md5sum not in ("*", md5sum(store, topic.type)):
            what = f"the definition of {topic.type} does not match its checksum: values of {name} may be misread"
            losses.append(Loss(str(file), what, name, 0))
        return decoder_for("ros1", store, topic.type, name, paths, topic.count, where=str(file))

    def _registered(self, connection: Connection, topic: Topic) -> Any:
        """Return a typestore with a connection's definitions: the shared one, unless another's differ from them."""
        definitions = dict(self._parsed(connection))
        try:
            try:
                self._store.register(definitions)
                return self._store
            except TypesysError:
                store = get_typestore(Stores.EMPTY)
                store.register(definitions)
                return store
        except (TypesysError, KeyError, SyntaxError) as error:
            raise FerryIdError(
                f"{self.paths[0]}: topic {topic.name} cannot be decoded, found a definition of {topic.type} that is no "
                f"valid message ({str(error).splitlines()[0]}). Fix: correct the message file and record again"
            ) from error

    def _decompressed(self, chunks: Sequence[Chunk], verify: bool) -> Iterator[tuple[Any, str]]:
        """Yield what each chunk holds, and what is wrong with it."""

        def load(chunk: Chunk) -> tuple[Any, str]:
            return decompressed(self._data, chunk, exact=verify or bool(chunk.walked))

        if not any(chunk.compression == "bz2" for chunk in chunks):
            yield from map(load, chunks)
            return
        with ThreadPoolExecutor(AHEAD) as pool:
            queued: deque[Future[tuple[Any, str]]] = deque()
            rest = iter(chunks)
            queued.extend(pool.submit(load, chunk) for chunk in islice(rest, AHEAD))
            while queued:
                yield queued.popleft().result()
                queued.extend(pool.submit(load, chunk) for chunk in islice(rest, 1))

    def _decode(
        self,
        chunk: Chunk,
        buffer: Any,
        messages: Messages,
        decoders: Mapping[str, Decoder],
        numbers: Mapping[str, Sequence[int]],
    ) -> _Tally:
        """Hand the wanted messages of one chunk to their decoders; returns those that are damaged."""
        tally = _Tally()
        parts: list[tuple[str, Entries, NDArray[np.int64]]] = []
        for name, group in numbers.items():
            pieces = [(number, chunk.entries(self._data, number)) for number in group if chunk.count(number)]
            if not pieces:
                continue
            entries = np.concatenate([piece for _, piece in pieces]) if len(pieces) > 1 else pieces[0][1]
            owners = np.concatenate([np.full(len(piece), number) for number, piece in pieces])
            if len(pieces) > 1:
                order = np.argsort(entries[:, 2], kind="stable")
                entries, owners = entries[order], owners[order]
            parts.append((name, entries, owners))
        if not parts:
            return tally
        together = np.concatenate([entries for _, entries, _ in parts])
        starts, sizes, intact = messages.locate(buffer, together, np.concatenate([owners for _, _, owners in parts]))
        receive_ns = _nanoseconds(together)
        first = 0
        for name, entries, _ in parts:
            here = slice(first, first + len(entries))
            first += len(entries)
            if intact is None:
                decoders[name].add(buffer, starts[here], sizes[here], receive_ns[here])
            else:
                good = intact[here]
                decoders[name].add(buffer, starts[here][good], sizes[here][good], receive_ns[here][good])
                tally.add(receive_ns[here][~good])
        return tally

    def _loss(self, chunk: Chunk, fault: str, tally: _Tally) -> Loss:
        known = f"messages of the wanted topics lost in it: {tally.count}"
        # Without index records nothing tells how many messages lay behind the damage.
        hidden = bool(fault) and not chunk.index
        return Loss(
            file=str(self.paths[0]),
            what=f"the chunk at byte {chunk.position} is damaged"
            + (f", {fault}" if fault else "")
            + (": the messages behind the damage are lost" if hidden else f": {known}"),
            messages=None if hidden else tally.count,
            start_ns=min(tally.times, default=None),
            end_ns=max(tally.times, default=None),
        )


def _is_empty(store: Any, msgtype: str) -> bool:
    return msgtype in store.fielddefs and all(name == EMPTY_MEMBER for name, _ in store.fielddefs[msgtype][1])


def _estimate(data: Any, chunks: Sequence[Chunk], index: int) -> tuple[str, None, int | None]:
    """Say how much of a bag is missing behind the end of the file, from the bytes that its header announces."""
    times = [
        _nanoseconds(entries)
        for chunk in chunks
        for entries in (chunk.entries(data, number) for number in chunk.connections)
        if len(entries)
    ]
    size, part = len(data), (index - len(data)) / len(data)
    what = f"the file ends at byte {size} of more than {index}: about {100 * (index - size) / index:.0f} % is lost at the end"
    if not times:
        return what, None, None
    first, last = min(int(one.min()) for one in times), max(int(one.max()) for one in times)
    messages, seconds = part * sum(len(one) for one in times), part * (last - first) * 1e-9
    return f"{what}, by the rate before it {messages:.0f} messages in {seconds:.1f} s", None, last


def _nanoseconds(entries: Entries) -> NDArray[np.int64]:
    times: NDArray[np.int64] = entries[:, 0].astype(np.int64) * NS + entries[:, 1]
    return times


def _mapped(path: Path) -> mmap.mmap:
    with path.open("rb") as file:
        if path.stat().st_size == 0:
            raise FerryIdError(
                f"{path}: the file is empty, a ROS1 bag was expected, found 0 bytes. Fix: copy it from the recorder again"
            )
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
