"""The content of one MCAP chunk: decompressed as far as needed, checked, walked, and what is damaged reported.

A walk takes at most one message per byte that the chunk takes up in the file, and some more as `Walks` has it: no recorder
reaches that, as every message has its own time. So what is held of a file's messages is at most 26 bytes, and those of
the wanted fields, per byte of the file.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.ingest.checksum import crc32
from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_index import (
    CHANNEL,
    MESSAGE,
    MESSAGE_FIELDS,
    MESSAGE_HEADER,
    RECORD_HEADER,
    SCHEMA,
    Bytes,
    Chunk,
    DamagedRecord,
    Messages,
    Walks,
    index_entries,
    message_table,
    record_header,
    stored_crc,
    walk,
)
from ferryid.ingest.mcap_unpack import Unpacker


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
    walks: Walks,
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
    walks
        Bounds how many records are taken.
    wanted
        Channel ids.
    name, topics
        File name and topic per channel id, for losses.
    reason
        What is wrong with the chunk.
    """
    crc = 0 if chunk.truncated else stored_crc(file, chunk.offset)
    try:
        data = content(file, whole_file, chunk, crc)
        table, others, end = walk_table(data, chunk, crc, walks)
    except DamagedRecord as error:
        return Loaded(whole_file[:0], {}, tuple(_lost(file, chunk, wanted, name, topics, str(error))))
    indexed = chunk.counts()
    distinct = without_copies(data, table, len(table) > sum(indexed.values()))
    kept = distinct.by_channel(wanted)
    sound = end == len(data) and not chunk.truncated and all(kind in (SCHEMA, CHANNEL) for kind, _, _ in others)
    if sound:
        # The index may be right where it has more messages.
        doubtful = any(indexed.get(key, 0) > len(kept.get(key, ())) for key in wanted)
        losses = [_loss(name, f"{reason}; the chunk was walked instead", chunk, None if doubtful else 0)]
    elif any(len(messages) > indexed.get(key, 0) for key, messages in kept.items()):
        losses = [_loss(name, reason, chunk, None)]
    else:
        losses = _lost(file, chunk, wanted, name, topics, reason, kept) or [_loss(name, reason, chunk, None)]
    kept, late = representable(kept, name, topics)
    if len(distinct) < len(table):
        losses.append(copies_lost(name, len(table) - len(distinct)))
    return Loaded(data, kept, (*losses, *late))


def representable(
    messages: Mapping[int, Messages], name: str, topics: Mapping[int, str]
) -> tuple[dict[int, Messages], list[Loss]]:
    """Leave out the messages whose log time is 2**63 ns or more; returns the others and what was left out."""
    kept: dict[int, Messages] = {}
    losses = []
    for channel, found in messages.items():
        possible = found.log_ns >= 0
        if possible.all():
            kept[channel] = found
            continue
        what = "messages with a log time of 2**63 ns or later, which cannot be represented, were left out"
        losses.append(Loss(name, what, topics.get(channel), int((~possible).sum())))
        if possible.any():
            kept[channel] = found.take(possible)
    return kept, losses


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
        unpacker = Unpacker(file, chunk, room)
        data = unpacker.upto(chunk.uncompressed_size)
        if not crc and not chunk.truncated and unpacker.has_more():
            raise DamagedRecord("a chunk is not of the size that it states")
    if chunk.truncated:
        return data
    if len(data) != chunk.uncompressed_size:
        raise DamagedRecord("a chunk is not of the size that it states")
    if crc or chunk.checksummed:
        check(data, crc)
    return data


def check(data: Bytes, crc: int) -> None:
    """Compare a chunk's content with its checksum.

    Raises
    ------
    DamagedRecord
        Where they differ.
    """
    if crc32(data.data) != crc:
        raise DamagedRecord("the checksum of a chunk is wrong")


def walk_table(data: Bytes, chunk: Chunk, crc: int, walks: Walks) -> tuple[Messages, list[tuple[int, int, int]], int]:
    """Walk the records of a chunk; returns its messages, its other records and where the walk ended.

    Without a checksum, a message behind which no record of a chunk stands is left out: bytes are missing or wrong from
    somewhere on, perhaps from within it.

    Raises
    ------
    DamagedRecord
        Where it holds more records than bytes in the file.
    """
    limit = walks.limit(chunk.compressed_size)
    offsets, others, end = walk(data.data, 0, len(data), limit)
    walks.take(len(offsets) + len(others), chunk.compressed_size)
    if end < len(data) and len(offsets) + len(others) >= limit:
        raise DamagedRecord("a chunk holds more records than it has bytes in the file, which no recorder writes")
    table, _ = message_table(data, np.array(offsets, np.int64))
    if chunk.truncated or not (chunk.checksummed or crc):
        odd = [start for kind, start, _ in others if kind not in (SCHEMA, CHANNEL)]
        odd += [] if _may_follow(data, end, chunk) else [end]
        table = table.take(~np.isin(table.starts + table.sizes, odd)) if odd else table
    return table, others, end


def _may_follow(data: Bytes, end: int, chunk: Chunk) -> bool:
    """Tell whether a record of the chunk may begin at `end`, whole or cut off with the data, or the chunk ends there."""
    if end == len(data):
        return True
    if data[end] not in (SCHEMA, CHANNEL, MESSAGE):
        return False
    if len(data) - end < RECORD_HEADER:
        return True
    return end + RECORD_HEADER + record_header(data.data, end)[1] <= chunk.uncompressed_size


def header_fields(buffer: Bytes, messages: Messages) -> NDArray[np.void]:
    """Return the record headers of messages as `MESSAGE_FIELDS`, shape (n,)."""
    headers = np.ndarray((len(buffer) - MESSAGE_HEADER + 1,), f"V{MESSAGE_HEADER}", buffer, strides=(1,))
    return headers[messages.starts - MESSAGE_HEADER].view(MESSAGE_FIELDS)


def without_copies(buffer: Bytes, messages: Messages, surplus: bool = False) -> Messages:
    """Return the messages without those that are the same, byte for byte, as an earlier one of the same number.

    Recorders that do not number the messages of a channel give them all the sequence number 0: those are kept, unless
    there is a `surplus` of messages.
    """
    if len(messages) < 2 or (messages.log_ns[1:] > messages.log_ns[:-1]).all():
        return messages
    fields = header_fields(buffer, messages)
    order = np.lexsort((fields["length"], fields["sequence"], messages.log_ns, messages.channels))
    fields = fields[order]
    numbered = np.isin(fields["channel"], fields["channel"][fields["sequence"] != 0])
    same = (fields[1:] == fields[:-1]) & (surplus | numbered[1:])
    keep = np.ones(len(messages), np.bool_)
    starts, ends = messages.starts[order].tolist(), (messages.starts + messages.sizes)[order].tolist()
    for row in np.flatnonzero(same).tolist():
        first, second = slice(starts[row], ends[row]), slice(starts[row + 1], ends[row + 1])
        keep[order[row + 1]] = not np.array_equal(buffer[first], buffer[second])
    return messages.take(keep)


def copies_lost(name: str, count: int) -> Loss:
    """Return the loss that reports copies left out."""
    return Loss(
        name,
        f"{counted(count, 'message')} {verb(count, 'is')} in the file twice, byte for byte; the copies were left out",
        messages=0,
    )


def check_covered(data: Bytes, offsets: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """Check that the messages that an index names, and definitions between them, are all that a chunk holds.

    Parameters
    ----------
    data
        The whole content of the chunk.
    offsets
        Where the index has the messages of all channels, ascending, shape (n,).

    Returns
    -------
    list
        (opcode, offset, content length) of the definitions.

    Raises
    ------
    DamagedRecord
        Where two entries name one message, or something else is in the chunk.
    """
    table, opcodes = message_table(data, offsets)
    begins = np.concatenate([offsets, [len(data)]])
    if (opcodes != MESSAGE).any() or (table.sizes < 0).any() or (table.sizes > begins[1:] - table.starts).any():
        raise DamagedRecord("the message indexes of a chunk and its messages disagree")
    ends = np.concatenate([[0], table.starts + table.sizes])
    definitions: list[tuple[int, int, int]] = []
    for gap in np.flatnonzero(begins > ends).tolist():
        messages, others, reached = walk(data.data, int(ends[gap]), int(begins[gap]))
        if messages or reached != begins[gap] or any(kind not in (SCHEMA, CHANNEL) for kind, _, _ in others):
            raise DamagedRecord("a chunk holds records that its message indexes leave out")
        definitions += others
    return definitions


def walk_chunk(
    file: memoryview, whole_file: Bytes, chunk: Chunk, walks: Walks, name: str
) -> tuple[Chunk, list[tuple[int, memoryview]], Loss | None]:
    """Find the messages of a chunk that has no index, or a doubtful one, by walking it.

    Returns
    -------
    tuple
        The chunk with its table, (opcode, content) of the schemas and channels in it, and what was lost. A chunk that
        cannot be read keeps its index, where it has one, and is reported when its messages are read.
    """
    loss = None
    crc = 0 if chunk.truncated else stored_crc(file, chunk.offset)
    try:
        data = content(file, whole_file, chunk, crc)
        table, others, end = walk_table(data, chunk, crc, walks)
    except DamagedRecord as error:
        if chunk.indexed is not None:
            return chunk, [], None
        return (
            replace(chunk, table=message_table(whole_file[:0], np.empty(0, np.int64))[0]),
            [],
            Loss(name, str(error), None, None, chunk.start_ns, chunk.end_ns),
        )
    if chunk.truncated or end != len(data) or any(kind not in (SCHEMA, CHANNEL) for kind, _, _ in others):
        reached = int(table.log_ns.max()) if len(table) else chunk.start_ns
        what = "the file ends inside a chunk" if chunk.truncated else "a chunk's records are damaged"
        loss = Loss(name, what, None, None, min(max(reached, 0), chunk.end_ns), chunk.end_ns)
    distinct = without_copies(data, table, chunk.indexed is not None and len(table) > sum(chunk.counts().values()))
    if loss is None and len(distinct) < len(table):
        loss = copies_lost(name, len(table) - len(distinct))
    view = data.data
    definitions = [
        (opcode, view[start + RECORD_HEADER : start + RECORD_HEADER + length])
        for opcode, start, length in others
        if opcode in (SCHEMA, CHANNEL)
    ]
    return replace(chunk, table=distinct), definitions, loss


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
        start_ns, end_ns = chunk.start_ns, chunk.end_ns
        if chunk.indexed is not None:
            try:
                entries = index_entries(file, channel, *chunk.indexed[channel])
                start_ns, end_ns = max(int(entries[:, 0].min()), 0), max(int(entries[:, 0].max()), 0)
                count = len(np.unique(entries[:, 1]))
            except (DamagedRecord, ValueError):
                pass
        missing = count - (len(kept[channel]) if kept and channel in kept else 0)
        if missing > 0:
            losses.append(Loss(name, what, topics.get(channel), missing, start_ns, end_ns))
    return losses
