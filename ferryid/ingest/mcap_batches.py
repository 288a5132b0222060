"""The wanted messages of an MCAP file, some chunks at a time, decompressed ahead of the decoders."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_chunks import Loaded, check_covered, content, load_carefully, representable
from ferryid.ingest.mcap_index import (
    MESSAGE,
    MESSAGE_HEADER,
    RECORD_HEADER,
    Bytes,
    Chunk,
    DamagedRecord,
    Index,
    Messages,
    chunk_at,
    definition,
    index_entries,
    message_table,
    record_header,
)
from ferryid.ingest.mcap_unpack import Unpacker

LOADERS = 2
"""Threads that decompress while the decoders run: zstd, lz4 and the checksum release the interpreter."""
AHEAD = 3
"""Batches loaded ahead of the decoders."""
BATCH_BYTES = 4 << 20
"""Decompressed bytes in one batch: several small pieces share the cost of a call, and stay in the cache."""
BATCH_MESSAGES = 16_384
WHOLE_FROM = 0.75
"""A compressed chunk wanted up to this part of its length is read to its end: in one pass, and with its checksum."""
CHECKED_FROM = 0.25
"""The checksum of an uncompressed chunk is taken where at least this part of its bytes is wanted."""
AHEAD_BYTES = 128 << 20
"""Decompressed bytes that are held at a time, but for a single chunk that is larger."""
SMALL = 64 << 10
"""A chunk up to this size [bytes] is always read to its end and checked: that costs next to nothing."""


@dataclass(frozen=True)
class _Plan:
    """What to take of one chunk: per channel (log time [ns], offset in the chunk), shape (n, 2), and up to where.

    `count` is the number of messages wanted. `every` has the offsets of the messages of all channels, ascending, where
    the chunk is to be held against its whole index.
    """

    chunk: Chunk
    crc: int
    entries: Mapping[int, NDArray[np.int64]]
    last: int
    whole: bool
    count: int
    every: NDArray[np.int64] | None = None

    @property
    def plain(self) -> bool:
        return self.chunk.compression == ""

    @property
    def alone(self) -> bool:
        """True where lz4 gives the whole chunk in memory of its own; small ones share a batch, which saves more."""
        return self.whole and self.chunk.compression == "lz4" and self.chunk.uncompressed_size > SMALL

    @property
    def size(self) -> int:
        """Bytes to decompress; a last message that is cut short gets more."""
        return 0 if self.plain else self.chunk.uncompressed_size if self.whole else self.last + RECORD_HEADER


def batches(
    file: memoryview,
    whole_file: Bytes,
    index: Index,
    wanted: Collection[int],
    name: str,
    topics: Mapping[int, str],
    verify: bool,
) -> Iterator[Loaded]:
    """Yield the wanted messages in file order; a buffer is valid only until the next is asked for.

    Parameters
    ----------
    file, whole_file
        The same bytes of the file as a memoryview and as an array.
    index
        Chunks and loose messages of the file.
    wanted
        Channel ids.
    name, topics
        File name and topic per channel id, for losses.
    verify
        Read every chunk to its end, check its checksum and hold it against its whole index, whatever is wanted. So it is
        done in any case where the file's statistics do not confirm the index.
    """
    thorough = verify or not index.complete

    def carefully(chunk: Chunk, reason: str) -> Loaded:
        return load_carefully(file, whole_file, chunk, index.walks, wanted, name, topics, reason)

    def run(batch: Sequence[_Plan], room: Bytes) -> list[Loaded]:
        try:
            return [_load(file, whole_file, batch, room, index, name)]
        except DamagedRecord:
            return [each for plan in batch for each in one(plan)]

    def one(plan: _Plan) -> list[Loaded]:
        try:
            return [_load(file, whole_file, [plan], None, index, name)]
        except DamagedRecord as error:
            return [carefully(plan.chunk, str(error))]

    rooms: deque[Bytes] = deque()
    pending: deque[tuple[Future[list[Loaded]], Bytes, int]] = deque()
    with ThreadPoolExecutor(LOADERS) as pool:
        try:
            for item in _gathered(file, index, wanted, thorough):
                if isinstance(item, list):
                    size = sum(plan.size for plan in item)
                    while pending and sum(held for _, _, held in pending) + size > AHEAD_BYTES:
                        future, room, _ = pending.popleft()
                        yield from future.result()
                        rooms.append(room)
                    room = rooms.popleft() if rooms else np.empty(2 * BATCH_BYTES, np.uint8)
                    pending.append((pool.submit(run, item, room), room, size))
                    if len(pending) <= AHEAD:
                        continue
                    future, room, _ = pending.popleft()
                    yield from future.result()
                    rooms.append(room)
                    continue
                while pending:
                    yield from pending.popleft()[0].result()
                if isinstance(item, Messages):
                    kept, late = representable(item.by_channel(wanted), name, topics)
                    yield Loaded(whole_file, kept, tuple(late))
                else:
                    yield carefully(*item)
            while pending:
                yield from pending.popleft()[0].result()
        finally:
            for future, _, _ in pending:
                future.cancel()


def _gathered(
    file: memoryview, index: Index, wanted: Collection[int], thorough: bool
) -> Iterator[list[_Plan] | Messages | tuple[Chunk, str]]:
    """Yield batches of plans, loose messages, and chunks whose index is damaged with the reason, in file order."""
    batch: list[_Plan] = []
    size = count = 0
    for item in _items(index):
        if isinstance(item, Messages):
            if batch:
                yield batch
                batch, size, count = [], 0, 0
            yield item
            continue
        # A chunk with a table was walked, and with that checked, when the file was opened.
        if not _holds(item, wanted) and (item.table is not None or not thorough):
            continue
        try:
            plan = _plan(file, item, wanted, thorough)
        except DamagedRecord as error:
            if batch:
                yield batch
                batch, size, count = [], 0, 0
            yield item, str(error)
            continue
        if batch and (
            size + plan.size > BATCH_BYTES
            or count + plan.count > BATCH_MESSAGES
            or plan.plain != batch[-1].plain
            or plan.alone
            or batch[-1].alone
        ):
            yield batch
            batch, size, count = [], 0, 0
        batch.append(plan)
        size += plan.size
        count += plan.count
    if batch:
        yield batch


def _items(index: Index) -> Iterator[Chunk | Messages]:
    """Yield chunks and the stretches of messages between them, in file order."""
    loose = index.loose
    if loose is None:
        yield from index.chunks
        return
    first = 0
    for chunk in index.chunks:
        stop = int(np.searchsorted(loose.starts, chunk.offset))
        if stop > first:
            yield loose.take(slice(first, stop))
            first = stop
        yield chunk
    if first < len(loose):
        yield loose.take(slice(first, None))


def _holds(chunk: Chunk, wanted: Collection[int]) -> bool:
    return any(channel in wanted for channel in chunk.counts())


def _plan(file: memoryview, chunk: Chunk, wanted: Collection[int], thorough: bool) -> _Plan:
    """Look up the wanted messages of a chunk; DamagedRecord where header and index disagree."""
    header, crc, _ = chunk_at(file, chunk.offset)
    stated = header.compression, header.data_offset, header.uncompressed_size, header.start_ns, header.end_ns
    if stated != (
        chunk.compression,
        chunk.data_offset,
        chunk.uncompressed_size,
        chunk.start_ns,
        chunk.end_ns,
    ) or (header.compressed_size != chunk.compressed_size and not chunk.truncated):
        raise DamagedRecord("a chunk's header and its index disagree")
    entries: dict[int, NDArray[np.int64]] = {}
    if chunk.table is not None:
        for channel, rows in chunk.table.by_channel(wanted).items():
            entries[channel] = np.stack([rows.log_ns, rows.starts - MESSAGE_HEADER], axis=1)
    else:
        for channel, (offset, count) in (chunk.indexed or {}).items():
            if count and channel in wanted:
                entries[channel] = index_entries(file, channel, offset, count)
    last = max((int(rows[:, 1].max()) for rows in entries.values()), default=0)
    if not 0 <= last < chunk.uncompressed_size or chunk.data_offset + chunk.compressed_size > len(file):
        raise DamagedRecord("a message index points outside its chunk")
    every = None
    if thorough and chunk.indexed is not None and chunk.table is None:
        every = chunk.every(file)
    whole = thorough or chunk.truncated
    # The last message of an uncompressed chunk says nothing of how much of it is wanted.
    whole = whole or (chunk.compression != "" and last >= WHOLE_FROM * chunk.uncompressed_size)
    whole = whole or chunk.uncompressed_size <= SMALL
    return _Plan(chunk, crc, entries, last, whole, sum(map(len, entries.values())), every)


def _load(
    file: memoryview, whole_file: Bytes, batch: Sequence[_Plan], room: Bytes | None, index: Index, name: str
) -> Loaded:
    """Load the chunks of one batch, decompressed behind one another in `room`; DamagedRecord if anything is wrong.

    Without `room` the batch is one chunk, which brings its own memory.
    """
    buffer = whole_file if batch[0].plain else whole_file[:0]
    bases: list[int] = []
    limits: list[int] = []
    losses: list[Loss] = []
    used = 0
    for plan in batch:
        if plan.plain:
            if plan.chunk.compressed_size != plan.chunk.uncompressed_size and not plan.chunk.truncated:
                raise DamagedRecord("an uncompressed chunk states two sizes")
            bases.append(plan.chunk.data_offset)
            limits.append(plan.chunk.data_offset + plan.chunk.compressed_size)
            continue
        own = room is None or plan.alone
        data = _unpacked(file, whole_file, plan, None if own or room is None else room[used:])
        bases.append(used)
        used += len(data)
        limits.append(used)
        buffer = data if own or room is None else room[:used]
    messages, taken = _located(buffer, batch, np.array(bases), np.array(limits))
    for plan, size in zip(batch, taken.tolist(), strict=True):
        if plan.plain and (plan.whole or size >= CHECKED_FROM * plan.chunk.uncompressed_size):
            content(file, whole_file, plan.chunk, plan.crc)
    for plan, first, stop in zip(batch, bases, limits, strict=True):
        if plan.every is not None:
            data = buffer[first:stop]
            for kind, start, length in check_covered(data, plan.every):
                found = definition(kind, data[start + RECORD_HEADER : start + RECORD_HEADER + length])
                conflict = index.conflict(found)
                if conflict:
                    losses.append(Loss(name, conflict, None, None, plan.chunk.start_ns, plan.chunk.end_ns))
    return Loaded(buffer, messages, tuple(losses))


def _unpacked(file: memoryview, whole_file: Bytes, plan: _Plan, room: Bytes | None) -> Bytes:
    """Decompress a chunk as far as it is wanted."""
    if room is not None and plan.size > len(room):
        raise DamagedRecord("a chunk is larger than the room of a batch")
    if plan.whole:
        return content(file, whole_file, plan.chunk, plan.crc, room)
    unpacker = Unpacker(file, plan.chunk, room)
    head = unpacker.upto(plan.last + RECORD_HEADER)
    if len(head) < plan.last + RECORD_HEADER:
        raise DamagedRecord("a chunk is shorter than its index says")
    opcode, length = record_header(head, plan.last)
    size = plan.last + RECORD_HEADER + length
    if opcode != MESSAGE or size > plan.chunk.uncompressed_size or (room is not None and size > len(room)):
        raise DamagedRecord("a message index and its messages disagree")
    return unpacker.upto(size)


def _located(
    buffer: Bytes, batch: Sequence[_Plan], bases: NDArray[np.int64], limits: NDArray[np.int64]
) -> tuple[dict[int, Messages], NDArray[np.float64]]:
    """Read the headers of all wanted messages and hold them against the index.

    Returns
    -------
    tuple
        Messages per channel id, and the bytes that they take up in each chunk, shape (chunks,).
    """
    channels = sorted({channel for plan in batch for channel in plan.entries})
    found = ((channel, number) for number, plan in enumerate(batch) for channel in plan.entries)
    parts = [(channel, number, batch[number].entries[channel]) for channel, number in sorted(found)]
    taken = np.zeros(len(batch))
    if not parts:
        return {}, taken
    lengths = [len(rows) for _, _, rows in parts]
    owners = [number for _, number, _ in parts]
    channel_of = np.repeat(np.array([channel for channel, _, _ in parts], np.uint16), lengths)
    entries = np.concatenate([rows for _, _, rows in parts])
    table, opcodes = message_table(buffer, entries[:, 1] + np.repeat(bases[owners], lengths))
    room = np.repeat(limits[owners], lengths) - table.starts
    if (
        (opcodes != MESSAGE).any()
        or (table.channels != channel_of).any()
        or (table.log_ns != entries[:, 0]).any()
        or (table.sizes < 0).any()
        or (table.log_ns < 0).any()
        or (table.sizes > room).any()
    ):
        raise DamagedRecord("a message index and its messages disagree")
    firsts = np.cumsum([0, *lengths[:-1]])
    np.add.at(taken, owners, np.add.reduceat(table.sizes, firsts) + MESSAGE_HEADER * np.array(lengths))
    messages: dict[int, Messages] = {}
    bounds = np.searchsorted(channel_of, channels).tolist()
    for channel, first, stop in zip(channels, bounds, [*bounds[1:], len(channel_of)], strict=True):
        one = table.take(slice(first, stop))
        if _overlapping(one):
            # Some writers sort a message index by time; the file's order is that of the records.
            one = one.take(np.argsort(one.starts))
            if _overlapping(one):
                raise DamagedRecord("a message index names a message twice")
        messages[channel] = one
    return messages, taken


def _overlapping(messages: Messages) -> bool:
    """Tell whether a message begins before the one listed before it ends."""
    return bool((messages.starts[1:] < (messages.starts + (messages.sizes + MESSAGE_HEADER))[:-1]).any())
