"""Recovery of a ROS1 bag without a usable index: a walk over its records, and into its chunks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ferryid.ingest.rosbag1_records import (
    CHUNK,
    CHUNK_INFO,
    COMPRESSIONS,
    CONNECTION,
    INDEX,
    MAGIC,
    MESSAGE,
    Chunk,
    Connection,
    Entries,
    Record,
    RecordError,
    Records,
    chunk_of,
    connection_of,
    decompressed,
    note_chunk_info,
    note_index,
)


class Missing(NamedTuple):
    """A chunk that the index tells of and that is not there; times [ns] None where the record has none."""

    position: int
    messages: int
    start_ns: int | None
    end_ns: int | None


@dataclass
class Walked:
    """What a walk over the records found: `gaps` are stretches of bytes that are no records."""

    connections: dict[int, Connection] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    gaps: list[tuple[int, int]] = field(default_factory=list)
    missing: list[Missing] = field(default_factory=list)

    def gap(self, first: int, end: int) -> None:
        """Note bytes that are no records."""
        self.gaps.append((first, end))
        # They may hold index records of the chunk before them: what it holds is then to be seen in itself alone.
        if self.chunks and first >= self.chunks[-1].end:
            self.chunks[-1].index.clear()


def walk(records: Records) -> Walked:
    """Walk over the records of a bag without an index, past damaged stretches, to the end of what is there."""
    data = records.data
    found = Walked()
    position = len(MAGIC)
    by_position: dict[int, Chunk] = {}
    while position < len(data):
        try:
            record = records.at(position)
            if record.op == CHUNK:
                chunk = chunk_of(record)
                found.chunks.append(chunk)
                by_position[position] = chunk
            elif record.end > len(data):
                raise RecordError(f"the file ends in the record at byte {position}")
            elif record.op == INDEX and found.chunks:
                note_index(data, found.chunks[-1], record)
            elif record.op == CONNECTION:
                connection = connection_of(data, record)
                found.connections[connection.number] = connection
            elif record.op == CHUNK_INFO:
                _note_info(records, found, by_position, record)
            following = record.end
        except RecordError:
            following = _next_chunk(records, position + 1)
            found.gap(position, following)
        # A chunk whose length is damaged would swallow those behind it: its successor must be a record too.
        if following < len(data) and not _is_record(records, following):
            resumed = _next_chunk(records, position + 1)
            if resumed < following:
                found.gap(position, resumed)
                following = resumed
        position = following
    if found.chunks:
        # The file may end between the index records of its last chunk.
        found.chunks[-1].index.clear()
    _walk_chunks(data, found)
    return found


def _note_info(records: Records, found: Walked, chunks: dict[int, Chunk], record: Record) -> None:
    position = record.number(b"chunk_pos")
    chunk = chunks.get(position)
    if chunk is not None:
        note_chunk_info(chunk, record)
        return
    if record.end - record.start < 8 * record.number(b"count"):
        raise RecordError(f"chunk information of another size at byte {record.position}")
    absent = Chunk(position, 0, 0, "", 0)
    note_chunk_info(absent, record)
    counts = np.frombuffer(records.data, "<u4", 2 * record.number(b"count"), record.start)[1::2]
    found.missing.append(Missing(position, int(counts.sum()), absent.start_ns, absent.end_ns))


def _walk_chunks(data: Any, found: Walked) -> None:
    """Look into the chunks that have no index records, or messages of a connection not seen yet."""
    for chunk in found.chunks:
        if chunk.index and all(number in found.connections for number in chunk.index):
            continue
        buffer, _ = decompressed(data, chunk, exact=True)
        connections, entries = walk_chunk(buffer)
        found.connections = {**connections, **found.connections}
        if not chunk.index:
            chunk.walked = entries


def _is_record(records: Records, position: int) -> bool:
    try:
        records.at(position)
    except RecordError:
        return False
    return True


def _next_chunk(records: Records, position: int) -> int:
    """Find where the next chunk record begins; the end of the data when there is none."""
    data = records.data
    marker = b"\x04\x00\x00\x00op=\x05"
    place = data.find(marker, position)
    while place != -1:
        # The header's fields come in any order, so its length lies up to the other fields' length before the marker.
        for start in range(max(position, place - 64), place - 3):
            try:
                record = records.at(start)
                if record.op == CHUNK and chunk_of(record).compression in COMPRESSIONS:
                    return start
            except RecordError:
                continue
        place = data.find(marker, place + 1)
    return len(data)


def walk_chunk(buffer: Any) -> tuple[dict[int, Connection], dict[int, Entries]]:
    """List the connections and the message records of one decompressed chunk, up to its first damaged byte."""
    connections: dict[int, Connection] = {}
    entries: dict[int, list[tuple[int, int, int]]] = {}
    for record in _records(buffer):
        try:
            if record.op == CONNECTION:
                connection = connection_of(buffer, record)
                connections[connection.number] = connection
            elif record.op == MESSAGE:
                time = record.number(b"time")
                entry = (time & 0xFFFFFFFF, time >> 32, record.position)
                entries.setdefault(record.number(b"conn"), []).append(entry)
        except RecordError:
            break
    return connections, {number: np.array(found, np.uint32) for number, found in entries.items()}


def _records(buffer: Any) -> Iterator[Record]:
    position, records = 0, Records(buffer)
    while position < len(buffer):
        try:
            record = records.at(position)
        except RecordError:
            return
        if record.end > len(buffer):
            return
        yield record
        position = record.end
