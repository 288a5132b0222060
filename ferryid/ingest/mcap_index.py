"""Records of an MCAP file: their layouts, chunks and message indexes, and what is known of a file before it is read.

Record layouts are those of the MCAP specification, version 0 (https://mcap.dev/spec).
"""

from __future__ import annotations

import struct
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Schema, Statistics
from numpy.typing import NDArray

from ferryid.cached import cached_property
from ferryid.ingest.formats.mcap import MAGIC
from ferryid.ingest.log import Loss
from ferryid.types import Nanoseconds

# Opcodes of the specification.
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 1, 2, 3, 4, 5, 6, 7, 8
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)
LAST_OPCODE = 0x0F
PRIVATE = 0x80
"""Kinds of records from here on belong to applications."""
RECORD_HEADER = 9
"""Opcode and length before the content of every record [bytes]."""
MESSAGE_HEADER = 31
"""Record header, channel id, sequence, log time and publish time before the data of a message [bytes]."""
MESSAGE_FIELDS = np.dtype(
    [
        ("op", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log", "<u8"),
        ("publish", "<u8"),
    ]
)
FOOTER_SIZE = RECORD_HEADER + 20 + len(MAGIC)
# Least content of every kind of record [bytes], by opcode. No record has the opcode 0; unknown kinds may be empty.
_LEAST = (1 << 64, 8, 20, 14, 16, 22, 40, 6, 64, 36, 48, 46, 8, 20, 17, 4, *[0] * 240)
LEAST_WALK = 4096
"""Records of a chunk that are walked whatever its size in the file, as long as the file has them to spare."""
SPARE_RECORDS = 1 << 20
MAX_CHANNELS = 10_000
"""Channels of a file, as many as connections of a ROS 1 bag: far more than any vessel records."""
LATEST_NS = (1 << 63) - 1
"""Times are unsigned in the file; from 2**63 ns on (the year 2262) they cannot be represented here."""

FEW = 64
"""Fewer messages are counted faster one by one."""

record_header: Callable[..., tuple[int, int]] = struct.Struct("<BQ").unpack_from
_chunk_fields: Callable[..., tuple[int, int, int, int]] = struct.Struct("<QQQI").unpack_from
_index_fields: Callable[..., tuple[int, int, int, int]] = struct.Struct("<BQHI").unpack_from
Bytes = NDArray[np.uint8]
Definition = TypeVar("Definition")


class DamagedRecord(ValueError):
    """A record that contradicts itself or its index; reported to the user as a Loss, never raised out of the reader."""


class ExcessError(Exception):
    """More of something than a recorder writes: the file is refused."""


@dataclass(frozen=True)
class Messages:
    """Where messages lie in a buffer: data offsets and sizes [bytes], channel ids and log times [ns], each (n,)."""

    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]
    channels: NDArray[np.uint16]
    log_ns: Nanoseconds

    def __len__(self) -> int:
        return len(self.starts)

    def take(self, rows: Any) -> Messages:
        """Return the selected rows (mask, slice or indices)."""
        return Messages(self.starts[rows], self.sizes[rows], self.channels[rows], self.log_ns[rows])

    def by_channel(self, wanted: Collection[int]) -> dict[int, Messages]:
        """Return the messages of the wanted channels that have any, each in the order of this table."""
        if not len(self):
            return {}
        first = int(self.channels[0])
        if (self.channels == first).all():
            return {first: self} if first in wanted else {}
        order = np.argsort(self.channels, kind="stable")
        ids, firsts = np.unique(self.channels[order], return_index=True)
        stops = [*firsts[1:].tolist(), len(self)]
        return {
            channel: self.take(order[first:stop])
            for channel, first, stop in zip(ids.tolist(), firsts.tolist(), stops, strict=True)
            if channel in wanted
        }

    @cached_property
    def counts(self) -> dict[int, int]:
        """Number of messages per channel id."""
        if len(self) < FEW:
            return dict(Counter(self.channels.tolist()))
        ids, counts = np.unique(self.channels, return_counts=True)
        return dict(zip(ids.tolist(), counts.tolist(), strict=True))


@dataclass(frozen=True)
class Chunk:
    """One chunk and what is known of the messages in it.

    Attributes
    ----------
    offset
        Where the chunk record begins in the file.
    start_ns, end_ns
        Log times of its first and last message [ns], at most `LATEST_NS`.
    compression, data_offset, compressed_size, uncompressed_size
        How and where its records are stored. `compressed_size` is what the file holds, less than stated in a
        truncated chunk.
    indexed
        Channel id to (offset of its MessageIndex record, number of messages); None when the file has no index here.
    partial_index
        Channel id to number of messages by MessageIndex records behind the chunk that are damaged or perhaps not all;
        then `indexed` is None.
    table
        The messages, found by walking the chunk; None as long as it was not walked.
    truncated
        True for the chunk in which the file ends.
    refused
        True for a chunk that would take the file past the bound on what is decompressed of it.
    checksummed
        True in a walked file most chunks of which have a checksum: one of zero is damage there, and not left out.
    """

    offset: int
    start_ns: int
    end_ns: int
    compression: str
    data_offset: int
    compressed_size: int
    uncompressed_size: int
    indexed: Mapping[int, tuple[int, int]] | None
    partial_index: Mapping[int, int] = field(default_factory=dict)
    table: Messages | None = None
    truncated: bool = False
    refused: bool = False
    checksummed: bool = False

    def counts(self) -> dict[int, int]:
        """Return the number of messages per channel id, as far as it is known without reading the chunk."""
        if self.table is not None:
            return self.table.counts
        return {key: count for key, (_, count) in (self.indexed or {}).items()}

    def every(self, file: memoryview) -> NDArray[np.int64]:
        """Return where the message indexes have the messages of all channels in the chunk, ascending, shape (n,).

        Raises
        ------
        DamagedRecord
            Where a MessageIndex record is damaged.
        """
        parts = [index_entries(file, key, *place)[:, 1] for key, place in (self.indexed or {}).items()]
        return np.sort(np.concatenate([*parts, np.empty(0, np.int64)]))


@dataclass
class Walks:
    """Records that walks over the chunks of a file may take beyond one for every byte that a chunk takes up in the file.

    Attributes
    ----------
    spare
        What is left for the whole file.
    """

    spare: int = field(default_factory=lambda: SPARE_RECORDS)

    def limit(self, stored: int) -> int:
        """Return how many records a walk over a chunk of `stored` bytes may take."""
        return stored + min(max(self.spare, 0), LEAST_WALK)

    def take(self, records: int, stored: int) -> None:
        """Count the records that were taken from a chunk of `stored` bytes."""
        self.spare -= max(records - stored, 0)


@dataclass
class Index:
    """Everything known of a file before a message is decoded; filled by `read_summary` or `scan`.

    Attributes
    ----------
    schemas, channels
        Definitions by id.
    chunks
        In file order.
    loose
        Messages outside chunks, in file order; None where there are none.
    statistics
        The Statistics record, where it is possible.
    losses
        What is known to be lost or contradictory.
    data_end
        Where the DataEnd record, or the summary, begins [bytes].
    conflicts
        Ids that are defined in several ways, as sentences.
    complete
        True where the statistics count exactly the messages that were found; otherwise every chunk is held against
        its index when it is read.
    contradiction
        In what the chunks that the summary lists and the file contradict each other, None where they agree.
    walks
        Bounds how many records of chunks are walked.
    votes
        How many records state each definition, by kind and id.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    loose: Messages | None = None
    statistics: Statistics | None = None
    losses: list[Loss] = field(default_factory=list)
    data_end: int = 0
    conflicts: list[str] = field(default_factory=list)
    complete: bool = False
    contradiction: str | None = None
    walks: Walks = field(default_factory=Walks)
    votes: dict[tuple[type, int], dict[tuple[Any, ...], int]] = field(default_factory=dict)

    def define(self, opcode: int, content: Bytes | memoryview) -> None:
        """Take a Schema or Channel record; of several definitions of an id that of most records stands, or the first.

        Raises
        ------
        DamagedRecord
            Where the content does not make such a record.
        """
        self.add(definition(opcode, content))

    def add(self, definition: Schema | Channel) -> None:
        """Take a definition; one that contradicts an earlier one of the same id is noted in `conflicts`."""
        known: dict[int, Any] = self.schemas if isinstance(definition, Schema) else self.channels
        votes = self.votes.setdefault((type(definition), definition.id), {})
        stated = _stated(definition)
        votes[stated] = votes.get(stated, 0) + 1
        conflict = self.conflict(definition)
        if conflict:
            self.conflicts.append(conflict)
        if conflict and votes[stated] > votes.get(_stated(known[definition.id]), 0):
            known[definition.id] = definition
        else:
            known.setdefault(definition.id, definition)
            if len(self.channels) > MAX_CHANNELS:
                raise ExcessError(f"it holds more than {MAX_CHANNELS} channels, which no vessel records")

    def conflict(self, definition: Schema | Channel) -> str:
        """Say what in a definition contradicts the known one of the same id; an empty string where nothing does."""
        if isinstance(definition, Schema):
            schema = self.schemas.get(definition.id, definition)
            if _stated(schema) == _stated(definition):
                return ""
            known, new = repr(schema.name), repr(definition.name)
        else:
            stated = [_stated(one) for one in (self.channels.get(definition.id, definition), definition)]
            if stated[0] == stated[1]:
                return ""
            known, new = (f"{topic!r} with schema {schema} in {encoding!r}" for topic, schema, encoding in stated)
        kind = "schema" if isinstance(definition, Schema) else "channel"
        return f"{kind} {definition.id} is defined as {known} and as {new}: what more records state stands for all messages"

    def counts(self) -> dict[int, int]:
        """Return the number of messages per channel id that the chunks and the walk show."""
        total: dict[int, int] = {}
        for chunk in self.chunks:
            for key, count in chunk.counts().items():
                total[key] = total.get(key, 0) + count
        if self.loose is not None:
            for key, count in self.loose.counts.items():
                total[key] = total.get(key, 0) + count
        return total


def _stated(definition: Schema | Channel) -> tuple[Any, ...]:
    """Return what a definition says of its id."""
    if isinstance(definition, Schema):
        return definition.name, definition.encoding, definition.data
    return definition.topic, definition.schema_id, definition.message_encoding


def definition(opcode: int, content: Bytes | memoryview) -> Schema | Channel:
    """Parse a Schema or Channel record.

    Raises
    ------
    DamagedRecord
        Where the content does not make one.
    """
    found: Schema | Channel = parsed(Schema.read, content) if opcode == SCHEMA else parsed(Channel.read, content)
    return found


def parsed(read: Callable[[ReadDataStream], Definition], content: Bytes | memoryview) -> Definition:
    """Parse one record with the mcap package.

    Raises
    ------
    DamagedRecord
        Where the content does not make a record.
    """
    try:
        return read(ReadDataStream(BytesIO(bytes(content))))
    except (McapError, struct.error, ValueError, MemoryError, OverflowError) as error:
        raise DamagedRecord(f"a record cannot be parsed ({error or type(error).__name__})") from error


def walk(
    data: memoryview, start: int, stop: int, limit: int | None = None
) -> tuple[array[int], list[tuple[int, int, int]], int]:
    """Step from record to record.

    Parameters
    ----------
    data
        Bytes that hold records.
    start, stop
        Where the first record begins and the last one ends at most.
    limit
        Records after which the walk ends; by default as many as there are.

    Returns
    -------
    tuple
        Offsets of the message records, (opcode, offset, content length) of all others, and where the walk ended: `stop`
        unless something there is no record. Neighbouring records of unknown kinds are given as one.
    """
    messages = array("q")
    others: list[tuple[int, int, int]] = []
    found = messages.append
    position = start
    last = stop - RECORD_HEADER
    for _ in range((stop - start) // RECORD_HEADER if limit is None else limit):
        if position > last:
            break
        opcode, length = record_header(data, position)
        behind = position + RECORD_HEADER + length
        if behind > stop or length < _LEAST[opcode]:
            break
        if opcode == MESSAGE:
            found(position)
        elif opcode == CHUNK and not sound_chunk(data, position):
            break
        elif opcode > LAST_OPCODE and others and others[-1][0] > LAST_OPCODE and _end(others[-1]) == position:
            others[-1] = (*others[-1][:2], behind - others[-1][1] - RECORD_HEADER)
        else:
            others.append((opcode, position, length))
        position = behind
    return messages, others, position


def _end(record: tuple[int, int, int]) -> int:
    return record[1] + RECORD_HEADER + record[2]


def sound_chunk(data: memoryview, offset: int) -> bool:
    """Tell whether the header of a chunk at `offset` agrees with itself."""
    try:
        chunk_at(data, offset)
    except DamagedRecord:
        return False
    return True


def message_table(buffer: Bytes, offsets: NDArray[np.int64]) -> tuple[Messages, NDArray[np.uint8]]:
    """Gather the headers of the message records at `offsets`; returns them and the opcodes found there.

    Raises
    ------
    DamagedRecord
        For an offset that lies outside the buffer.
    """
    room = len(buffer) - MESSAGE_HEADER + 1
    if len(offsets) == 0:
        empty = np.empty(0, np.int64)
        return Messages(empty, empty, empty.astype(np.uint16), empty), empty.astype(np.uint8)
    if room <= 0 or int(offsets.min()) < 0 or int(offsets.max()) >= room:
        raise DamagedRecord("a message index points outside its chunk")
    # Whole headers through an overlapping void view: copied at memcpy speed, then split into fields.
    headers = np.ndarray((room,), f"V{MESSAGE_HEADER}", buffer, strides=(1,))[offsets].view(MESSAGE_FIELDS)
    sizes = headers["length"].astype(np.int64) - (MESSAGE_HEADER - RECORD_HEADER)
    return (
        Messages(
            offsets + MESSAGE_HEADER,
            sizes,
            headers["channel"].astype(np.uint16),
            headers["log"].astype(np.int64),
        ),
        headers["op"].copy(),
    )


def index_entries(file: memoryview, channel: int, offset: int, count: int) -> NDArray[np.int64]:
    """Return (log time [ns], offset in the chunk) of one channel's messages in one chunk, shape (n, 2).

    Raises
    ------
    DamagedRecord
        Where the MessageIndex record is not what the summary says.
    """
    if offset + 15 + 16 * count > len(file):
        raise DamagedRecord("a message index lies outside the file")
    opcode, length, found, size = _index_fields(file, offset)
    if opcode != MESSAGE_INDEX or found != channel or size != 16 * count or length < 6 + size:
        raise DamagedRecord("a message index record is damaged")
    return np.frombuffer(file, "<i8", 2 * count, offset + 15).reshape(count, 2)


def chunk_at(file: memoryview, offset: int) -> tuple[Chunk, int, int]:
    """Parse the header of a chunk record; returns the chunk, its CRC and where its record ends (perhaps past the file).

    Raises
    ------
    DamagedRecord
        Where the header contradicts itself.
    """
    chunk = lenient_chunk(file, offset)
    end = chunk.data_offset + chunk.compressed_size
    if record_header(file, offset)[1] != end - offset - RECORD_HEADER:
        raise DamagedRecord("a chunk's header contradicts itself")
    return chunk, stored_crc(file, offset), end


def lenient_chunk(file: memoryview, offset: int) -> Chunk:
    """Parse the header of a chunk record that may state two different sizes.

    Raises
    ------
    DamagedRecord
        Where no such header can be there.
    """
    if offset + RECORD_HEADER + 40 > len(file):
        raise DamagedRecord("a chunk's header is cut")
    start_ns, end_ns, size, _ = _chunk_fields(file, offset + RECORD_HEADER)
    (name_length,) = struct.unpack_from("<I", file, offset + 37)
    data_offset = offset + 49 + name_length
    if file[offset] != CHUNK or name_length > 64 or data_offset > len(file):
        raise DamagedRecord("a chunk's header is damaged")
    (stored,) = struct.unpack_from("<Q", file, data_offset - 8)
    name = bytes(file[offset + 41 : offset + 41 + name_length])
    if not name.isascii():
        raise DamagedRecord("a chunk's header is damaged")
    times = min(start_ns, LATEST_NS), min(end_ns, LATEST_NS)
    return Chunk(offset, *times, name.decode("ascii"), data_offset, stored, size, None)


def stored_crc(file: memoryview, offset: int) -> int:
    """Return the checksum that the chunk at `offset` states, whatever else of its header is damaged; 0 for none."""
    if offset + RECORD_HEADER + 28 > len(file) or file[offset] != CHUNK:
        return 0
    return _chunk_fields(file, offset + RECORD_HEADER)[3]
