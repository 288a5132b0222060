"""The index of an MCAP file: its summary, or what walking finds where that is missing, damaged or contradicted."""

from __future__ import annotations

import numpy as np
from mcap.records import Channel, Schema

from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_chunks import MAX_CHUNK, walk_chunk
from ferryid.ingest.mcap_index import (
    LATEST_NS,
    MESSAGE_FIELDS,
    MESSAGE_HEADER,
    Bytes,
    DamagedRecord,
    Index,
    Messages,
)
from ferryid.ingest.mcap_scan import scan
from ferryid.ingest.mcap_summary import read_summary


def read_index(file: memoryview, whole_file: Bytes, name: str) -> Index:
    """Return the index of a file, from its summary or else by walking the file.

    Where its statistics and its index disagree the file is walked, and where that does not explain it, its chunks are.

    Parameters
    ----------
    file, whole_file
        The same bytes as a memoryview and as an array.
    name
        File name for losses.
    """
    try:
        index = read_summary(file)
        reason = None if index is None else index.contradiction
    except DamagedRecord as error:
        index, reason = None, str(error)
    if index is not None:
        _check_statistics(index, len(file), name)
    if index is None or reason is not None or _needs_walk(index):
        summary, index = index, scan(file, name)
        if summary is not None:
            _merge(index, summary)
    _walk_chunks(index, file, whole_file, name)
    if not index.complete:
        _leave_out_copies(index, whole_file, name)
    if reason is not None:
        found = sum(index.counts().values())
        what = f"{reason}; the index was rebuilt by walking the whole file, which found {found} messages"
        index.losses.insert(0, Loss(name, what, messages=0))
    for conflict in dict.fromkeys(index.conflicts):
        index.losses.append(Loss(name, f"{conflict}: the first stands, for all messages"))
    late = sum(chunk.end_ns == LATEST_NS for chunk in index.chunks)
    if late:
        what = f"{late} chunks state times of 2**63 ns or later, which cannot be represented"
        index.losses.append(Loss(name, what, messages=0))
    return index


def _check_statistics(index: Index, size: int, name: str) -> None:
    """Drop statistics that cannot be true: a message takes at least 31 bytes of the file or of a chunk."""
    if index.statistics is None:
        return
    stated = index.statistics.message_count
    counts = index.statistics.channel_message_counts
    possible = (size + sum(min(chunk.uncompressed_size, MAX_CHUNK) for chunk in index.chunks)) // MESSAGE_HEADER
    if stated > possible or (counts and sum(counts.values()) != stated):
        what = (
            f"the file's own statistics cannot be true ({stated} messages, {sum(counts.values())} when added up by "
            "channel) and were not used"
        )
        index.losses.append(Loss(name, what, messages=0))
        index.statistics = None


def _needs_walk(index: Index) -> bool:
    """Tell whether messages lie outside the indexed chunks, or the summary does not list all chunks."""
    if index.statistics is None or index.statistics.chunk_count != len(index.chunks):
        return True
    return all(chunk.indexed is not None for chunk in index.chunks) and not _confirmed(index)


def _confirmed(index: Index) -> bool:
    """Tell whether the statistics count exactly the messages that were found, on every channel."""
    if index.statistics is None:
        return False
    found = {channel: count for channel, count in index.counts().items() if count}
    stated = {channel: count for channel, count in index.statistics.channel_message_counts.items() if count}
    return sum(found.values()) == index.statistics.message_count and stated in ({}, found)


def _merge(index: Index, summary: Index) -> None:
    """Add what the summary has to the index found by walking; the definitions of the summary come first."""
    index.statistics = summary.statistics
    index.losses[:0] = summary.losses
    index.conflicts += summary.conflicts
    walked: list[Schema | Channel] = [*index.schemas.values(), *index.channels.values()]
    index.schemas, index.channels = dict(summary.schemas), dict(summary.channels)
    for definition in walked:
        index.add(definition)


def _walk_chunks(index: Index, file: memoryview, whole_file: Bytes, name: str) -> None:
    """Walk the chunks that have no message index or define what is known from nowhere else, all if counts disagree."""
    index.complete = _confirmed(index)
    for number, chunk in enumerate(index.chunks):
        unknown = any(channel not in index.channels for channel in chunk.indexed or ())
        if unknown or (chunk.indexed is None and not index.complete):
            _walk_into(index, number, file, whole_file, name)
    missing = {channel.schema_id for channel in index.channels.values()} - index.schemas.keys() - {0}
    for number, chunk in enumerate(index.chunks):
        if not missing:
            break
        if chunk.table is None:
            _walk_into(index, number, file, whole_file, name)
            missing -= index.schemas.keys()
    index.complete = _confirmed(index)
    if index.statistics is not None and not index.complete:
        for number, chunk in enumerate(index.chunks):
            if chunk.table is None:
                _walk_into(index, number, file, whole_file, name)
        index.complete = _confirmed(index)


def _walk_into(index: Index, number: int, file: memoryview, whole_file: Bytes, name: str) -> None:
    """Walk a chunk: take its definitions, and its messages where its index has others."""
    chunk = index.chunks[number]
    walked, definitions, loss = walk_chunk(file, whole_file, chunk, name)
    for opcode, content in definitions:
        try:
            index.define(opcode, content)
        except DamagedRecord as error:
            index.losses.append(Loss(name, str(error), None, None, chunk.start_ns, chunk.end_ns))
    if walked.counts() == chunk.counts():
        return
    index.chunks[number] = walked
    if loss is None and chunk.indexed is not None:
        what = "the message index of a chunk and its messages disagree; the chunk was walked instead"
        loss = Loss(name, what, None, 0, chunk.start_ns, chunk.end_ns)
    if loss is not None:
        index.losses.append(loss)


def _leave_out_copies(index: Index, whole_file: Bytes, name: str) -> None:
    """Leave out loose messages that are copies of earlier ones, in a file whose statistics do not count them.

    Copies have the same sequence number, but for 0, which many recorders give to all messages.
    """
    if index.loose is None:
        return
    kept = without_copies(whole_file, index.loose)
    left_out = len(index.loose) - len(kept)
    if left_out:
        index.loose = kept
        what = f"{left_out} messages are in the file twice, byte for byte; the copies were left out"
        index.losses.append(Loss(name, what, messages=0))
        index.complete = _confirmed(index)


def without_copies(buffer: Bytes, messages: Messages) -> Messages:
    """Return the messages without those that are the same, byte for byte, as an earlier one with a sequence number."""
    headers = np.ndarray((len(buffer) - MESSAGE_HEADER + 1,), f"V{MESSAGE_HEADER}", buffer, strides=(1,))
    fields = headers[messages.starts - MESSAGE_HEADER].view(MESSAGE_FIELDS)
    order = np.lexsort((fields["length"], fields["sequence"], messages.log_ns, messages.channels))
    fields = fields[order]
    same = (fields[1:] == fields[:-1]) & (fields["sequence"][1:] != 0)
    keep = np.ones(len(messages), np.bool_)
    starts, ends = messages.starts[order].tolist(), (messages.starts + messages.sizes)[order].tolist()
    for row in np.flatnonzero(same).tolist():
        first, second = slice(starts[row], ends[row]), slice(starts[row + 1], ends[row + 1])
        keep[order[row + 1]] = not np.array_equal(buffer[first], buffer[second])
    return messages.take(keep)
