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

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.bulk import Decoder, decoder_for, leaf_fields
from ferryid.ingest.definitions import DefinitionError, md5sum, parse_definition
from ferryid.ingest.layout import EMPTY_MEMBER, stamp_path
from ferryid.ingest.log import Loss, Series, Topic
from ferryid.ingest.rosbag1_chunks import (
    FREE_CHUNK,
    Allowance,
    Content,
    covers,
    decompressed,
    distinct,
    missing,
    replaced,
)
from ferryid.ingest.rosbag1_losses import losses
from ferryid.ingest.rosbag1_messages import Messages
from ferryid.ingest.rosbag1_records import (
    MAGIC,
    NO_ENTRIES,
    Chunk,
    Connection,
    Entries,
    RecordError,
    Records,
    nanoseconds,
    read_index,
)
from ferryid.ingest.rosbag1_recovery import walk

SEVERAL_TYPES = "recorded with different message types or definitions: cannot be read as one topic"
# Chunks decompressed ahead in threads where decompression is slow (bz2).
AHEAD = 4


@dataclass
class _Tally:
    """Messages lost in one chunk, with the receive times known of them, and what was found of its index records.

    Attributes
    ----------
    count, others
        Lost messages of the wanted topics, and of the others.
    times
        Receive times of the first and the last of some of them [ns].
    repaired
        Whether the messages were read from the chunk in place of its index records.
    hidden
        Whether there may be messages that no index record lists.
    """

    count: int = 0
    others: int = 0
    times: list[int] = field(default_factory=list)
    repaired: bool = False
    hidden: bool = False

    def add(self, receive_ns: NDArray[np.int64], *, wanted: bool) -> None:
        """Count the messages received at these times."""
        if len(receive_ns):
            self.count += len(receive_ns) if wanted else 0
            self.others += 0 if wanted else len(receive_ns)
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
        self._numbers = [connection.number for connection in connections]
        self._note_strangers(set(self._numbers))
        self._chunks_of: dict[int, list[Chunk]] = {}
        for chunk in chunks:
            for number in chunk.connections:
                if chunk.count(number):
                    self._chunks_of.setdefault(number, []).append(chunk)
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
        path = self.paths[0]
        try:
            found = walk(Records(self._data))
        except RecordError as excess:
            raise FerryIdError(
                f"{path}: the bag cannot be read, {excess}. Fix: copy it from the recorder again"
            ) from excess
        if not found.connections:
            raise FerryIdError(
                f"{path}: no message can be recovered from the bag, {error}. Fix: copy it from the recorder again"
            ) from error
        self._opening += losses(str(path), self._data, found, error)
        return list(found.connections.values()), found.chunks

    def _note_strangers(self, known: set[int]) -> None:
        strangers = [(chunk, number) for chunk in self._chunks for number in chunk.connections - known]
        if strangers:
            count = sum(chunk.count(number) for chunk, number in strangers)
            what = f"{counted(count, 'message')} {verb(count, 'belongs')} to a connection whose topic and type are lost"
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
            count=sum(chunk.count(number) for number in numbers for chunk in self._chunks_of.get(number, ())),
            start_ns=start_ns,
            end_ns=end_ns,
            fields=fields,
            note=note,
        )

    def _times(self, numbers: set[int]) -> tuple[int | None, int | None]:
        """First and last receive time of some connections, from as few index records as needed."""
        chunks = [chunk for number in numbers for chunk in self._chunks_of.get(number, ())]
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
        return np.concatenate([nanoseconds(chunk.entries(self._data, number)) for number in numbers])

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
        lost = list(self._opening)
        described = {topic.name: topic for topic in self.topics}
        decoders = {name: self._decoder(name, paths, described, lost) for name, paths in wanted.items()}
        topic_of = {one.number: name for name in wanted for one in self._by_topic[name]}
        # Without chunk information nothing but the chunk itself shows whether its index records are all there.
        unsure = {chunk.position for chunk in self._chunks if chunk.counts is None and chunk.walked is None}
        chunks = [
            chunk
            for chunk in self._chunks
            if verify or chunk.position in unsure or not topic_of.keys().isdisjoint(chunk.connections)
        ]
        messages = Messages()
        repaired: list[Chunk] = []
        self._walks = Allowance.of_file(len(self._data))
        for chunk, content in zip(chunks, self._decompressed(chunks, verify, unsure), strict=True):
            check = verify or chunk.position in unsure
            tally = self._decode(chunk, content, messages, decoders, topic_of, check=check)
            if tally.repaired:
                repaired.append(chunk)
            # What is wrong with a chunk that was walked was noted at opening.
            fault = content.fault if chunk.walked is None else ""
            if tally.count or tally.others or tally.hidden or (fault and not tally.repaired):
                lost.append(self._loss(chunk, fault, tally))
        if repaired:
            lost.append(self._repair(repaired))
        path = str(self.paths[0])
        self.losses = (*lost, *(loss for decoder in decoders.values() for loss in decoder.losses(path)))
        return {name: decoder.finish() for name, decoder in decoders.items()}

    def _decoder(self, name: str, paths: Sequence[str], described: Mapping[str, Topic], lost: list[Loss]) -> Decoder:
        file = self.paths[0]
        if name not in self._by_topic:
            raise FerryIdError(
                f"{file}: no topic {name}, found {counted(len(self._by_topic), 'other')}. "
                f"Fix: name a topic of the bag.{did_you_mean(name, self._by_topic)}"
            )
        topic = described[name]
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
        checksum = md5sum(store, topic.type)
        if not checksum:
            raise FerryIdError(
                f"{file}: topic {name} cannot be decoded, found an incomplete definition, without a type that "
                f"{topic.type} is made of. Fix: copy the bag from the recorder again"
            )
        if connection.md5sum not in ("*", checksum):
            what = f"the definition of {topic.type} does not match its checksum: values of {name} may be misread"
            lost.append(Loss(str(file), what, name, 0))
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

    def _decompressed(self, chunks: Sequence[Chunk], verify: bool, unsure: set[int]) -> Iterator[Content]:
        """Yield what each chunk holds, and what is wrong with it."""
        allowance = Allowance.of_file(len(self._data))

        def load(chunk: Chunk) -> Content:
            exact = verify or chunk.walked is not None or chunk.position in unsure
            return decompressed(self._data, chunk, allowance, exact=exact, salvage=not verify)

        slow = any(chunk.compression == "bz2" for chunk in chunks)
        # Chunks ahead of their turn are held in memory too.
        if not slow or any(chunk.size > FREE_CHUNK and chunk.compression != "none" for chunk in chunks):
            yield from map(load, chunks)
            return
        allowance.most = FREE_CHUNK
        with ThreadPoolExecutor(AHEAD) as pool:
            queued: deque[Future[Content]] = deque()
            rest = iter(chunks)
            queued.extend(pool.submit(load, chunk) for chunk in islice(rest, AHEAD))
            while queued:
                yield queued.popleft().result()
                queued.extend(pool.submit(load, chunk) for chunk in islice(rest, 1))

    def _parts(
        self, chunk: Chunk, topic_of: Mapping[int, str], *, check: bool
    ) -> list[tuple[str | None, Entries, NDArray[np.int64]]]:
        """Return topic, index entries and their connections for each wanted topic; with `check` those of None, the others."""
        groups: dict[str | None, list[int]] = {}
        for number in sorted(chunk.connections):
            name = topic_of.get(number)
            if (check or name is not None) and chunk.count(number):
                groups.setdefault(name, []).append(number)
        parts: list[tuple[str | None, Entries, NDArray[np.int64]]] = []
        for name, group in groups.items():
            pieces = [(number, chunk.entries(self._data, number)) for number in group]
            entries = np.concatenate([piece for _, piece in pieces]) if len(pieces) > 1 else pieces[0][1]
            owners = np.concatenate([np.full(len(piece), number) for number, piece in pieces])
            if len(pieces) > 1:
                order = np.argsort(entries[:, 2], kind="stable")
                entries, owners = entries[order], owners[order]
            parts.append((name, entries, owners))
        return parts

    def _decode(
        self,
        chunk: Chunk,
        content: Content,
        messages: Messages,
        decoders: Mapping[str, Decoder],
        topic_of: Mapping[int, str],
        *,
        check: bool,
    ) -> _Tally:
        """Hand the wanted messages of one chunk to their decoders; returns those that are damaged.

        With `check` the messages of the other topics are looked for too, and every byte of the chunk must belong to a
        record that its index records list.
        """
        tally = _Tally()
        parts = self._parts(chunk, topic_of, check=check)
        if not parts and not check:
            return tally
        together = np.concatenate([NO_ENTRIES, *(entries for _, entries, _ in parts)])
        owners = np.concatenate([np.empty(0, np.int64), *(owners for _, _, owners in parts)])
        buffer = content.buffer
        starts, sizes, intact = messages.locate(buffer, together, owners)
        bounds = set(np.cumsum([len(entries) for _, entries, _ in parts]).tolist())
        unique = distinct(starts, bounds)
        covered = not check or (intact is None and covers(buffer, together[:, 2].astype(np.int64), starts + sizes))
        if chunk.walked is None and not (intact is None and unique and covered):
            better = replaced(self._data, chunk, self._walks, intact=intact is None and unique)
            if better is not None:
                whole = Content(better.buffer, "", True)
                tally = self._decode(better.chunk, whole, messages, decoders, topic_of, check=False)
                doubtful = sum(len(one) for number, one in better.doubtful.items() if check or number in topic_of)
                # Messages whose time is in doubt are lost, not repaired.
                tally.repaired = intact is None or not unique or np.count_nonzero(~intact) != doubtful
                for number, entries in better.doubtful.items():
                    if check or number in topic_of:
                        tally.add(nanoseconds(entries), wanted=number in topic_of)
                for number, count in missing(chunk, better.chunk, self._numbers).items():
                    short = count - len(better.doubtful.get(number, ()))
                    if short > 0 and (check or number in topic_of):
                        # Only where the chunk information counts the same are the index records believed.
                        tally.hidden |= chunk.counts != chunk.indexed
                        tally.count += short if number in topic_of and not tally.hidden else 0
                        tally.others += short if number not in topic_of and not tally.hidden else 0
                return tally
            intact = np.ones(len(starts), np.bool_) if intact is None else intact
            first_rows = np.unique(starts, return_index=True)[1]
            intact &= np.isin(np.arange(len(starts)), first_rows)
            tally.hidden = chunk.counts is None
        receive_ns = nanoseconds(together)
        first = 0
        for name, entries, _ in parts:
            here = slice(first, first + len(entries))
            first += len(entries)
            if intact is not None:
                # Messages of connections without a record were reported as lost at opening.
                known = np.isin(owners[here], self._numbers)
                tally.add(receive_ns[here][~intact[here] & known], wanted=name is not None)
            if name is None:
                continue
            if intact is None:
                decoders[name].add(buffer, starts[here], sizes[here], receive_ns[here])
            else:
                good = intact[here]
                decoders[name].add(buffer, starts[here][good], sizes[here][good], receive_ns[here][good])
        return tally

    def _loss(self, chunk: Chunk, fault: str, tally: _Tally) -> Loss:
        known = f"messages of the wanted topics lost in it: {tally.count}"
        if tally.others:
            known += f", of the others: {tally.others}"
        if tally.hidden:
            known += ", and perhaps others that no index record lists"
        return Loss(
            file=str(self.paths[0]),
            what=f"the chunk at byte {chunk.position} is damaged" + (f", {fault}" if fault else "") + f": {known}",
            messages=None if tally.hidden else tally.count + tally.others,
            start_ns=min(tally.times, default=None),
            end_ns=max(tally.times, default=None),
        )

    def _repair(self, chunks: Sequence[Chunk]) -> Loss:
        more = f" and {len(chunks) - 1} more" if len(chunks) > 1 else ""
        what = (
            f"the index records of the chunk at byte {chunks[0].position}{more} contradict it: "
            "its messages were read from the chunk itself"
        )
        return Loss(str(self.paths[0]), what, None, 0)


def _is_empty(store: Any, msgtype: str) -> bool:
    return msgtype in store.fielddefs and all(name == EMPTY_MEMBER for name, _ in store.fielddefs[msgtype][1])


def _mapped(path: Path) -> mmap.mmap:
    with path.open("rb") as file:
        if path.stat().st_size == 0:
            raise FerryIdError(
                f"{path}: the file is empty, a ROS1 bag was expected, found 0 bytes. Fix: copy it from the recorder again"
            )
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
