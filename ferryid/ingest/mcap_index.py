"""What the summary section of an MCAP file says: schemas, channels, chunks and their message indexes.

Record layouts are those of the MCAP specification, version 0 (https://mcap.dev/spec).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Schema, Statistics
from numpy.typing import NDArray

from ferryid.ingest.checksum import crc32
from ferryid.ingest.log import Loss, Nanoseconds

MAGIC = b"\x89MCAP0\r\n"
# Opcodes of the specification.
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 1, 2, 3, 4, 5, 6, 7, 8
STATISTICS, DATA_END = 0x0B, 0x0F
LAST_OPCODE = 0x0F
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

record_header: Callable[..., tuple[int, int]] = struct.Struct("<BQ").unpack_from
_chunk_fields: Callable[..., tuple[int, int, int, int]] = struct.Struct("<QQQI").unpack_from
_chunk_index_fields: Callable[..., tuple[int, int, int, int, int]] = struct.Struct("<QQQQI").unpack_from
_index_fields: Callable[..., tuple[int, int, int, int]] = struct.Struct("<BQHI").unpack_from
Bytes = NDArray[np.uint8]
Definition = TypeVar("Definition")


class DamagedRecord(ValueError):
    """A record that contradicts itself or its index; told to the user as a Loss, never raised out of the reader."""


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


@dataclass(frozen=True)
class Chunk:
    """One chunk and what is known of the messages in it.

    Attributes
    ----------
    offset
        Where the chunk record begins in the file.
    start_ns, end_ns
        Log times of its first and last message [ns].
    compression, data_offset, compressed_size, uncompressed_size
        How and where its records are stored. `compressed_size` is what the file holds, less than stated in a
        truncated chunk.
    indexed
        Channel id to (offset of its MessageIndex record, number of messages); None when the file has no index here.
    table
        The messages, found by walking the chunk; None as long as it was not walked.
    truncated
        True for the chunk in which the file ends.
    """

    offset: int
    start_ns: int
    end_ns: int
    compression: str
    data_offset: int
    compressed_size: int
    uncompressed_size: int
    indexed: Mapping[int, tuple[int, int]] | None
    table: Messages | None = None
    truncated: bool = False

    def counts(self) -> dict[int, int]:
        """Return the number of messages per channel id, as far as it is known without reading the chunk."""
        if self.table is not None:
            ids, counts = np.unique(self.table.channels, return_counts=True)
            return {int(key): int(count) for key, count in zip(ids, counts, strict=True)}
        return {key: count for key, (_, count) in (self.indexed or {}).items()}


@dataclass
class Index:
    """Everything known of a file before a message is decoded; filled by `read_summary` or `scan`."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    loose: Messages | None = None
    statistics: Statistics | None = None
    losses: list[Loss] = field(default_factory=list)
    data_end: int = 0

    def define(self, opcode: int, content: Bytes | memoryview) -> None:
        """Take a Schema or Channel record; the first definition of an id stands."""
        if opcode == SCHEMA:
            schema = parsed(Schema.read, content)
            self.schemas.setdefault(schema.id, schema)
        else:
            channel = parsed(Channel.read, content)
            self.channels.setdefault(channel.id, channel)

    def counts(self) -> dict[int, int]:
        """Return the number of messages per channel id that the chunks and the walk show."""
        total: dict[int, int] = {}
        for chunk in self.chunks:
            for key, count in chunk.counts().items():
                total[key] = total.get(key, 0) + count
        if self.loose is not None:
            ids, counts = np.unique(self.loose.channels, return_counts=True)
            for key, count in zip(ids.tolist(), counts.tolist(), strict=True):
                total[key] = total.get(key, 0) + count
        return total


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


def walk(data: memoryview, start: int, stop: int) -> tuple[list[int], list[tuple[int, int, int]], int]:
    """Step from record to record.

    Returns
    -------
    tuple
        Offsets of the message records, (opcode, offset, content length) of all others, and where the walk ended: `stop`
        unless something there is no record.
    """
    messages: list[int] = []
    others: list[tuple[int, int, int]] = []
    found = messages.append
    position = start
    while position + RECORD_HEADER <= stop:
        opcode, length = record_header(data, position)
        behind = position + RECORD_HEADER + length
        if behind > stop:
            break
        if opcode == MESSAGE:
            if length < MESSAGE_HEADER - RECORD_HEADER:
                break
            found(position)
        elif opcode == 0:
            break
        else:
            others.append((opcode, position, length))
        position = behind
    return messages, others, position


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
    if offset + RECORD_HEADER + 40 > len(file):
        raise DamagedRecord("a chunk's header is cut")
    opcode, length = record_header(file, offset)
    start_ns, end_ns, size, crc = _chunk_fields(file, offset + RECORD_HEADER)
    (name_length,) = struct.unpack_from("<I", file, offset + 37)
    data_offset = offset + 49 + name_length
    if opcode != CHUNK or name_length > 64 or data_offset > len(file):
        raise DamagedRecord("a chunk's header is damaged")
    (stored,) = struct.unpack_from("<Q", file, data_offset - 8)
    name = bytes(file[offset + 41 : offset + 41 + name_length])
    if length != 40 + name_length + stored or not name.isascii() or max(start_ns, end_ns) >= 1 << 63:
        raise DamagedRecord("a chunk's header contradicts itself")
    chunk = Chunk(offset, start_ns, end_ns, name.decode("ascii"), data_offset, stored, size, None)
    return chunk, crc, data_offset + stored


def _chunk_from_index(content: memoryview) -> Chunk:
    """Parse a ChunkIndex record. The lengths of the message indexes follow from where the next one begins."""
    start_ns, end_ns, offset, length, size = _chunk_index_fields(content, 0)
    places = sorted((place, channel) for channel, place in struct.iter_unpack("<HQ", content[36 : 36 + size]))
    index_length, name_length = struct.unpack_from("<QI", content, 36 + size)
    name = bytes(content[48 + size : 48 + size + name_length]).decode("ascii")
    stored, unpacked = struct.unpack_from("<QQ", content, 48 + size + name_length)
    ends = [place for place, _ in [*places, (offset + length + index_length, 0)][1:]]
    indexed = {channel: (place, (end - place - 15) // 16) for (place, channel), end in zip(places, ends, strict=True)}
    if length != 49 + name_length + stored or any(count < 0 for _, count in indexed.values()):
        raise DamagedRecord("a chunk index contradicts itself")
    return Chunk(offset, start_ns, end_ns, name, offset + 49 + name_length, stored, unpacked, indexed or None)


def read_summary(file: memoryview) -> Index | None:
    """Read the summary section.

    Returns
    -------
    Index or None
        None where a finished file simply has no summary.

    Raises
    ------
    DamagedRecord
        Where the file does not end as a finished file does, or the summary is damaged.
    """
    footer = len(file) - FOOTER_SIZE
    if footer < len(MAGIC) or file[-len(MAGIC) :] != MAGIC or record_header(file, footer) != (FOOTER, 20):
        raise DamagedRecord("the end of the file is missing")
    start, _, crc = struct.unpack_from("<QQI", file, footer + RECORD_HEADER)
    if start == 0:
        return None
    if not len(MAGIC) <= start <= footer:
        raise DamagedRecord("the footer points nowhere")
    if crc and crc32(file[start : footer + RECORD_HEADER + 16]) != crc:
        raise DamagedRecord("the checksum of the summary is wrong")
    messages, others, end = walk(file, start, footer)
    if end != footer or messages:
        raise DamagedRecord("the summary is damaged")
    index = Index(data_end=start)
    try:
        for opcode, position, length in others:
            content = file[position + RECORD_HEADER : position + RECORD_HEADER + length]
            if opcode in (SCHEMA, CHANNEL):
                index.define(opcode, content)
            elif opcode == CHUNK_INDEX:
                index.chunks.append(_chunk_from_index(content))
            elif opcode == STATISTICS:
                index.statistics = parsed(Statistics.read, content)
    except (struct.error, UnicodeDecodeError) as error:
        raise DamagedRecord(f"a record of the summary cannot be parsed ({error})") from error
    index.chunks.sort(key=lambda chunk: chunk.offset)
    return index


def spans(index: Index, file: memoryview, channels: Iterable[int]) -> dict[int, tuple[int, int]]:
    """Return the first and last log time [ns] of each channel, from as few message indexes as possible."""
    found: dict[int, tuple[int, int]] = {}
    by_start = sorted(index.chunks, key=lambda chunk: chunk.start_ns)
    by_end = sorted(index.chunks, key=lambda chunk: -chunk.end_ns)
    for channel in channels:
        first = last = None
        if index.loose is not None:
            times = index.loose.log_ns[index.loose.channels == channel]
            if len(times):
                first, last = int(times.min()), int(times.max())
        for chunk in by_start:
            if first is not None and chunk.start_ns >= first:
                break
            times = _times(chunk, file, channel)
            if len(times):
                first = int(times.min()) if first is None else min(first, int(times.min()))
        for chunk in by_end:
            if last is not None and chunk.end_ns <= last:
                break
            times = _times(chunk, file, channel)
            if len(times):
                last = int(times.max()) if last is None else max(last, int(times.max()))
        if first is not None and last is not None:
            found[channel] = first, last
    return found


def _times(chunk: Chunk, file: memoryview, channel: int) -> Nanoseconds:
    if chunk.table is not None:
        return chunk.table.take(chunk.table.channels == channel).log_ns
    offset, count = (chunk.indexed or {}).get(channel, (0, 0))
    if not count:
        return np.empty(0, np.int64)
    try:
        entries = index_entries(file, channel, offset, count)
    except DamagedRecord:
        # Found again, and told, when the chunk is read.
        return np.array([chunk.start_ns, chunk.end_ns], np.int64)
    times: Nanoseconds = entries[:, 0]
    return times
