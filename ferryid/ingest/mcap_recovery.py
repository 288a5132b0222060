"""The index of an MCAP file that has none, or a damaged one: records found by walking, gaps passed over and told."""

from __future__ import annotations

import re
import struct
from collections.abc import Collection, Container, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_chunks import walk_chunk
from ferryid.ingest.mcap_index import (
    CHANNEL,
    CHUNK,
    DATA_END,
    LAST_OPCODE,
    MAGIC,
    MESSAGE,
    MESSAGE_HEADER,
    MESSAGE_INDEX,
    RECORD_HEADER,
    SCHEMA,
    Bytes,
    Chunk,
    DamagedRecord,
    Index,
    chunk_at,
    message_table,
    read_summary,
    record_header,
    walk,
)

# A message or chunk record of less than 1 TiB may begin here; the look-ahead lets candidates overlap.
_CANDIDATE = re.compile(rb"[\x05\x06](?=.{5}\x00{3})", re.DOTALL)
_CHAIN = 3
"""Records behind a candidate that must look like records too."""
_SUSPECTS = 4
"""Messages before a damaged place whose length may have led there."""
_DAMAGE = 0
"""Stands among the opcodes of a walk where the walk was broken."""


def read_index(file: memoryview, whole_file: Bytes, name: str) -> Index:
    """Return the index of a file, from its summary or else by walking the file.

    Parameters
    ----------
    file, whole_file
        The same bytes as a memoryview and as an array.
    name
        File name for losses.
    """
    try:
        index = read_summary(file)
        reason = None
    except DamagedRecord as error:
        index, reason = None, str(error)
    if index is None or _needs_walk(index):
        summary, index = index, scan(file, name)
        if summary is not None:
            index.statistics = summary.statistics
            index.schemas.update(summary.schemas)
            index.channels.update(summary.channels)
    index = _walked(index, file, whole_file, name)
    if reason is not None:
        found = sum(index.counts().values())
        what = f"{reason}; the index was rebuilt by walking the whole file, which found {found} messages"
        index.losses.insert(0, Loss(name, what, messages=0))
    return index


def _needs_walk(index: Index) -> bool:
    """Tell whether messages lie outside the indexed chunks, or the summary does not list all chunks."""
    if index.statistics is None or index.statistics.chunk_count != len(index.chunks):
        return True
    indexed = sum(index.counts().values())
    return index.statistics.message_count > indexed and all(chunk.indexed is not None for chunk in index.chunks)


def _walked(index: Index, file: memoryview, whole_file: Bytes, name: str) -> Index:
    """Walk the chunks that have no message index, or that hold channels defined nowhere else."""
    complete = index.statistics is not None and sum(index.counts().values()) == index.statistics.message_count
    for number, chunk in enumerate(index.chunks):
        unknown = any(channel not in index.channels for channel in chunk.indexed or ())
        if (chunk.indexed is None and not complete) or unknown:
            index.chunks[number] = _walk_into(index, chunk, file, whole_file, name, unknown)
    for chunk in index.chunks:
        if all(channel.schema_id in (0, *index.schemas) for channel in index.channels.values()):
            break
        if chunk.indexed is not None:
            _walk_into(index, chunk, file, whole_file, name, True)
    return index


def _walk_into(
    index: Index, chunk: Chunk, file: memoryview, whole_file: Bytes, name: str, definitions_only: bool
) -> Chunk:
    walked, definitions, loss = walk_chunk(file, whole_file, chunk, name)
    for opcode, content in definitions:
        if opcode in (SCHEMA, CHANNEL):
            try:
                index.define(opcode, content)
            except DamagedRecord as error:
                index.losses.append(Loss(name, str(error), None, None, chunk.start_ns, chunk.end_ns))
    if definitions_only and chunk.indexed is not None:
        return chunk
    if loss is not None:
        index.losses.append(loss)
    return walked


def scan(file: memoryview, name: str) -> Index:
    """Walk the records of a file from its beginning, and on behind every damaged stretch.

    Returns
    -------
    Index
        With the messages outside chunks in `loose`, and the stretches that are no records among the losses.
    """
    index = Index(data_end=len(file))
    offsets: list[int] = []
    records: list[tuple[int, int, int]] = []
    gaps: list[tuple[int, int]] = []
    position: int | None = len(MAGIC)
    while position is not None:
        messages, others, end = walk(file, position, len(file))
        position = None
        finished = [start for opcode, start, _ in others if opcode == DATA_END]
        index.data_end = min(finished, default=len(file))
        # What follows the data repeats it, and is damaged where the file had to be walked.
        others = [record for record in others if record[1] < index.data_end]
        _define(index, file, others)
        if not finished and _sane_chunk(file, end):
            # The file ends inside this chunk.
            others += [(CHUNK, end, len(file) - end - RECORD_HEADER), (_DAMAGE, end, 0)]
        elif not finished:
            end = _end_of_sound_records(messages, others, end)
            for suspect in messages[-_SUSPECTS:]:
                reach = suspect + RECORD_HEADER + record_header(file, suspect)[1]
                position = _next_record(file, suspect + 1, reach, index.channels)
                if position is not None:
                    # The length of that message is wrong: it reaches past the record found in it.
                    end = suspect
                    messages = [start for start in messages if start < end]
                    others = [record for record in others if record[1] < end]
                    break
            else:
                position = _next_record(file, end + 1, len(file), index.channels)
            others.append((_DAMAGE, end, 0))
            gaps.append((end, len(file) if position is None else position))
        offsets += messages
        records += others
    index.chunks = _chunks(file, records)
    if offsets:
        index.loose, _ = message_table(np.frombuffer(file, np.uint8), np.array(offsets, np.int64))
    index.losses += [_gap(index, start, stop, len(file), name) for start, stop in gaps]
    return index


def _end_of_sound_records(messages: list[int], others: list[tuple[int, int, int]], end: int) -> int:
    """Take records of an unknown kind just before a damaged place for a part of the damage."""
    while others and others[-1][0] > LAST_OPCODE and (not messages or others[-1][1] > messages[-1]):
        end = others.pop()[1]
    return end


def _define(index: Index, file: memoryview, records: Collection[tuple[int, int, int]]) -> None:
    for opcode, start, length in records:
        if opcode in (SCHEMA, CHANNEL):
            # A damaged definition stands again in the summary or a chunk; if not, its messages are reported lost.
            with suppress(DamagedRecord):
                index.define(opcode, file[start + RECORD_HEADER : start + RECORD_HEADER + length])


def _sane_chunk(file: memoryview, offset: int) -> bool:
    try:
        chunk_at(file, offset)
    except DamagedRecord:
        return False
    return True


def _next_record(file: memoryview, start: int, stop: int, channels: Container[int]) -> int | None:
    """Return where the first chunk, or message of a known channel, begins between `start` and `stop`."""
    for match in _CANDIDATE.finditer(file, start):
        if match.start() >= stop:
            return None
        position = match.start()
        if len(file) - position < MESSAGE_HEADER:
            return None
        if file[position] == CHUNK:
            if _sane_chunk(file, position):
                return position
        elif _leads_on(file, position, channels):
            return position
    return None


def _leads_on(file: memoryview, position: int, channels: Container[int]) -> bool:
    """Tell whether a complete message record stands at `position` and what follows looks like records."""
    for link in range(_CHAIN):
        room = len(file) - position
        if room < MESSAGE_HEADER:
            return link > 0
        opcode, length = record_header(file, position)
        if not 0 < opcode <= LAST_OPCODE or (link == 0 and length > room - RECORD_HEADER):
            return False
        if opcode == MESSAGE:
            (channel,) = struct.unpack_from("<H", file, position + RECORD_HEADER)
            if channel not in channels or length < MESSAGE_HEADER - RECORD_HEADER:
                return False
        if length > room - RECORD_HEADER:
            return True
        position += RECORD_HEADER + length
    return True


def _chunks(file: memoryview, records: Sequence[tuple[int, int, int]]) -> list[Chunk]:
    """Put the chunks of a walk together with the message indexes that follow each of them."""
    chunks: list[Chunk] = []
    following = False
    for opcode, start, length in records:
        if opcode == MESSAGE_INDEX and following:
            channel, size = struct.unpack_from("<HI", file, start + RECORD_HEADER) if length >= 6 else (0, 0)
            indexed = {**(chunks[-1].indexed or {}), channel: (start, size // 16)}
            chunks[-1] = replace(chunks[-1], indexed=indexed)
        elif opcode == CHUNK:
            try:
                chunk, _, end = chunk_at(file, start)
            except DamagedRecord:
                # Its inner lengths contradict the record's: what it holds cannot be trusted.
                following = False
                continue
            held = min(chunk.compressed_size, len(file) - chunk.data_offset)
            chunks.append(replace(chunk, compressed_size=held, truncated=end > len(file)))
            following = True
        else:
            if opcode == _DAMAGE and following:
                # Some of its message indexes may be missing.
                chunks[-1] = replace(chunks[-1], indexed=None)
            following = False
    return chunks


def _gap(index: Index, start: int, stop: int, size: int, name: str) -> Loss:
    """Say what a damaged stretch of bytes took away: the time between its neighbours."""
    before = [chunk.end_ns for chunk in index.chunks if chunk.offset < start]
    after = [chunk.start_ns for chunk in index.chunks if chunk.offset >= stop]
    if index.loose is not None:
        before += index.loose.log_ns[index.loose.starts <= start][-1:].tolist()
        after += index.loose.log_ns[index.loose.starts > stop][:1].tolist()
    last = max(before, default=None)
    if stop == size:
        what = "the file ends without its end record, and whatever followed is missing"
        return Loss(name, what, None, None, last, None)
    what = f"{stop - start} damaged bytes from byte {start} were passed over"
    return Loss(name, what, None, None, last, min(after, default=None))
