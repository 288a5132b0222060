"""MCAP files in chunks, byte for byte those of the package mcap, in a fraction of its time.

The package makes an object of every message, and packs each of its numbers by itself. Here whole chunks are put together from
columns, or a message is packed at once; what there are few of is left to the package.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import BinaryIO, Protocol

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from ferryid.ingest.checksum import crc32
from ferryid.ingest.formats.mcap import MAGIC

MESSAGE = struct.Struct("<BQHIQQ")
"""Opcode, length, channel, sequence, time of receipt and of publication of a message [ns], before its data."""
HEADER = (
    ("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("receive", "<u8"), ("stamp", "<u8"),
)  # fmt: skip
"""The same as fields of a packed array."""
OPCODE_BYTES = 9
"""Of the opcode and the length before a record."""
CHUNK_BYTES = 1 << 20


class _Record(Protocol):
    def write(self, stream: RecordBuilder) -> object: ...


@dataclass(frozen=True)
class TableSource:
    """Messages of one size, whose bytes `rows` gives from one number to another."""

    channel: int
    receive_ns: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    size: int
    rows: Callable[[int, int], NDArray[np.void]]

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Of every message."""
        return np.full(len(self.receive_ns), self.size, dtype=np.int64)

    def put(self, content: bytearray, places: NDArray[np.int64], first: int, count: int) -> None:
        """Write `count` records of messages from the one with number `first` on to places in a chunk's content."""
        stop = first + count
        records = np.empty(count, np.dtype([*HEADER, ("data", f"V{self.size}")]))
        records["opcode"], records["length"] = Opcode.MESSAGE, MESSAGE.size - OPCODE_BYTES + self.size
        records["channel"], records["sequence"] = self.channel, np.arange(first, stop)
        records["receive"], records["stamp"] = self.receive_ns[first:stop], self.stamp_ns[first:stop]
        records["data"] = self.rows(first, stop)
        # Every window of a record's size over the content, overlapping: whole records are put at once.
        kind = f"V{records.itemsize}"
        windows = np.ndarray((len(content) - records.itemsize + 1,), kind, buffer=content, strides=(1,))
        windows[places] = records.view(kind)


@dataclass(frozen=True)
class BytesSource:
    """Messages that differ in size, one after another."""

    channel: int
    receive_ns: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    sizes: NDArray[np.int64]
    messages: Iterator[bytes]

    def put(self, content: bytearray, places: NDArray[np.int64], first: int, count: int) -> None:
        """Write `count` records of messages from the one with number `first` on to places in a chunk's content."""
        for place, number in zip(places.tolist(), range(first, first + count), strict=True):
            data, size = next(self.messages), int(self.sizes[number])
            if len(data) != size:
                raise ValueError(f"a message has {len(data)} of {size} announced bytes")
            times = int(self.receive_ns[number]), int(self.stamp_ns[number])
            length = MESSAGE.size - OPCODE_BYTES + size
            MESSAGE.pack_into(content, place, Opcode.MESSAGE, length, self.channel, number, *times)
            content[place + MESSAGE.size : place + MESSAGE.size + size] = data


Source = TableSource | BytesSource
"""All messages of a channel."""


def _packed(records: Iterable[_Record]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


class McapFile:
    """A file of messages in chunks that are compressed with Zstandard; it is whole after `finish`.

    Parameters
    ----------
    file
        Open for bytes, at its beginning.
    profile, library
        Of the file's header.
    chunk_bytes
        Size before compression above which a chunk ends.
    """

    def __init__(self, file: BinaryIO, *, profile: str = "", library: str = "", chunk_bytes: int = CHUNK_BYTES) -> None:
        self._file, self._chunk_bytes = file, chunk_bytes
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = defaultdict(int)
        self._span: tuple[int, int] | None = None
        self._begin()
        file.write(MAGIC + _packed([Header(profile, library)]))

    def _begin(self) -> None:
        """Begin a chunk: its bytes so far and their count, and times and places of messages by channel."""
        self._parts: list[bytes] = []
        self._count = 0
        self._index: dict[int, list[int]] = {}

    def register_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Return the number of a new schema."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name))
        self._add(self._schemas[-1])
        return len(self._schemas)

    def register_channel(self, topic: str, message_encoding: str, schema: int) -> int:
        """Return the number of a new channel for messages of a schema."""
        number = len(self._channels) + 1
        self._channels.append(
            Channel(id=number, topic=topic, message_encoding=message_encoding, schema_id=schema, metadata={})
        )
        self._add(self._channels[-1])
        return number

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write texts by their names, which are about the file as a whole."""
        start, written = self._file.tell(), _packed([Metadata(metadata=dict(values), name=name)])
        self._metadata.append(MetadataIndex(offset=start, length=len(written), name=name))
        self._file.write(written)

    def _add(self, record: _Record) -> None:
        self._parts.append(_packed([record]))
        self._count += len(self._parts[-1])

    def add_message(self, channel: int, receive_ns: int, data: bytes, *, stamp_ns: int, sequence: int = 0) -> None:
        """Add a message with its times of receipt and of publication."""
        self._index.setdefault(channel, []).extend((receive_ns, self._count))
        size = len(data)
        self._parts += (
            MESSAGE.pack(Opcode.MESSAGE, MESSAGE.size - OPCODE_BYTES + size, channel, sequence, receive_ns, stamp_ns),
            data,
        )
        self._count += MESSAGE.size + size
        if self._count > self._chunk_bytes:
            self._end_chunk()

    def _end_chunk(self) -> None:
        if not self._index:
            return
        entries = {channel: np.array(found, dtype="<u8").reshape(-1, 2) for channel, found in self._index.items()}
        self._write_chunk(b"".join(self._parts), entries)
        self._begin()

    def add_messages(self, sources: Sequence[Source]) -> None:
        """Add all messages of several channels, as `add_message` would in the order of their times of receipt.

        A chunk is put together from whole columns, and compressed in a thread while the next one is made.
        """
        self._end_chunk()
        receive = np.concatenate([one.receive_ns for one in sources])
        which = np.repeat(np.arange(len(sources)), [len(one.receive_ns) for one in sources])
        order = np.lexsort((which, receive))
        which, receive = which[order], receive[order]
        size = np.concatenate([one.sizes for one in sources])[order] + MESSAGE.size
        ends = np.cumsum(size)
        taken = [0] * len(sources)
        with ThreadPoolExecutor(1) as pool:
            waiting: list[tuple[Future[tuple[bytes, int]], bytes, dict[int, NDArray[np.uint64]]]] = []
            start = 0
            while start < len(order):
                before = int(ends[start] - size[start]) - self._count
                # A chunk ends with the message that makes it too large.
                stop = min(int(np.searchsorted(ends, before + self._chunk_bytes, side="right")) + 1, len(order))
                places = (ends[start:stop] - size[start:stop] - before).astype(np.int64)
                content = bytearray(int(ends[stop - 1]) - before)
                content[: self._count] = b"".join(self._parts)
                first: dict[int, int] = {}
                found = {}
                for number, source in enumerate(sources):
                    rows = np.flatnonzero(which[start:stop] == number)
                    if not len(rows):
                        continue
                    source.put(content, places[rows], taken[number], len(rows))
                    taken[number] += len(rows)
                    entries = np.column_stack([receive[start:stop][rows], places[rows]]).astype("<u8")
                    first[source.channel], found[source.channel] = int(rows[0]), entries
                index = {channel: found[channel] for channel in sorted(found, key=lambda one: first[one])}
                whole = bytes(content)
                waiting.append((pool.submit(_compressed, whole), whole, index))
                if len(waiting) > 1:
                    done, whole, index = waiting.pop(0)
                    self._write_chunk(whole, index, done.result())
                self._begin()
                start = stop
            for done, whole, index in waiting:
                self._write_chunk(whole, index, done.result())

    def _write_chunk(
        self, content: bytes, entries: Mapping[int, NDArray[np.uint64]], packed: tuple[bytes, int] | None = None
    ) -> None:
        """Write a chunk with the index of its messages: time of receipt and place of each, by channel, shape (n, 2)."""
        data, crc = packed or _compressed(content)
        first, last = (
            int(end(one[:, 0].min() if end is min else one[:, 0].max() for one in entries.values()))
            for end in (min, max)
        )
        self._span = (first, last) if self._span is None else (min(first, self._span[0]), max(last, self._span[1]))
        for channel, one in entries.items():
            self._counts[channel] += len(one)
        chunk = Chunk(
            compression="zstd",
            data=data,
            message_start_time=first,
            message_end_time=last,
            uncompressed_crc=crc,
            uncompressed_size=len(content),
        )
        start, written = self._file.tell(), _packed([chunk])
        indices = {channel: _index(channel, one) for channel, one in entries.items()}
        self._chunks.append(
            ChunkIndex(
                message_start_time=first,
                message_end_time=last,
                chunk_start_offset=start,
                chunk_length=len(written),
                message_index_offsets=_places(indices, start + len(written)),
                message_index_length=sum(map(len, indices.values())),
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=chunk.uncompressed_size,
            )
        )
        self._file.write(b"".join((written, *indices.values())))

    def finish(self) -> None:
        """End the last chunk and write what a reader finds its way by."""
        self._end_chunk()
        self._file.write(_packed([DataEnd(0)]))
        first, last = self._span or (0, 0)
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            metadata_count=len(self._metadata),
            message_start_time=first,
            message_end_time=last,
            schema_count=len(self._schemas),
        )
        groups: dict[Opcode, Iterable[_Record]] = {
            Opcode.SCHEMA: self._schemas,
            Opcode.CHANNEL: self._channels,
            Opcode.STATISTICS: [statistics],
            Opcode.CHUNK_INDEX: self._chunks,
            Opcode.ATTACHMENT_INDEX: [],
            Opcode.METADATA_INDEX: self._metadata,
        }
        start, summary, offsets = self._file.tell(), b"", []
        for opcode, records in groups.items():
            group = _packed(records)
            offsets.append(
                SummaryOffset(group_opcode=opcode, group_start=start + len(summary), group_length=len(group))
            )
            summary += group
        offset_start = start + len(summary)
        summary += _packed(offsets)
        crc = crc32(struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start), crc32(summary))
        footer = Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc)
        self._file.write(summary + _packed([footer]) + MAGIC)


def _compressed(content: bytes) -> tuple[bytes, int]:
    """Return a chunk's content compressed, and its checksum."""
    return zstandard.compress(content), crc32(content)


def _index(channel: int, entries: NDArray[np.uint64]) -> bytes:
    """Return the record of where in a chunk the messages of a channel are: time and place of each."""
    size = entries.nbytes
    return struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + size, channel, size) + entries.tobytes()


def _places(records: Mapping[int, bytes], start: int) -> dict[int, int]:
    """Return where each of the records begins that are written after each other."""
    found = {}
    for channel, record in records.items():
        found[channel] = start
        start += len(record)
    return found
