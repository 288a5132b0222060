"""MCAP files in chunks, byte for byte those of the package mcap, in a quarter of its time.

The package makes an object of every message, and packs each of its numbers by itself. Here a message is packed at once; what
there are few of is left to the package.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import BinaryIO, Protocol

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, Schema, Statistics, SummaryOffset

MAGIC = b"\x89MCAP0\r\n"
MESSAGE = struct.Struct("<BQHIQQ")
"""Opcode, length, channel, sequence, time of receipt and of publication of a message [ns], before its data."""
OPCODE_BYTES = 9
"""Of the opcode and the length before a record."""
CHUNK_BYTES = 1 << 20


class _Record(Protocol):
    def write(self, stream: RecordBuilder) -> object: ...


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
        content = b"".join(self._parts)
        times = [entries[::2] for entries in self._index.values()]
        first, last = min(map(min, times)), max(map(max, times))
        self._span = (first, last) if self._span is None else (min(first, self._span[0]), max(last, self._span[1]))
        for channel, entries in self._index.items():
            self._counts[channel] += len(entries) // 2
        chunk = Chunk(
            compression="zstd",
            data=zstandard.compress(content),
            message_start_time=first,
            message_end_time=last,
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        start, packed = self._file.tell(), _packed([chunk])
        indices = {channel: _index(channel, entries) for channel, entries in self._index.items()}
        self._chunks.append(
            ChunkIndex(
                message_start_time=first,
                message_end_time=last,
                chunk_start_offset=start,
                chunk_length=len(packed),
                message_index_offsets=_places(indices, start + len(packed)),
                message_index_length=sum(map(len, indices.values())),
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=chunk.uncompressed_size,
            )
        )
        self._file.write(b"".join((packed, *indices.values())))
        self._begin()

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
            metadata_count=0,
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
            Opcode.METADATA_INDEX: [],
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
        crc = zlib.crc32(struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start), zlib.crc32(summary))
        footer = Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc)
        self._file.write(summary + _packed([footer]) + MAGIC)


def _index(channel: int, entries: list[int]) -> bytes:
    """Return the record of where in a chunk the messages of a channel are: time and place of each."""
    size = 8 * len(entries)
    return struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, channel, size, *entries)


def _places(records: Mapping[int, bytes], start: int) -> dict[int, int]:
    """Return where each of the records begins that are written after each other."""
    found = {}
    for channel, record in records.items():
        found[channel] = start
        start += len(record)
    return found
