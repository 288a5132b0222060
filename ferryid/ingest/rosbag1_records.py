"""Records of a ROS1 bag (format 2.0): its index, and the walk that stands in for a missing one.

Reference: http://wiki.ros.org/Bags/Format/2.0
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
# A record header holds a few names, a topic among them; anything longer is damage.
MAX_HEADER = 1 << 16
MAX_HEADER_FIELDS = 32
# Headers of index and message records are short; a longer one is parsed each time, so that nothing of it is kept.
MAX_KEPT_HEADER = 256
# A connection record holds one message definition. Far above what a recorder writes: damage, or made to cost memory.
MAX_CONNECTION_BYTES = 4 << 20
MAX_CONNECTIONS = 10_000
MAX_CHUNKS = 1_000_000
# Index entries, shape (n, 3): seconds and nanoseconds of the receive time, place of the record in its chunk.
Entries = NDArray[np.uint32]
NO_ENTRIES: Entries = np.empty((0, 3), np.uint32)
COMPRESSIONS = ("none", "bz2", "lz4")

_U32 = struct.Struct("<I").unpack_from


class RecordError(Exception):
    """Bytes that are no record of a bag."""


class Record(NamedTuple):
    """One record: its header fields and where its data lies [bytes]; `end` may be behind a truncated file's end."""

    position: int
    fields: Mapping[bytes, bytes]
    start: int
    end: int

    @property
    def op(self) -> int:
        """Kind of the record."""
        return self.fields[b"op"][0]

    def number(self, name: bytes) -> int:
        """Return an unsigned header field of four or eight bytes."""
        value = self.fields.get(name, b"")
        if len(value) not in (4, 8):
            raise RecordError(f"no {name.decode()} in the record at byte {self.position}")
        return int.from_bytes(value, "little")


@dataclass(frozen=True)
class Connection:
    """One publisher of one topic: its message type and that type's definition."""

    number: int
    topic: str
    msgtype: str
    md5sum: str
    definition: str


@dataclass(slots=True)
class Chunk:
    """One chunk of messages.

    Attributes
    ----------
    position
        Byte at which its record begins.
    start, end
        Its stored bytes; `end` is behind the end of a truncated file.
    compression
        ``"none"``, ``"bz2"`` or ``"lz4"``.
    size
        Bytes when decompressed.
    index
        Connection number to (byte of the first index entry, number of entries).
    walked
        Connection number to entries found in the chunk itself; None for a chunk that is read by its index.
    counts
        Connection number to number of messages, from the chunk information record; None where there is none.
    start_ns, end_ns
        Receive times of its messages [ns], None where no chunk information record holds them.
    """

    position: int
    start: int
    end: int
    compression: str
    size: int
    index: dict[int, tuple[int, int]] = field(default_factory=dict)
    start_ns: int | None = None
    end_ns: int | None = None
    walked: dict[int, Entries] | None = None
    counts: dict[int, int] | None = None

    def count(self, connection: int) -> int:
        """Number of messages of one connection."""
        if self.walked is not None:
            return len(self.walked.get(connection, ()))
        return self.index.get(connection, (0, 0))[1]

    def entries(self, data: Any, connection: int) -> Entries:
        """Receive time and place in the decompressed chunk of every message of one connection, shape (n,)."""
        if self.walked is not None:
            return self.walked.get(connection, NO_ENTRIES)
        first, count = self.index.get(connection, (0, 0))
        return np.frombuffer(data, "<u4", 3 * count, first).reshape(count, 3)

    @property
    def connections(self) -> frozenset[int]:
        """Connections with messages in the chunk."""
        return frozenset(self.index if self.walked is None else self.walked)

    @property
    def indexed(self) -> dict[int, int]:
        """Connection number to number of messages by the index records, without connections that have none."""
        return {number: count for number, (_, count) in self.index.items() if count}


def nanoseconds(entries: Entries) -> NDArray[np.int64]:
    """Return the receive times of index entries [ns], shape (n,)."""
    times: NDArray[np.int64] = entries[:, 0].astype(np.int64) * 1_000_000_000 + entries[:, 1]
    return times


class Records:
    """Parses records; a header like one seen before (as all index records) is compared with it, not parsed."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self._size = len(data)
        # Length of a header to its bytes with the values masked, that mask, and where the values lie.
        self._seen: dict[int, tuple[int, int, tuple[tuple[bytes, int, int], ...]]] = {}

    def at(self, position: int) -> Record:
        """Parse the record that begins at a byte.

        Raises
        ------
        RecordError
            Where the bytes are no record, or the data ends within its header.
        """
        if position + 4 > self._size:
            raise RecordError(f"the data ends at byte {self._size}, in a record header")
        length = _U32(self.data, position)[0]
        stop = position + 4 + length
        if length > MAX_HEADER or stop + 4 > self._size:
            raise RecordError(f"no record header at byte {position}")
        header = bytes(self.data[position + 4 : stop])
        seen = self._seen.get(length)
        if seen is not None and int.from_bytes(header, "little") & seen[1] == seen[0]:
            fields = {name: header[start:end] for name, start, end in seen[2]}
        else:
            fields = self._parsed(header, position)
        return Record(position, fields, stop + 4, stop + 4 + _U32(self.data, stop)[0])

    def kind(self, position: int) -> int:
        """Return the kind of the record at a byte, 0 where none is."""
        try:
            return self.at(position).op
        except RecordError:
            return 0

    def _parsed(self, header: bytes, position: int) -> dict[bytes, bytes]:
        spans: list[tuple[bytes, int, int]] = []
        mask = bytearray(b"\xff" * len(header))
        cursor = 0
        while cursor < len(header):
            size = _U32(header, cursor)[0] if cursor + 4 <= len(header) else 0
            start, end = cursor + 4, cursor + 4 + size
            name, equals, value = header[start:end].partition(b"=")
            if not equals or end > len(header) or len(spans) >= MAX_HEADER_FIELDS:
                raise RecordError(f"no header fields in the record at byte {position}")
            spans.append((name, end - len(value), end))
            mask[end - len(value) : end] = bytes(len(value))
            cursor = end
        fields = {name: header[start:end] for name, start, end in spans}
        if len(fields.get(b"op", b"")) != 1:
            raise RecordError(f"no kind of record at byte {position}")
        if len(header) <= MAX_KEPT_HEADER:
            kept = int.from_bytes(mask, "little")
            self._seen[len(header)] = int.from_bytes(header, "little") & kept, kept, tuple(spans)
        return fields


def connection_of(data: Any, record: Record) -> Connection:
    """Read a connection record."""
    if record.end - record.start > MAX_CONNECTION_BYTES or record.end > len(data):
        raise RecordError(f"a connection of {counted(record.end - record.start, 'byte')} at byte {record.position}")
    inner: dict[bytes, bytes] = {}
    cursor, stop = record.start, record.end
    while cursor + 4 <= stop:
        size = _U32(data, cursor)[0]
        field_end = cursor + 4 + size
        name, equals, value = (
            bytes(data[cursor + 4 : field_end]).partition(b"=") if field_end <= stop else (b"", b"", b"")
        )
        if not equals:
            raise RecordError(f"no connection in the record at byte {record.position}")
        inner[name] = value
        cursor = field_end
    if cursor != stop:
        raise RecordError(f"a connection of another size in the record at byte {record.position}")
    try:
        topic = (record.fields.get(b"topic") or inner[b"topic"]).decode()
        msgtype, md5sum = inner[b"type"].decode(), inner[b"md5sum"].decode()
        definition = inner[b"message_definition"].decode(errors="replace")
    except (KeyError, UnicodeDecodeError) as error:
        raise RecordError(f"no connection in the record at byte {record.position}") from error
    return Connection(record.number(b"conn"), topic, msgtype, md5sum, definition)


def chunk_of(record: Record) -> Chunk:
    """Read the header of a chunk record."""
    compression = record.fields.get(b"compression", b"").decode(errors="replace")
    return Chunk(record.position, record.start, record.end, compression, record.number(b"size"))


def note_index(data: Any, chunk: Chunk, record: Record) -> str:
    """Add an index record to the chunk that it follows; returns what contradicts those before it, or nothing."""
    count, connection = record.number(b"count"), record.number(b"conn")
    if record.number(b"ver") != 1 or record.end - record.start != 12 * count or record.end > len(data):
        raise RecordError(f"index record of another size or version at byte {record.position}")
    if connection in chunk.index:
        return f"a second index record for connection {connection} at byte {record.position}"
    chunk.index[connection] = record.start, count
    return ""


class ChunkInfo(NamedTuple):
    """One chunk information record: times [ns] None where it has none; `records` index records follow the chunk."""

    position: int
    chunk: int
    records: int
    counts: dict[int, int]
    start_ns: int | None
    end_ns: int | None

    def note_on(self, chunk: Chunk) -> None:
        """Add counts and times to the chunk."""
        chunk.counts = self.counts
        if self.counts:
            chunk.start_ns, chunk.end_ns = self.start_ns, self.end_ns


def info_of(data: Any, record: Record) -> ChunkInfo:
    """Read a chunk information record."""
    count = record.number(b"count")
    if record.number(b"ver") != 1 or record.end - record.start != 8 * count or record.end > len(data):
        raise RecordError(f"chunk information of another size or version at byte {record.position}")
    pairs = np.frombuffer(data, "<u4", 2 * count, record.start).tolist()
    counts = {number: messages for number, messages in zip(pairs[::2], pairs[1::2], strict=True) if messages}
    if len(set(pairs[::2])) != count:
        raise RecordError(f"chunk information that lists a connection twice at byte {record.position}")
    times = [record.fields.get(name, b"") for name in (b"start_time", b"end_time")]
    start_ns, end_ns = (
        _U32(time, 0)[0] * 1_000_000_000 + _U32(time, 4)[0] if len(time) == 8 else None for time in times
    )
    return ChunkInfo(record.position, record.number(b"chunk_pos"), count, counts, start_ns, end_ns)


def read_index(records: Records) -> tuple[list[Connection], list[Chunk]]:
    """Read connections and chunks by the index at the file's end.

    The counts of the bag header, the chunk information records and the index records must agree, and chunks with
    their index records must follow each other without a gap: a damaged byte in any of them is found here.

    Raises
    ------
    RecordError
        Where the bag has no index, or a damaged one.
    """
    data = records.data
    header = records.at(len(MAGIC))
    index = position = header.number(b"index_pos")
    if header.op != BAG_HEADER:
        raise RecordError("no bag header")
    if position == 0 or position > len(data):
        raise RecordError("the bag was not closed" if position == 0 else "the index lies behind the end of the file")
    connections: dict[int, Connection] = {}
    for _ in range(header.number(b"conn_count")):
        record = records.at(position)
        if record.op != CONNECTION or record.end > len(data) or len(connections) == MAX_CONNECTIONS:
            raise RecordError(f"no connection at byte {position}")
        connection = connection_of(data, record)
        if connection.number in connections:
            raise RecordError(f"a second connection {connection.number} at byte {position}")
        connections[connection.number] = connection
        position = record.end
    chunks: list[Chunk] = []
    places: list[tuple[int, int]] = []
    for _ in range(header.number(b"chunk_count")):
        record = records.at(position)
        if record.op != CHUNK_INFO or record.end > len(data) or len(chunks) == MAX_CHUNKS:
            raise RecordError(f"no chunk information at byte {position}")
        chunk, end = _indexed_chunk(records, info_of(data, record))
        if not chunk.index.keys() <= connections.keys():
            raise RecordError(f"a connection of the chunk at byte {chunk.position} has no record")
        chunks.append(chunk)
        places.append((chunk.position, end))
        position = record.end
    if position != len(data):
        raise RecordError(f"the bag header counts fewer records than there are, the last at byte {position}")
    expected = header.end
    for first, end in sorted(places):
        if first != expected:
            raise RecordError(f"no chunk of the index begins at byte {expected}")
        expected = end
    if expected != index:
        raise RecordError(f"no chunk of the index begins at byte {expected}")
    return list(connections.values()), chunks


def _indexed_chunk(records: Records, info: ChunkInfo) -> tuple[Chunk, int]:
    """Return a chunk with its index records, and where the last of them ends."""
    record = records.at(info.chunk)
    if record.op != CHUNK or record.end > len(records.data):
        raise RecordError(f"no chunk at byte {record.position}")
    chunk = chunk_of(record)
    info.note_on(chunk)
    position = record.end
    for _ in range(info.records):
        record = records.at(position)
        if record.op != INDEX:
            raise RecordError(f"no index record at byte {position}")
        contradiction = note_index(records.data, chunk, record)
        if contradiction:
            raise RecordError(contradiction)
        position = record.end
    if chunk.indexed != info.counts:
        raise RecordError(f"the index records of the chunk at byte {chunk.position} contradict its counts")
    return chunk, position
