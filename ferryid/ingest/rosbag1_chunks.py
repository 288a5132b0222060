"""What a chunk of a ROS1 bag holds: its decompression, within bounds, and a walk over its records."""

from __future__ import annotations

from array import array
from bz2 import BZ2Decompressor
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import lz4.frame
import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.ingest.rosbag1_records import (
    COMPRESSIONS,
    CONNECTION,
    MESSAGE,
    Chunk,
    Connection,
    Entries,
    RecordError,
    Records,
    connection_of,
    nanoseconds,
)

MAX_CHUNK = 512 << 20
FREE_CHUNK = 64 << 20
FREE_TOTAL = 256 << 20
FREE_RECORDS = 1 << 20
# What lz4 can expand to at most.
EXPANSION = 255
SALVAGE_STEP = 4096
DAMAGE = (RuntimeError, OSError, EOFError, ValueError, MemoryError)


@dataclass
class Allowance:
    """Bytes that the chunks of a file may still expand to, and records that walks over them may still take.

    A chunk expands to 64 MiB + 255 times its stored bytes at most, and to 512 MiB; one at a time is held, and twice
    that while it is decompressed. All chunks of a file of N bytes together expand to 256 MiB + 255 N at most.
    lz4 cannot reach either limit but by size; only bz2 data made for it, or megabytes of zeros, are cut off. Walks take a
    million records and one for every second byte of the file: every message that a recorder writes has its own time,
    which takes up more.
    """

    left: int
    records: int
    most: int = MAX_CHUNK

    @classmethod
    def of_file(cls, size: int) -> Allowance:
        """Return the allowance for one pass over a file of `size` bytes."""
        return cls(FREE_TOTAL + EXPANSION * size, FREE_RECORDS + size // 2)

    def of_chunk(self, stored: int) -> int:
        """Return how many bytes a chunk of `stored` bytes may expand to."""
        return max(0, min(self.most, FREE_CHUNK + EXPANSION * stored, self.left))


class Content(NamedTuple):
    """Decompressed chunk: `fault` is what is wrong, empty if nothing; `whole` when nothing of it is missing.

    `behind` counts the stored bytes behind the end of the compressed data, which are no part of them.
    """

    buffer: Any
    fault: str
    whole: bool
    behind: int = 0


def decompressed(data: Any, chunk: Chunk, allowance: Allowance, *, exact: bool, salvage: bool = True) -> Content:
    """Return the messages of a chunk, or what is left of them and what is wrong.

    Parameters
    ----------
    data
        The file.
    chunk
        Where in it.
    allowance
        Bytes that the chunk may expand to; what it expands to is taken off.
    exact
        Make sure of the length, for a chunk whose messages no index locates: ten times slower with lz4.
    salvage
        Return what comes before a damaged byte also where no checksum vouches for it: that of lz4 covers the whole chunk,
        that of bz2 each block.
    """
    stored = memoryview(data)[chunk.start : min(chunk.end, len(data))]
    cut = "it is cut off" if chunk.end > len(data) else ""
    stated = f"its stated size of {counted(chunk.size, 'byte')} is wrong"
    if chunk.compression == "none":
        return Content(stored, cut or (stated if len(stored) != chunk.size else ""), not cut)
    if chunk.compression not in COMPRESSIONS:
        return Content(b"", f"its compression {chunk.compression!r} is unknown", False)
    limit = allowance.of_chunk(len(stored))
    if chunk.compression == "lz4":
        limit = min(limit, EXPANSION * len(stored))
    if chunk.compression == "lz4" and not exact and not cut and chunk.size <= limit:
        try:
            allowance.left -= chunk.size
            return Content(memoryview(_lz4().decompress(stored, chunk.size)), "", True)
        except DAMAGE:
            pass
    content, fault, eof, behind = _expanded(stored, chunk.compression, min(chunk.size, limit), limit, salvage)
    allowance.left -= len(content)
    if not fault and not eof:
        fault = (
            f"it expands to more than the {counted(limit, 'byte')} that are allowed"
            if len(content) == limit
            else f"{len(content)} of {counted(chunk.size, 'byte')} decompress"
        )
    return Content(content, cut or fault or (stated if len(content) != chunk.size else ""), eof and not cut, behind)


def checksummed(data: Any, chunk: Chunk) -> bool:
    """Tell whether the compressed data has a checksum of its content."""
    flags = chunk.start + 4
    return chunk.compression == "bz2" or (chunk.compression == "lz4" and flags < len(data) and bool(data[flags] & 4))


@cache
def _lz4() -> Any:
    """Return Arrow's lz4 codec: eight times as fast as lz4.frame, but silent about an output shorter than asked for."""
    import pyarrow as pa

    return pa.Codec("lz4")


def _decoder(compression: str) -> Any:
    return lz4.frame.LZ4FrameDecompressor() if compression == "lz4" else BZ2Decompressor()


def _feed(decoder: Any, stored: Any, first: int, limit: int) -> bytes:
    """Decompress `stored`, `first` bytes at once and then in steps, to `limit` bytes at most."""
    content: bytes = decoder.decompress(stored, max(1, min(first, limit)))
    if decoder.eof or decoder.needs_input or len(content) >= limit:
        return content[:limit]
    parts, size = [content], len(content)
    while not decoder.eof and not decoder.needs_input and size < limit:
        part = decoder.decompress(b"", min(limit - size, FREE_CHUNK))
        if not part:
            break
        parts.append(part)
        size += len(part)
    return b"".join(parts)


def _expanded(
    stored: memoryview, compression: str, size: int, limit: int, salvage: bool
) -> tuple[bytes, str, bool, int]:
    """Return the content, what is wrong with it, whether its end was reached and how many bytes are stored behind it."""
    decoder = _decoder(compression)
    try:
        # One byte more than the stated size lets the decoder come to the end mark and its checksum.
        content = _feed(decoder, stored, size + 1, limit)
        return content, "", decoder.eof, len(decoder.unused_data or b"")
    except DAMAGE as error:
        fault = f"it does not decompress ({error})"
        if "contentChecksum" in str(error):
            fault, salvage = "its content does not match its checksum", False
        # All of it decompresses in these two cases, and any part of it may be wrong.
        if "frameSize_wrong" in str(error) or (compression == "lz4" and not salvage):
            return b"", fault, False, 0
    # Up to the first damaged byte: in steps to near it, then from the start again and up to it byte by byte.
    good = _steps(stored, 0, SALVAGE_STEP, compression, limit)[1]
    return _steps(stored, good, 1, compression, limit)[0], fault, False, 0


def _steps(stored: memoryview, first: int, step: int, compression: str, limit: int) -> tuple[bytes, int]:
    """Decompress `first` bytes at once and then in steps; returns the content and how many bytes were good."""
    decoder = _decoder(compression)
    content = bytearray()
    place = 0
    try:
        if first:
            content += _feed(decoder, stored[:first], FREE_CHUNK, limit)
        for place in range(first, len(stored), step):
            if decoder.eof or len(content) >= limit:
                break
            content += _feed(decoder, stored[place : place + step], FREE_CHUNK, limit - len(content))
        else:
            place = len(stored)
    except DAMAGE:
        pass
    return bytes(content), place


class WalkedChunk(NamedTuple):
    """Records of one decompressed chunk; `whole` when the last of them ends where the chunk does.

    `excess` when there are more of them than a walk may take.

    `following` leads from the place of each connection record to that of the message behind it, which index records may
    mean by that place.
    """

    connections: dict[int, Connection]
    entries: dict[int, Entries]
    whole: bool
    following: dict[int, int]
    excess: bool


def walk_chunk(buffer: Any, allowance: Allowance) -> WalkedChunk:
    """List the connections and the message records of one decompressed chunk, up to its first damaged byte.

    The records are taken off the `allowance`.
    """
    connections: dict[int, Connection] = {}
    entries: dict[int, array[int]] = {}
    size = memoryview(buffer).nbytes
    position, records = 0, Records(buffer)
    before: list[int] = []
    following: dict[int, int] = {}
    while position < size and allowance.records > 0:
        allowance.records -= 1
        try:
            record = records.at(position)
            if record.end > size:
                break
            if record.op == CONNECTION:
                before.append(position)
                connection = connection_of(buffer, record)
                connections[connection.number] = connection
            elif record.op == MESSAGE:
                time, number = record.number(b"time"), record.number(b"conn")
                if number not in entries:
                    entries[number] = array("I")
                entries[number].extend((time & 0xFFFFFFFF, time >> 32, position))
                following.update(dict.fromkeys(before, position))
                before.clear()
            else:
                break
        except RecordError:
            break
        position = record.end
    found = {number: np.frombuffer(one, np.uint32).reshape(-1, 3) for number, one in entries.items()}
    excess = position < size and allowance.records <= 0
    return WalkedChunk(connections, found, position == size, following, excess)


def distinct(starts: NDArray[np.int64], bounds: set[int]) -> bool:
    """Tell whether no message is listed twice; `bounds` are the rows at which the next topic begins."""
    steps = (np.flatnonzero(starts[1:] <= starts[:-1]) + 1).tolist()
    return bounds.issuperset(steps) or len(np.unique(starts)) == len(starts)


def covers(buffer: Any, places: NDArray[np.int64], ends: NDArray[np.int64]) -> bool:
    """Tell whether message records and connection records between them make up the whole chunk."""
    order = np.argsort(places, kind="stable")
    firsts = np.append(places[order], memoryview(buffer).nbytes)
    lasts = np.concatenate([[0], ends[order]])
    records = Records(buffer)
    for row in np.flatnonzero(firsts != lasts).tolist():
        position, stop = int(lasts[row]), int(firsts[row])
        while position < stop:
            try:
                record = records.at(position)
            except RecordError:
                return False
            if record.op != CONNECTION:
                return False
            position = record.end
        if position != stop:
            return False
    return True


class Replaced(NamedTuple):
    """A chunk read by a walk over it in place of its index, and the times of messages that only one of them has."""

    chunk: Chunk
    buffer: Any
    doubtful: dict[int, Entries]


def replaced(data: Any, chunk: Chunk, allowance: Allowance, *, intact: bool) -> Replaced | None:
    """Return a chunk as a walk over it finds it; None where the chunk cannot be trusted more than its index.

    It can where every byte of it belongs to a record, and either its content has a checksum or it holds as many messages
    of each connection as its index records count. `intact` when the index records list only messages that are there.
    """
    content = decompressed(data, chunk, allowance, exact=True)
    if not content.whole:
        return None
    walked = walk_chunk(content.buffer, allowance)
    if not walked.whole:
        return None
    entries, doubtful = walked.entries, dict[int, Entries]()
    if not checksummed(data, chunk):
        counts = {number: len(one) for number, one in entries.items()}
        if counts != chunk.indexed and not (intact and chunk.counts is None):
            return None
        for number, rows in _contradicted(data, chunk, walked).items():
            entries[number], doubtful[number] = entries[number][~rows], entries[number][rows]
    return Replaced(replace(chunk, walked=entries), content.buffer, doubtful)


def missing(chunk: Chunk, walked: Chunk, known: Collection[int]) -> dict[int, int]:
    """Return how many messages of each connection the index records of a chunk count beyond those that are in it.

    Messages of a known connection that the index records do not count make up for them, as then the index is damaged.
    """
    surplus = sum(max(0, walked.count(number) - chunk.indexed.get(number, 0)) for number in known)
    short: dict[int, int] = {}
    for number, count in chunk.indexed.items():
        beyond = max(0, count - walked.count(number))
        made_up = min(beyond, surplus)
        surplus -= made_up
        if beyond > made_up:
            short[number] = beyond - made_up
    return short


def _contradicted(data: Any, chunk: Chunk, walked: WalkedChunk) -> dict[int, NDArray[np.bool_]]:
    """Return which messages of each connection have another time in the index, and that may be the right one.

    The time of either may be damaged. Where the times of most messages differ, and those of the chunk information are the
    messages' own, the index records are another chunk's.
    """
    times = np.concatenate([np.empty(0, np.int64), *map(nanoseconds, walked.entries.values())])
    stated = bool(len(times)) and (times.min(), times.max()) == (chunk.start_ns, chunk.end_ns)
    doubtful: dict[int, NDArray[np.bool_]] = {}
    for number, entries in walked.entries.items():
        listed = {
            (seconds, ns, walked.following.get(place, place))
            for seconds, ns, place in chunk.entries(data, number).tolist()
        }
        if chunk.start_ns is not None and chunk.end_ns is not None:
            within = range(chunk.start_ns, chunk.end_ns + 1)
        else:
            within = range(2**63)
        places = {place for seconds, ns, place in listed if seconds * 1_000_000_000 + ns in within}
        rows = [
            (seconds, ns, place) not in listed and (place in places or seconds * 1_000_000_000 + ns not in within)
            for seconds, ns, place in entries.tolist()
        ]
        if any(rows):
            doubtful[number] = np.array(rows, np.bool_)
    count = sum(int(np.count_nonzero(rows)) for rows in doubtful.values())
    return {} if stated and 2 * count > len(times) else doubtful
