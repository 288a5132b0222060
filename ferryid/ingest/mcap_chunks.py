"""The content of one MCAP chunk: decompressed as far as needed, checked, walked, and what is damaged told."""

from __future__ import annotations

import threading
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import lz4.frame
import numpy as np
import zstandard

from ferryid.ingest.checksum import crc32
from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_index import (
    RECORD_HEADER,
    Bytes,
    Chunk,
    DamagedRecord,
    Messages,
    chunk_at,
    index_entries,
    message_table,
    walk,
)

MAX_CHUNK = 4 << 30
"""A chunk that claims more bytes than this is damaged (the mcap package has the same limit)."""
_thread = threading.local()


class Unpacker:
    """Decompresses a chunk from its beginning, as far as it is asked, into `room` if that is given."""

    def __init__(self, file: memoryview, chunk: Chunk, room: Bytes | None = None) -> None:
        if chunk.compression not in ("zstd", "lz4"):
            raise DamagedRecord(f"a chunk has the unknown compression {chunk.compression!r}")
        if chunk.uncompressed_size > MAX_CHUNK:
            raise DamagedRecord("a chunk claims an impossible size")
        self._source = file[chunk.data_offset : chunk.data_offset + chunk.compressed_size]
        self._size = chunk.uncompressed_size
        self._room = room
        self._have = 0
        self._taken = 0
        self._zstd: Any = None
        self._lz4: Any = None
        if chunk.compression == "zstd":
            # A stream reader that is given room for the whole frame decompresses straight into it.
            if not hasattr(_thread, "zstd"):
                _thread.zstd = zstandard.ZstdDecompressor()
            self._zstd = _thread.zstd.stream_reader(self._source, read_across_frames=True)
        else:
            self._lz4 = lz4.frame.create_decompression_context()

    def upto(self, size: int) -> Bytes:
        """Return the first `size` bytes, fewer only where the compressed data end before.

        Raises
        ------
        DamagedRecord
            For data that cannot be decompressed.
        """
        size = min(size, self._size)
        try:
            if self._room is None and self._lz4 is not None and self._have == 0 and size == self._size:
                # The whole chunk in the memory that lz4 allocates: no copy.
                piece, _, _ = lz4.frame.decompress_chunk(self._lz4, self._source, max_length=size)
                self._room = np.frombuffer(piece, np.uint8)
                self._have = len(piece)
            if self._room is None:
                self._room = np.empty(self._size, np.uint8)
            while self._have < size:
                got = self._more(self._room, size)
                if not got:
                    break
                self._have += got
        except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError) as error:
            raise DamagedRecord("a chunk cannot be decompressed") from error
        return self._room[: min(size, self._have)]

    def _more(self, room: Bytes, size: int) -> int:
        if self._zstd is not None:
            return int(self._zstd.readinto(room[self._have : size].data))
        if self._taken >= len(self._source):
            return 0
        piece, taken, _ = lz4.frame.decompress_chunk(
            self._lz4, self._source[self._taken :], max_length=size - self._have
        )
        self._taken += taken
        room[self._have : self._have + len(piece)] = np.frombuffer(piece, np.uint8)
        return len(piece)


@dataclass(frozen=True)
class Loaded:
    """Wanted messages: per channel id where they lie in `buffer`, in file order, and what was lost."""

    buffer: Bytes
    messages: Mapping[int, Messages]
    losses: tuple[Loss, ...]


def load_carefully(
    file: memoryview,
    whole_file: Bytes,
    chunk: Chunk,
    wanted: Collection[int],
    name: str,
    topics: Mapping[int, str],
    reason: str,
) -> Loaded:
    """Read the wanted messages of a chunk that contradicts its index: all of it, checked and walked.

    Parameters
    ----------
    file, whole_file
        The same bytes of the file as a memoryview and as an array.
    wanted
        Channel ids.
    name, topics
        File name and topic per channel id, for losses.
    reason
        What is wrong with the chunk.
    """
    try:
        crc = 0 if chunk.truncated else chunk_at(file, chunk.offset)[1]
    except DamagedRecord:
        # The summary repeats all of the header but the checksum.
        crc = 0
    try:
        data = content(file, whole_file, chunk, crc)
    except DamagedRecord as error:
        return Loaded(whole_file[:0], {}, tuple(_lost(file, chunk, wanted, name, topics, str(error))))
    table, _, end = walk_table(data)
    kept = {channel: table.take(table.channels == channel) for channel in wanted}
    kept = {channel: messages for channel, messages in kept.items() if len(messages)}
    losses = _lost(file, chunk, wanted, name, topics, reason, kept)
    if not losses and end == len(data):
        losses = [_loss(name, f"{reason}; the chunk was walked instead", chunk, 0)]
    elif not losses:
        losses = [_loss(name, reason, chunk, None)]
    return Loaded(data, kept, tuple(losses))


def content(file: memoryview, whole_file: Bytes, chunk: Chunk, crc: int, room: Bytes | None = None) -> Bytes:
    """Return the whole content of a chunk, checked, or what is there of a truncated one.

    Raises
    ------
    DamagedRecord
        Where it cannot be decompressed, is shorter than stated or has the wrong checksum.
    """
    if chunk.compression == "":
        data = whole_file[chunk.data_offset : chunk.data_offset + chunk.compressed_size]
    else:
        data = Unpacker(file, chunk, room).upto(chunk.uncompressed_size)
    if chunk.truncated:
        return data
    if len(data) != chunk.uncompressed_size:
        raise DamagedRecord("a chunk is not of the size that it states")
    check(data, crc)
    return data


def check(data: Bytes, crc: int) -> None:
    """Compare a chunk's content with its checksum; zero says that the writer made none.

    Raises
    ------
    DamagedRecord
        Where they differ.
    """
    if crc and crc32(data.data) != crc:
        raise DamagedRecord("the checksum of a chunk is wrong")


def walk_table(data: Bytes) -> tuple[Messages, list[tuple[int, int, int]], int]:
    """Walk the records of a chunk; returns its messages, its other records and where the walk ended."""
    offsets, others, end = walk(data.data, 0, len(data))
    table, _ = message_table(data, np.array(offsets, np.int64))
    return table, others, end


def walk_chunk(
    file: memoryview, whole_file: Bytes, chunk: Chunk, name: str
) -> tuple[Chunk, list[tuple[int, memoryview]], Loss | None]:
    """Find the messages of a chunk that has no index by walking it.

    Returns
    -------
    tuple
        The chunk with its table, (opcode, content) of the schemas and channels in it, and what was lost.
    """
    loss = None
    try:
        crc = 0 if chunk.truncated else chunk_at(file, chunk.offset)[1]
        data = content(file, whole_file, chunk, crc)
    except DamagedRecord as error:
        return (
            replace(chunk, table=message_table(whole_file[:0], np.empty(0, np.int64))[0]),
            [],
            Loss(name, str(error), None, None, chunk.start_ns, chunk.end_ns),
        )
    table, others, end = walk_table(data)
    if chunk.truncated or end != len(data):
        reached = int(table.log_ns.max()) if len(table) else chunk.start_ns
        what = "the file ends inside a chunk" if chunk.truncated else "a chunk's records are damaged"
        loss = Loss(name, what, None, None, min(reached, chunk.end_ns), chunk.end_ns)
    view = data.data
    definitions = [
        (opcode, view[start + RECORD_HEADER : start + RECORD_HEADER + length]) for opcode, start, length in others
    ]
    return replace(chunk, table=table), definitions, loss


def _loss(name: str, what: str, chunk: Chunk, messages: int | None) -> Loss:
    return Loss(name, what, None, messages, chunk.start_ns, chunk.end_ns)


def _lost(
    file: memoryview,
    chunk: Chunk,
    wanted: Collection[int],
    name: str,
    topics: Mapping[int, str],
    what: str,
    kept: Mapping[int, Messages] | None = None,
) -> list[Loss]:
    """Say per wanted topic what a damaged chunk held, as its index has it."""
    if chunk.indexed is None and chunk.table is None:
        return [_loss(name, what, chunk, None)]
    losses = []
    for channel, count in sorted(chunk.counts().items()):
        if channel not in wanted:
            continue
        missing = count - (len(kept[channel]) if kept and channel in kept else 0)
        start_ns, end_ns = chunk.start_ns, chunk.end_ns
        if chunk.indexed is not None:
            try:
                times = index_entries(file, channel, *chunk.indexed[channel])[:, 0]
                start_ns, end_ns = int(times.min()), int(times.max())
            except (DamagedRecord, ValueError):
                pass
        if missing > 0:
            losses.append(Loss(name, what, topics.get(channel), missing, start_ns, end_ns))
    return losses
