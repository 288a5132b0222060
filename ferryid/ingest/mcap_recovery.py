"""The index of an MCAP file: its summary, or what walking finds where that is missing, damaged or contradicted."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
from mcap.records import Channel, Schema

from ferryid.counts import counted, verb
from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_chunks import (
    check_covered,
    content,
    copies_lost,
    header_fields,
    walk_chunk,
    without_copies,
)
from ferryid.ingest.mcap_index import (
    LATEST_NS,
    MESSAGE_HEADER,
    RECORD_HEADER,
    Bytes,
    DamagedRecord,
    Index,
    stored_crc,
)
from ferryid.ingest.mcap_scan import scan, unread_behind
from ferryid.ingest.mcap_summary import read_summary, summary_start
from ferryid.ingest.mcap_unpack import MAX_CHUNK, MAX_EXPANDED, MAX_RATIO

MAX_CONFLICTS = 16
"""Contradicting definitions that are reported one by one."""
FIRST_CHUNK = 8 << 20
"""A first chunk up to this size [bytes] is read when a file is opened."""


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
    if index is not None and reason is None and not _needs_walk(index):
        _walk_chunks(index, file, whole_file, name)
        _check_definitions(index, file, whole_file)
    behind = None
    if index is None or not index.complete:
        summary, index = index, scan(file, name)
        behind = unread_behind(file, index.data_end, name)
        if summary is None:
            summary = _moved_summary(file, index.data_end, name)
        if summary is not None:
            _merge(index, summary)
            _check_statistics(index, len(file), name)
        _walk_chunks(index, file, whole_file, name)
        if not index.complete:
            _check_loose(index, whole_file, name)
    if index.complete:
        # All messages that were ever written are there.
        index.losses = [loss if loss.messages else replace(loss, messages=0) for loss in index.losses]
    if behind is not None:
        index.losses.append(behind)
    if reason is not None:
        found = sum(index.counts().values())
        what = f"{reason}; the index was rebuilt by walking the whole file, which found {counted(found, 'message')}"
        index.losses.insert(0, Loss(name, what, messages=0))
    conflicts = list(dict.fromkeys(index.conflicts))
    index.losses += [Loss(name, conflict) for conflict in conflicts[:MAX_CONFLICTS]]
    if len(conflicts) > MAX_CONFLICTS:
        what = f"{len(conflicts) - MAX_CONFLICTS} more definitions contradict earlier ones of the same id"
        index.losses.append(Loss(name, what))
    late = sum(chunk.end_ns == LATEST_NS for chunk in index.chunks)
    if late:
        what = (
            f"{counted(late, 'chunk')} {verb(late, 'states')} times of 2**63 ns or later, which cannot be represented"
        )
        index.losses.append(Loss(name, what, messages=0))
    return index


def _check_definitions(index: Index, file: memoryview, whole_file: Bytes) -> None:
    """Hold the definitions of the summary against those in the first chunk, unless that is large."""
    for chunk in index.chunks[:1]:
        if chunk.indexed is not None and chunk.table is None and chunk.uncompressed_size <= FIRST_CHUNK:
            # A damaged chunk is reported when it is read.
            with suppress(DamagedRecord):
                data = content(file, whole_file, chunk, stored_crc(file, chunk.offset))
                for kind, start, length in check_covered(data, chunk.every(file)):
                    index.define(kind, data[start + RECORD_HEADER : start + RECORD_HEADER + length])


def _moved_summary(file: memoryview, data_end: int, name: str) -> Index | None:
    """Return the summary that stands behind the data, in a file whose footer has it elsewhere; None if there is none."""
    place = data_end + RECORD_HEADER + 4
    try:
        _, start, _ = summary_start(file)
        summary = read_summary(file, place) if start and place < len(file) else None
    except DamagedRecord:
        return None
    if summary is not None:
        moved = (
            f"{counted(abs(start - place), 'byte')} {'before' if place < start else 'behind'} where the footer has it"
        )
        what = f"the summary stands {moved}: bytes of the file are missing or were added"
        summary.losses.append(Loss(name, what))
        _check_statistics(summary, len(file), name)
    return summary


def _check_statistics(index: Index, size: int, name: str) -> None:
    """Drop statistics that cannot be true: a message takes at least 31 bytes of the file or of a chunk.

    A chunk that is not known may hold as much as a chunk can; each takes at least 49 bytes of the file.
    """
    if index.statistics is None:
        return
    stated = index.statistics.message_count
    counts = index.statistics.channel_message_counts
    unknown = min(max(index.statistics.chunk_count - len(index.chunks), 0), size // 49)
    expanded = sum(min(chunk.uncompressed_size, MAX_CHUNK) for chunk in index.chunks) + unknown * MAX_CHUNK
    possible = (size + expanded) // MESSAGE_HEADER
    if stated > possible or (counts and sum(counts.values()) != stated):
        what = (
            f"the file's own statistics cannot be true ({counted(stated, 'message')}, {sum(counts.values())} when added up by "
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
    """Add what the summary has to the index found by walking; of as many definitions, those of the summary stand."""
    index.statistics = summary.statistics
    index.losses[:0] = summary.losses
    index.conflicts += summary.conflicts
    walked: list[Schema | Channel] = [*index.schemas.values(), *index.channels.values()]
    index.schemas, index.channels, index.votes = dict(summary.schemas), dict(summary.channels), summary.votes
    for definition in walked:
        index.add(definition)


def _refuse_expansion(index: Index, size: int) -> None:
    """Mark the chunks that would take the file past the bound on what is decompressed of it."""
    left = MAX_EXPANDED + MAX_RATIO * size
    for number, chunk in enumerate(index.chunks):
        if chunk.compression:
            left -= min(chunk.uncompressed_size, MAX_CHUNK)
            if left < 0:
                index.chunks[number] = replace(chunk, refused=True)


def _walk_chunks(index: Index, file: memoryview, whole_file: Bytes, name: str) -> None:
    """Walk the chunks that have no message index or define what is known from nowhere else, all if counts disagree."""
    _refuse_expansion(index, len(file))
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
    walked, definitions, loss = walk_chunk(file, whole_file, chunk, index.walks, name)
    for opcode, text in definitions:
        try:
            index.define(opcode, text)
        except DamagedRecord as error:
            index.losses.append(Loss(name, str(error), None, None, chunk.start_ns, chunk.end_ns))
    if chunk.indexed is not None and walked.counts() == chunk.counts():
        return
    index.chunks[number] = walked
    counts = walked.counts()
    if loss is None and chunk.indexed is not None:
        fewer = any(counts.get(channel, 0) < count for channel, count in chunk.counts().items())
        what = "the message index of a chunk and its messages disagree; the chunk was walked instead"
        loss = Loss(name, what, None, None if fewer else 0, chunk.start_ns, chunk.end_ns)
    elif loss is None and any(counts.get(channel, 0) < count for channel, count in chunk.partial_index.items()):
        what = "the message indexes behind a chunk count more messages than it holds"
        loss = Loss(name, what, None, None, chunk.start_ns, chunk.end_ns)
    if loss is not None:
        index.losses.append(loss)


def _check_loose(index: Index, whole_file: Bytes, name: str) -> None:
    """Leave out copies of messages outside chunks, and what can hardly be a message, where no statistics count them."""
    if index.loose is None:
        return
    kept = without_copies(whole_file, index.loose)
    copied = len(kept) < len(index.loose)
    if copied:
        index.losses.append(copies_lost(name, len(index.loose) - len(kept)))
    defined = np.isin(kept.channels, list(index.channels))
    surplus = index.statistics is not None and sum(index.counts().values()) > index.statistics.message_count
    times = kept.log_ns[defined]
    odd = np.zeros(len(kept), np.bool_)
    if index.chunks and len(kept):
        # A MessageIndex record behind a chunk whose kind was damaged: its length field stands in place of the number.
        fields = header_fields(whole_file, kept)
        odd = (fields["sequence"] % 16 == 0) & (fields["length"] == fields["sequence"].astype(np.uint64) + 6)
        times = np.array([(chunk.start_ns, chunk.end_ns) for chunk in index.chunks])
    if len(times):
        odd |= ((kept.log_ns < times.min()) | (kept.log_ns > times.max())) & (surplus | ~defined)
    if odd.any():
        what = (
            f"{counted(int(odd.sum()), 'record')} that {verb(int(odd.sum()), 'looks')} like messages of "
            f"other channels or times {verb(int(odd.sum()), 'was')} left out"
        )
        index.losses.append(Loss(name, what))
        kept = kept.take(~odd)
    index.loose = kept
    # Where a stretch of bytes was copied, a message made of two halves may stand for the one that it cut through.
    index.complete = _confirmed(index) and not copied
