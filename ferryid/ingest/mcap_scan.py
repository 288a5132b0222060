"""The records of an MCAP file without a usable summary, found by walking it; damaged stretches are passed over."""

from __future__ import annotations

import re
import struct
from array import array
from bisect import bisect_left
from collections.abc import Container, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from mcap.records import Channel

from ferryid.counts import counted, verb
from ferryid.ingest.formats.mcap import MAGIC
from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_index import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    DATA_END,
    HEADER,
    LAST_OPCODE,
    MESSAGE,
    MESSAGE_HEADER,
    MESSAGE_INDEX,
    METADATA,
    RECORD_HEADER,
    SCHEMA,
    Chunk,
    DamagedRecord,
    Index,
    chunk_at,
    definition,
    lenient_chunk,
    message_table,
    record_header,
    sound_chunk,
    stored_crc,
    walk,
)

# A message or chunk record of less than 1 TiB may begin here; the look-ahead lets candidates overlap.
_CANDIDATE = re.compile(rb"[\x05\x06](?=.{5}\x00{3})", re.DOTALL)
_MAGIC = re.compile(re.escape(MAGIC))
_CHAIN = 3
"""Records behind a candidate that must look like records too."""
_SUSPECTS = 4
"""Records before a damaged place whose length may have led there."""
_SHOWN = 16
"""Damaged stretches that are reported one by one; a file with more has the others added up."""
Record = tuple[int, int, int]
"""Opcode, offset [bytes] and content length [bytes]."""


@dataclass
class _Found:
    """What the walk has found so far: records in file order, and stretches of bytes that are none."""

    offsets: array[int] = field(default_factory=lambda: array("q"))
    records: list[Record] = field(default_factory=list)
    gaps: list[tuple[int, int]] = field(default_factory=list)
    chunks: dict[int, Chunk] = field(default_factory=dict)
    """Chunks by offset whose header contradicts itself, with the size that leads to the next record."""


def scan(file: memoryview, name: str) -> Index:
    """Walk the records of a file from its beginning, and on behind every damaged stretch.

    Time and memory grow in proportion to the file: at most 12 bytes are held per byte of it.

    Returns
    -------
    Index
        With the messages outside chunks in `loose`, and the stretches that are no records among the losses.
    """
    index = Index(data_end=len(file))
    found = _Found()
    odd: list[Record] = []
    position: int | None = len(MAGIC)
    while position is not None:
        position = _segment(file, position, index, found, odd)
    index.chunks = _chunks(file, found, odd, index, name)
    if found.offsets:
        index.loose, _ = message_table(np.frombuffer(file, np.uint8), np.array(found.offsets, np.int64))
    index.losses += _gaps(index, found.gaps, len(file), name)
    if found.chunks:
        what = (
            f"{counted(len(found.chunks), 'chunk')} {verb(len(found.chunks), 'states')} two different "
            "sizes; the one that leads to the next record was taken"
        )
        index.losses.append(Loss(name, what, messages=0))
    if odd:
        size = sum(RECORD_HEADER + length for _, _, length in odd)
        kind, first, _ = min(odd, key=lambda record: record[1])
        what = (
            f"{counted(len(odd), 'damaged, unknown or misplaced record')} ({counted(size, 'byte')}) "
            f"{verb(len(odd), 'was')} passed over, the first of kind 0x{kind:02X} at byte {first}"
        )
        index.losses.append(Loss(name, what))
    return index


def _segment(file: memoryview, position: int, index: Index, found: _Found, odd: list[Record]) -> int | None:
    """Walk up to the next damaged place; returns where to go on behind it, None at the end of the data."""
    messages, others, end = walk(file, position, len(file))
    closing = _closing(messages, others)
    _define(index, file, [record for record in others if closing is None or record[1] < closing])
    if closing is not None and _next_record(file, end, len(file), index.channels) is None:
        # What follows the data repeats it, and is damaged where the file had to be walked.
        index.data_end = closing
        others = [record for record in others if record[1] < closing]
        _take(file, index, found, odd, messages, others)
        return None
    if sound_chunk(file, end) and _next_chunk(file, end + RECORD_HEADER) is None:
        # The file ends inside this chunk.
        others.append((CHUNK, end, len(file) - end - RECORD_HEADER))
        _take(file, index, found, odd, messages, others)
        found.gaps.append((end, len(file)))
        return None
    chunk = _repaired(file, end)
    if chunk is not None:
        length = chunk.data_offset + chunk.compressed_size - end - RECORD_HEADER
        found.chunks[end] = chunk
        _take(file, index, found, odd, messages, [*others, (CHUNK, end, length)])
        return end + RECORD_HEADER + length
    while others and others[-1][0] > LAST_OPCODE and (not messages or others[-1][1] > messages[-1]):
        # Records of an unknown kind just before a damaged place are a part of the damage.
        end = others.pop()[1]
    after = None
    last = [start for kind, start, _ in others[-_SUSPECTS:] if kind != CHUNK]
    for suspect in sorted([*messages[-_SUSPECTS:], *last]):
        reach = suspect + RECORD_HEADER + record_header(file, suspect)[1]
        after = _next_record(file, suspect + 1, reach, index.channels)
        if after is not None:
            # The length of that record is wrong: it reaches past the record found in it.
            end = suspect
            messages = messages[: bisect_left(messages, end)]
            others = [record for record in others if record[1] < end]
            break
    else:
        after = _next_record(file, end + 1, len(file), index.channels)
    _take(file, index, found, odd, messages, others)
    found.gaps.append((end, len(file) if after is None else after))
    return after


def unread_behind(file: memoryview, data_end: int, name: str) -> Loss | None:
    """Report what stands behind the data and is not of their summary: another log, or messages of unknown channels."""
    closed = _MAGIC.search(file, data_end)
    if closed is not None and closed.end() < len(file):
        what = (
            f"{counted(len(file) - closed.end(), 'byte')} behind the end of the log, from byte "
            f"{closed.end()} on, are not read"
        )
        return Loss(name, what)
    if data_end < len(file):
        start = _next_record(file, walk(file, data_end, len(file))[2], len(file), range(1 << 16))
        if start is not None:
            size = len(file) - start
            what = f"{counted(size, 'byte')} behind the end of the data {verb(size, 'holds')} records that are not read"
            return Loss(name, what)
    return None


def _closing(messages: Sequence[int], others: Sequence[Record]) -> int | None:
    """Return where the DataEnd record stands: the first one behind which no message and no chunk follows."""
    last = max(
        [*messages[-1:], *[start for kind, start, _ in others if kind in (CHUNK, MESSAGE_INDEX)][-1:]], default=0
    )
    return next((start for kind, start, size in others if kind == DATA_END and size == 4 and start > last), None)


def _take(
    file: memoryview, index: Index, found: _Found, odd: list[Record], messages: array[int], others: Sequence[Record]
) -> None:
    """Add the records of a segment to those found before; definitions are taken, and what cannot be right is noted."""
    found.offsets += messages
    found.records += others
    for record in others:
        kind, start, length = record
        content = file[start + RECORD_HEADER : start + RECORD_HEADER + length]
        if kind in (SCHEMA, CHANNEL):
            try:
                index.define(kind, content)
            except DamagedRecord:
                odd.append(record)
        elif kind == ATTACHMENT:
            if not _sound_attachment(content):
                odd.append(record)
        elif kind == METADATA:
            if 8 + int.from_bytes(content[:4], "little") > length:
                odd.append(record)
        elif kind not in (CHUNK, MESSAGE_INDEX) and (kind, start) != (HEADER, len(MAGIC)):
            odd.append(record)


def _define(index: Index, file: memoryview, records: Sequence[Record]) -> None:
    """Take the channels of a segment before its end is searched for messages of known channels."""
    for kind, start, length in records:
        if kind == CHANNEL:
            # A damaged one is noted when the segment is taken.
            with suppress(DamagedRecord):
                found = definition(kind, file[start + RECORD_HEADER : start + RECORD_HEADER + length])
                index.channels.setdefault(found.id, cast(Channel, found))


def _sound_attachment(content: memoryview) -> bool:
    """Tell whether the lengths in an attachment's header fit its record."""
    place = 16
    for _ in range(2):
        if place + 4 > len(content):
            return False
        place += 4 + struct.unpack_from("<I", content, place)[0]
    return place + 12 <= len(content) and place + 12 + struct.unpack_from("<Q", content, place)[0] <= len(content)


def _next_record(file: memoryview, start: int, stop: int, channels: Container[int]) -> int | None:
    """Return where the first chunk, or message of a known channel, begins between `start` and `stop`."""
    for match in _CANDIDATE.finditer(file, start):
        if match.start() >= stop:
            return None
        position = match.start()
        if len(file) - position < MESSAGE_HEADER:
            return None
        if file[position] == CHUNK:
            if record_header(file, position)[1] >= 40 and sound_chunk(file, position):
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


def _next_chunk(file: memoryview, start: int) -> int | None:
    """Return where the first chunk whose header agrees with itself begins."""
    for match in _CANDIDATE.finditer(file, start):
        if file[match.start()] == CHUNK and sound_chunk(file, match.start()):
            return match.start()
    return None


def _repaired(file: memoryview, offset: int) -> Chunk | None:
    """Return a chunk whose header states two different ends, with the one that a record follows; else None."""
    try:
        chunk = lenient_chunk(file, offset)
    except DamagedRecord:
        return None
    stated = chunk.data_offset + chunk.compressed_size, offset + RECORD_HEADER + record_header(file, offset)[1]
    for end in sorted(set(stated)):
        # What an uncompressed chunk holds are records too, so that one of no bytes always seems to lead to the next.
        if chunk.data_offset < end and _records_at(file, end):
            return replace(chunk, compressed_size=end - chunk.data_offset)
    return None


def _records_at(file: memoryview, position: int) -> bool:
    """Tell whether a record of a known kind stands at `position`, and behind it others or the end of the file."""
    if position + RECORD_HEADER > len(file):
        return False
    for _ in range(_CHAIN):
        if position + RECORD_HEADER > len(file) or bytes(file[position : position + len(MAGIC)]) == MAGIC:
            return True
        opcode, length = record_header(file, position)
        if not 0 < opcode <= LAST_OPCODE or length > len(file):
            return False
        position += RECORD_HEADER + length
    return position <= len(file)


def _chunks(file: memoryview, found: _Found, odd: list[Record], index: Index, name: str) -> list[Chunk]:
    """Put the chunks of a walk together with the message indexes that follow each of them."""
    groups: list[tuple[Chunk, list[Record]]] = []
    indexes: dict[bytes, memoryview] = {}
    behind = 0
    for record in found.records:
        opcode, start, length = record
        if opcode == CHUNK:
            chunk = found.chunks.get(start) or chunk_at(file, start)[0]
            held = min(chunk.compressed_size, len(file) - chunk.data_offset)
            groups.append((replace(chunk, compressed_size=held, truncated=chunk.compressed_size > held), []))
            indexes = {}
        elif opcode == MESSAGE_INDEX and start == behind:
            content = file[start + RECORD_HEADER : start + RECORD_HEADER + length]
            if indexes.setdefault(bytes(content[:2]), content) != content:
                # Another index for the same channel: that of a chunk that is not there.
                odd.append(record)
            groups[-1][1].append(record)
        else:
            if opcode == MESSAGE_INDEX:
                odd.append(record)
            continue
        behind = start + RECORD_HEADER + length
    known: dict[tuple[int, ...], tuple[Chunk, list[Record]]] = {}
    distinct: list[tuple[Chunk, list[Record]]] = []
    for chunk, records in groups:
        key = chunk.start_ns, chunk.end_ns, chunk.uncompressed_size, chunk.compressed_size
        first, others = known.setdefault(key, (chunk, records))
        if first is not chunk and _content(file, first) == _content(file, chunk):
            # What indexes one copy indexes the other.
            others += [] if others else records
        else:
            distinct.append((chunk, records))
    if len(distinct) < len(groups):
        what = (
            f"{counted(len(groups) - len(distinct), 'chunk')} {verb(len(groups) - len(distinct), 'is')} in "
            "the file twice, byte for byte; the copies were left out"
        )
        index.losses.append(Loss(name, what, messages=0))
    broken = {start for start, _ in found.gaps}
    made = [_with_index(file, chunk, records, broken) for chunk, records in distinct]
    # A writer makes checksums of all chunks or of none; tools that rescue a file may have rewritten a few of them.
    checksummed = 2 * sum(stored_crc(file, chunk.offset) != 0 for chunk in made) > len(made)
    return [replace(chunk, checksummed=checksummed) for chunk in made]


def _with_index(file: memoryview, chunk: Chunk, records: Sequence[Record], broken: Container[int]) -> Chunk:
    """Return a chunk with its message indexes; where they are damaged or perhaps not all, only with what they count."""
    indexed: dict[int, tuple[int, int]] = {}
    sound = True
    for _, start, length in records:
        channel, size = struct.unpack_from("<HI", file, start + RECORD_HEADER)
        sound = sound and start + RECORD_HEADER + length not in broken
        if length < 6 + size or size % 16 or channel in indexed:
            sound = False
        else:
            indexed[channel] = start, size // 16
    if sound:
        return replace(chunk, indexed=indexed or None)
    return replace(chunk, partial_index={channel: count for channel, (_, count) in indexed.items()})


def _content(file: memoryview, chunk: Chunk) -> memoryview:
    return file[chunk.data_offset : chunk.data_offset + chunk.compressed_size]


def _gaps(index: Index, gaps: Sequence[tuple[int, int]], size: int, name: str) -> Iterator[Loss]:
    """Report what damaged stretches of bytes took away: the time between their neighbours."""
    offsets = [chunk.offset for chunk in index.chunks]
    loose = index.loose
    more: list[tuple[int, int]] = []
    for start, stop in gaps:
        if len(gaps) > _SHOWN and stop < size:
            more.append((start, stop))
            continue
        before = [chunk.end_ns for chunk in index.chunks[: bisect_left(offsets, start)][-1:]]
        after = [chunk.start_ns for chunk in index.chunks[bisect_left(offsets, stop) :][:1]]
        if loose is not None:
            before += loose.log_ns[: int(np.searchsorted(loose.starts, start, "right"))][-1:].tolist()
            after += loose.log_ns[int(np.searchsorted(loose.starts, stop, "right")) :][:1].tolist()
        last = max((time for time in before if time >= 0), default=None)
        if stop == size:
            what = "the file ends without its end record, and whatever followed is missing"
            if start < size:
                what = (
                    f"the file ends without its end record: its last {counted(size - start, 'byte')}, from "
                    f"byte {start} on, are damaged "
                    "or cut off, and what they held is missing"
                )
            yield Loss(name, what, None, None, last, None)
        else:
            what = f"{counted(stop - start, 'damaged byte')} from byte {start} {verb(stop - start, 'was')} passed over"
            yield Loss(name, what, None, None, last, min((time for time in after if time >= 0), default=None))
    if more:
        lost = sum(stop - start for start, stop in more)
        yield Loss(
            name,
            f"{counted(lost, 'damaged byte')} in {counted(len(more), 'place')} from byte {more[0][0]} on "
            f"{verb(lost, 'was')} passed over",
        )
