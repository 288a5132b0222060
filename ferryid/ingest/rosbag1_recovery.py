"""Recovery of a ROS1 bag without a usable index: a walk over its records, and into its chunks."""

from __future__ import annotations

import hashlib
import re
import sys
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ferryid.ingest.rosbag1_chunks import Allowance, decompressed, missing, walk_chunk
from ferryid.ingest.rosbag1_records import (
    BAG_HEADER,
    CHUNK,
    CHUNK_INFO,
    COMPRESSIONS,
    CONNECTION,
    INDEX,
    MAGIC,
    MAX_CHUNKS,
    MAX_CONNECTIONS,
    Chunk,
    ChunkInfo,
    Connection,
    Record,
    RecordError,
    Records,
    chunk_of,
    connection_of,
    info_of,
    nanoseconds,
    note_index,
)

# Fields before the kind of a record in its header take up to this many bytes, and the header of a chunk, its index or its
# information this many in all; that of a connection has its topic too.
BEFORE_KIND = 64
MAX_SHORT_HEADER = 1024
EXCESS = "the bag holds more records than a recorder writes to as many bytes"
NOT_LISTED = "no chunk information agrees with them"
RESIZED = "its stated length is damaged, or they are"


@dataclass
class Walked:
    """What a walk over the records found.

    Attributes
    ----------
    connections, chunks
        Connections by number, and chunks in file order.
    gaps
        Stretches of bytes that are no records.
    missing
        Chunk information records of chunks that are not there any more.
    doubts
        Byte of a chunk to what was wrong with its index records: it was walked in their place.
    faults
        Byte of a chunk that was walked to what is wrong with the chunk itself.
    repeats
        Byte of a chunk that was left out to the byte of the same chunk before it.
    infos
        Number of chunk information records.
    index
        First byte of the chunk information behind the chunks and their index records, None where there is none.
    """

    connections: dict[int, Connection] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    gaps: list[tuple[int, int]] = field(default_factory=list)
    missing: list[ChunkInfo] = field(default_factory=list)
    doubts: dict[int, str] = field(default_factory=dict)
    faults: dict[int, str] = field(default_factory=dict)
    repeats: dict[int, int] = field(default_factory=dict)
    infos: int = 0
    index: int | None = None

    def in_gap(self, position: int) -> bool:
        """Tell whether a byte is in a stretch that is no record."""
        before = bisect_right(self.gaps, (position, sys.maxsize))
        return before > 0 and position < self.gaps[before - 1][1]

    def gap(self, first: int, end: int) -> None:
        """Note bytes that are no records."""
        self.gaps.append((first, end))
        # They may hold index records of the chunk before them: what it holds is then to be seen in itself alone.
        if self.chunks and first >= self.chunks[-1].end and self.index is None:
            self.chunks[-1].index.clear()


def walk(records: Records) -> Walked:
    """Walk over the records of a bag without an index, past damaged stretches, to the end of what is there.

    Raises
    ------
    RecordError
        For more connections or chunks than a recorder writes.
    """
    data = records.data
    found, finder = Walked(), _Finder(records)
    infos: list[ChunkInfo] = []
    doubtful: set[int] = set()
    position = len(MAGIC)
    while position < len(data):
        try:
            record = records.at(position)
            following = record.end
            if record.op == CHUNK:
                chunk = chunk_of(record)
                stated = chunk.end
                following = _end_of_chunk(finder, chunk)
                found.chunks.append(chunk)
                if chunk.end != stated:
                    # The index records found there may be another chunk's.
                    found.doubts[position] = RESIZED
            elif record.op == BAG_HEADER and position == len(MAGIC):
                following = finder.next(record.start, (CHUNK, CHUNK_INFO, CONNECTION))
                first = record.end if record.end < following else record.start
                if bytes(data[first:following]).strip():
                    found.gap(first, following)
            elif record.op == INDEX and found.chunks:
                duplicate = note_index(data, found.chunks[-1], record)
                if duplicate:
                    found.doubts[found.chunks[-1].position] = duplicate
            elif record.op == CONNECTION:
                connection = connection_of(data, record)
                if found.connections.setdefault(connection.number, connection) != connection:
                    doubtful.add(connection.number)
            elif record.op == CHUNK_INFO:
                infos.append(info_of(data, record))
                found.index = found.index or position
            else:
                raise RecordError(f"no record outside a chunk at byte {position}")
        except RecordError:
            following = finder.next(position + 1, (CHUNK,))
            if following == len(data):
                following = finder.next(position + 1, (CHUNK_INFO, CONNECTION))
            found.gap(position, following)
        _check_numbers(found)
        position = following
    for number in doubtful:
        del found.connections[number]
    infos = list({(info.chunk, info.start_ns, info.end_ns, *info.counts.items()): info for info in infos}.values())
    _drop_repeats(data, found)
    found.infos = len(infos)
    left = _assign_all(data, found, infos)
    if not all(found.in_gap(info.chunk) for info in left):
        # No damage accounts for what these records list: chunks may have index records of others behind them.
        for chunk in found.chunks:
            chunk.counts = chunk.start_ns = chunk.end_ns = None
            found.doubts.setdefault(chunk.position, NOT_LISTED)
        left = _assign_all(data, found, infos)
    by_place = {chunk.position: chunk for chunk in found.chunks}
    moved: list[ChunkInfo] = []
    for info in left:
        chunk_there = by_place.get(info.chunk)
        if chunk_there is None or chunk_there.counts is not None:
            moved.append(info)
        else:
            info.note_on(chunk_there)
    # What is left is of chunks that are lost, but for those whose times or place are wrong.
    by_counts: dict[Any, deque[Chunk]] = {}
    for chunk in found.chunks if moved else ():
        content = _content(data, chunk) if chunk.counts is None else None
        if content:
            by_counts.setdefault(content[2], deque()).append(chunk)
    for info in moved:
        same = by_counts.get(frozenset(info.counts.items()))
        if same:
            info.note_on(same.popleft())
        else:
            found.missing.append(info)
    return found


def _assign_all(data: Any, found: Walked, infos: list[ChunkInfo]) -> list[ChunkInfo]:
    """Give chunks their information records, after a look into those in doubt; returns the records that are left."""
    sure = [chunk for chunk in found.chunks if chunk.position not in found.doubts]
    left = _assign(data, sure, infos, moved=False)
    unlisted = [chunk for chunk in sure if chunk.counts is None]
    if _assign(data, unlisted, left, moved=True):
        # Records are left over: index records may stand behind a chunk that is not theirs.
        for chunk in unlisted:
            chunk.counts = chunk.start_ns = chunk.end_ns = None
            if chunk.index:
                found.doubts[chunk.position] = NOT_LISTED
    else:
        left = []
    _walk_chunks(data, found)
    left = _assign(data, found.chunks, left, moved=False)
    return _assign(data, found.chunks, left, moved=True)


def _check_numbers(found: Walked) -> None:
    if len(found.connections) > MAX_CONNECTIONS or len(found.chunks) > MAX_CHUNKS:
        raise RecordError(f"it holds more than {MAX_CONNECTIONS} connections or {MAX_CHUNKS} chunks")


def _end_of_chunk(finder: _Finder, chunk: Chunk) -> int:
    """Correct the end of a chunk whose stored length is damaged, from the record that must follow; returns the end."""
    size = len(finder.records.data)
    kind = finder.records.kind(chunk.end)
    if (
        chunk.end == size
        or kind in (INDEX, CHUNK)
        or (kind in (CONNECTION, CHUNK_INFO) and chunk.compression != "none")
    ):
        return chunk.end
    end = finder.next(chunk.start, (INDEX, CHUNK))
    if end < size:
        chunk.end = end
    return min(chunk.end, size)


class _Finder:
    """Finds where records begin. Once there is none of some kinds up to the end, it does not look for them again."""

    def __init__(self, records: Records) -> None:
        self.records = records
        self._absent: dict[tuple[int, ...], int] = {}

    def next(self, position: int, kinds: tuple[int, ...]) -> int:
        """Return the byte at which the next record of some kinds begins; the end of the data when there is none."""
        data = self.records.data
        if position >= self._absent.get(kinds, len(data)):
            return len(data)
        for marker in re.compile(b"\x04\x00\x00\x00op=[" + re.escape(bytes(kinds)) + b"]").finditer(data, position):
            place = marker.start()
            # The header's fields come in any order, so its length lies up to the other fields' length before the marker.
            for start in range(max(position, place - 4 - BEFORE_KIND), place - 3):
                # Only a header of a few fields that reaches past the marker is worth parsing.
                if place - start < int.from_bytes(data[start : start + 4], "little") <= MAX_SHORT_HEADER:
                    try:
                        if _complete(data, self.records.at(start)) in kinds:
                            return start
                    except RecordError:
                        continue
        self._absent[kinds] = position
        return len(data)


def _complete(data: Any, record: Record) -> int:
    """Return the kind of a record outside chunks that has all that one of its kind must have."""
    if record.op == CHUNK:
        if chunk_of(record).compression not in COMPRESSIONS:
            raise RecordError(f"a chunk of unknown compression at byte {record.position}")
    elif record.op == INDEX:
        note_index(data, Chunk(0, 0, 0, "", 0), record)
    elif record.op == CHUNK_INFO:
        info_of(data, record)
    elif record.op == CONNECTION:
        connection_of(data, record)
    return record.op


def _assign(data: Any, chunks: list[Chunk], infos: list[ChunkInfo], *, moved: bool) -> list[ChunkInfo]:
    """Give chunks without an information record the one that states what they hold; returns the records that are left.

    The record must be of a chunk at that place, or with `moved` of any: where bytes went missing or came in, all chunks
    behind them have moved.
    """
    free: dict[Any, deque[Chunk]] = {}
    for chunk in chunks if infos else ():
        if chunk.counts is None:
            content = _content(data, chunk)
            free.setdefault((content, None if moved else chunk.position), deque()).append(chunk)
    left: list[ChunkInfo] = []
    for info in infos:
        stated = info.start_ns, info.end_ns, frozenset(info.counts.items())
        same = free.get((stated, None if moved else info.chunk))
        if same:
            info.note_on(same.popleft())
        else:
            left.append(info)
    return left


def _content(data: Any, chunk: Chunk) -> tuple[int, int, frozenset[tuple[int, int]]] | None:
    """Return what a chunk information record of a chunk would state, by its index records or the walk over it."""
    counts = {number: chunk.count(number) for number in chunk.connections if chunk.count(number)}
    if not counts:
        return None
    times = np.concatenate([nanoseconds(chunk.entries(data, number)) for number in counts])
    return int(times.min()), int(times.max()), frozenset(counts.items())


def _drop_repeats(data: Any, found: Walked) -> None:
    """Leave out chunks that repeat another byte by byte."""
    alike: dict[tuple[int, int], list[Chunk]] = {}
    for chunk in found.chunks:
        alike.setdefault((chunk.size, chunk.end - chunk.start), []).append(chunk)
    for group in alike.values():
        seen: dict[bytes, Chunk] = {}
        for chunk in group if len(group) > 1 else ():
            digest = hashlib.blake2b(memoryview(data)[chunk.start : chunk.end]).digest()
            first = seen.setdefault(digest, chunk)
            if first is not chunk and chunk.end > chunk.start:
                found.repeats[chunk.position] = first.position
    found.chunks = [chunk for chunk in found.chunks if chunk.position not in found.repeats]


def _walk_chunks(data: Any, found: Walked) -> None:
    """Look into the chunks whose index records are lost or in doubt, or of unknown connections."""
    allowance = Allowance.of_file(len(data))
    for chunk in found.chunks:
        # The file may end between the index records of its last chunk.
        last = chunk is found.chunks[-1] and chunk.counts is None
        trusted = chunk.index and chunk.position not in found.doubts and not last
        known = all(number in found.connections for number in chunk.index)
        if chunk.walked is not None or (trusted and known):
            continue
        content = decompressed(data, chunk, allowance, exact=True)
        if content.whole and content.behind:
            # Its length is known now: what stands behind it, up to the record found there, may have been other chunks.
            end, chunk.end = chunk.end, chunk.end - content.behind
            found.gap(chunk.end, end)
        walked = walk_chunk(content.buffer, allowance)
        for number, connection in walked.connections.items():
            found.connections.setdefault(number, connection)
        _check_numbers(found)
        whole = content.whole and walked.whole
        if trusted and whole and not walked.entries.keys() >= chunk.indexed.keys():
            found.doubts[chunk.position] = "they are of an unknown connection"
            trusted = False
        if not trusted:
            chunk.walked = walked.entries
            if not whole:
                found.faults[chunk.position] = content.fault or (EXCESS if walked.excess else "its records are damaged")
            elif found.doubts.get(chunk.position, RESIZED if last else "") == RESIZED and missing(
                chunk, chunk, found.connections
            ):
                # A record with a damaged length may end where another one does, and swallow those between.
                found.faults[chunk.position] = "its index records count more messages than it holds"
    found.gaps.sort()
