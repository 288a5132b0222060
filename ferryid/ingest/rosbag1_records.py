"""Records of a ROS1 bag (format 2.0): its index, and the walk that stands in for a missing one.

Reference: http://wiki.ros.org/Bags/Format/2.0
"""

from __future__ import annotations

import struct
from bz2 import BZ2Decompressor
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import lz4.frame
import numpy as np
from numpy.typing import NDArray

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
# A record header holds a few names, a topic among them; anything longer is damage.
MAX_HEADER = 1 << 16
# Index entries, shape (n, 3): seconds and nanoseconds of the receive time, place of the record in its chunk.
Entries = NDArray[np.uint32]
SALVAGE_STEP = 4096
# What lz4 can expand to at most; a stated size above that is damage, and would only be allocated for nothing.
LZ4_RATIO = 255
COMPRESSIONS = ("none", "bz2", "lz4")

_U32 = struct.Struct("<I").unpack_from


class RecordError(Exception):
    """Bytes that are no record of a bag."""


class Record(NamedTuple):
    """One record: its header fields and where its data lies [bytes]; `end` may be behind a truncated file's end."""

    position: int
    fields: Mapping[bytes, bytes]
    start: int
    end: int

    @property
    def op(self) -> int:
        """Kind of the record."""
        return self.fields[b"op"][0]

    def number(self, name: bytes) -> int:
        """Return an unsigned header field of four or eight bytes."""
        value = self.fields.get(name, b"")
        if len(value) not in (4, 8):
            raise RecordError(f"no {name.decode()} in the record at byte {self.position}")
        return int.from_bytes(value, "little")


@dataclass(frozen=True)
class Connection:
    """One publisher of one topic: its message type and that type's definition."""

    number: int
    topic: str
    msgtype: str
    md5sum: str
    definition: str


@dataclass
class Chunk:
    """One chunk of messages.

    Attributes
    ----------
    position
        Byte at which its record begins.
    start, end
        Its stored bytes; `end` is behind the end of a truncated file.
    compression
        ``"none"``, ``"bz2"`` or ``"lz4"``.
    size
        Bytes when decompressed.
    index
        Connection number to (byte of the first index entry, number of entries).
    walked
        Connection number to entries found in the chunk itself, for a chunk without an index.
    start_ns, end_ns
        Receive times of its messages [ns], None where no chunk information record tells.
    """

    position: int
    start: int
    end: int
    compression: str
    size: int
    index: dict[int, tuple[int, int]] = field(default_factory=dict)
    start_ns: int | None = None
    end_ns: int | None = None
    walked: dict[int, Entries] = field(default_factory=dict)

    def count(self, connection: int) -> int:
        """Number of messages of one connection."""
        if connection in self.walked:
            return len(self.walked[connection])
        return self.index.get(connection, (0, 0))[1]

    def entries(self, data: Any, connection: int) -> Entries:
        """Receive time and place in the decompressed chunk of every message of one connection, shape (n,)."""
        if connection in self.walked:
            return self.walked[connection]
        first, count = self.index.get(connection, (0, 0))
        return np.frombuffer(data, "<u4", 3 * count, first).reshape(count, 3)

    @property
    def connections(self) -> frozenset[int]:
        """Connections with messages in the chunk."""
        return frozenset(self.walked) | frozenset(self.index)


class Records:
    """Parses records; a header like one seen before (as all index records) is compared with it, not parsed."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self._size = len(data)
        # Length of a header to its bytes with the values masked, that mask, and where the values lie.
        self._seen: dict[int, tuple[int, int, tuple[tuple[bytes, int, int], ...]]] = {}

    def at(self, position: int) -> Record:
        """Parse the record that begins at a byte.

        Raises
        ------
        RecordError
            Where the bytes are no record, or the data ends within its header.
        """
        if position + 4 > self._size:
            raise RecordError(f"the data ends at byte {self._size}, in a record header")
        length = _U32(self.data, position)[0]
        stop = position + 4 + length
        if length > MAX_HEADER or stop + 4 > self._size:
            raise RecordError(f"no record header at byte {position}")
        header = bytes(self.data[position + 4 : stop])
        seen = self._seen.get(length)
        if seen is not None and int.from_bytes(header, "little") & seen[1] == seen[0]:
            fields = {name: header[start:end] for name, start, end in seen[2]}
        else:
            fields = self._parsed(header, position)
        return Record(position, fields, stop + 4, stop + 4 + _U32(self.data, stop)[0])

    def _parsed(self, header: bytes, position: int) -> dict[bytes, bytes]:
        spans: list[tuple[bytes, int, int]] = []
        mask = bytearray(b"\xff" * len(header))
        cursor = 0
        while cursor < len(header):
            size = _U32(header, cursor)[0] if cursor + 4 <= len(header) else 0
            start, end = cursor + 4, cursor + 4 + size
            name, equals, value = header[start:end].partition(b"=")
            if not equals or end > len(header):
                raise RecordError(f"no header fields in the record at byte {position}")
            spans.append((name, end - len(value), end))
            mask[end - len(value) : end] = bytes(len(value))
            cursor = end
        fields = {name: header[start:end] for name, start, end in spans}
        if len(fields.get(b"op", b"")) != 1:
            raise RecordError(f"no kind of record at byte {position}")
        kept = int.from_bytes(mask, "little")
        self._seen[len(header)] = int.from_bytes(header, "little") & kept, kept, tuple(spans)
        return fields


def connection_of(data: Any, record: Record) -> Connection:
    """Read a connection record."""
    inner: dict[bytes, bytes] = {}
    cursor, stop = record.start, min(record.end, len(data))
    while cursor + 4 <= stop:
        size = _U32(data, cursor)[0]
        name, equals, value = bytes(data[cursor + 4 : min(cursor + 4 + size, stop)]).partition(b"=")
        if not equals:
            raise RecordError(f"no connection in the record at byte {record.position}")
        inner[name] = value
        cursor += 4 + size
    try:
        topic = (record.fields.get(b"topic") or inner[b"topic"]).decode()
        msgtype, md5sum = inner[b"type"].decode(), inner[b"md5sum"].decode()
        definition = inner[b"message_definition"].decode(errors="replace")
    except (KeyError, UnicodeDecodeError) as error:
        raise RecordError(f"no connection in the record at byte {record.position}") from error
    return Connection(record.number(b"conn"), topic, msgtype, md5sum, definition)


def chunk_of(record: Record) -> Chunk:
    """Read the header of a chunk record."""
    compression = record.fields.get(b"compression", b"").decode(errors="replace")
    return Chunk(record.position, record.start, record.end, compression, record.number(b"size"))


def note_index(data: Any, chunk: Chunk, record: Record) -> None:
    """Add an index record to the chunk that it follows."""
    count = record.number(b"count")
    if record.number(b"ver") != 1 or record.end - record.start != 12 * count or record.end > len(data):
        raise RecordError(f"index record of another size or version at byte {record.position}")
    chunk.index[record.number(b"conn")] = record.start, count


def note_chunk_info(chunk: Chunk, record: Record) -> None:
    """Add the times of a chunk information record to its chunk."""
    times = [record.fields.get(name, b"") for name in (b"start_time", b"end_time")]
    if record.number(b"count") and all(len(time) == 8 for time in times):
        chunk.start_ns, chunk.end_ns = (_U32(time, 0)[0] * 1_000_000_000 + _U32(time, 4)[0] for time in times)


def read_index(records: Records) -> tuple[list[Connection], list[Chunk]]:
    """Read connections and chunks by the index at the file's end.

    Raises
    ------
    RecordError
        Where the bag has no index, or a damaged one.
    """
    data = records.data
    header = records.at(len(MAGIC))
    position = header.number(b"index_pos")
    if position == 0 or position > len(data):
        raise RecordError("the bag was not closed" if position == 0 else "the index lies behind the end of the file")
    connections, chunks = [], []
    for _ in range(header.number(b"conn_count")):
        record = records.at(position)
        if record.op != CONNECTION or record.end > len(data):
            raise RecordError(f"no connection at byte {position}")
        connections.append(connection_of(data, record))
        position = record.end
    for _ in range(header.number(b"chunk_count")):
        record = records.at(position)
        if record.op != CHUNK_INFO or record.end > len(data):
            raise RecordError(f"no chunk information at byte {position}")
        chunks.append(_indexed_chunk(records, record))
        position = record.end
    return connections, chunks


def _indexed_chunk(records: Records, info: Record) -> Chunk:
    record = records.at(info.number(b"chunk_pos"))
    if record.op != CHUNK or record.end > len(records.data):
        raise RecordError(f"no chunk at byte {record.position}")
    chunk = chunk_of(record)
    note_chunk_info(chunk, info)
    position = record.end
    for _ in range(info.number(b"count")):
        record = records.at(position)
        if record.op != INDEX:
            raise RecordError(f"no index record at byte {position}")
        note_index(records.data, chunk, record)
        position = record.end
    return chunk


class Messages:
    """Finds the data of message records in decompressed chunks; one shape of header serves them all."""

    def __init__(self) -> None:
        self._shapes: dict[int, np.dtype[np.void]] = {}

    def locate(
        self, buffer: Any, entries: Entries, connections: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_] | None]:
        """Return where the messages lie.

        Parameters
        ----------
        buffer
            A decompressed chunk.
        entries
            Times and places of the message records, shape (n,).
        connections
            Number of the connection that each must have, shape (n,).

        Returns
        -------
        tuple
            Starts and sizes [bytes], shape (n,), and which records are intact, None when all are.
        """
        places = entries[:, 2].astype(np.int64)
        limit = memoryview(buffer).nbytes
        shape = self._shape(buffer, int(places[0]))
        starts, sizes = np.zeros(len(places), np.int64), np.zeros(len(places), np.int64)
        good = np.zeros(len(places), np.bool_)
        if shape is not None:
            inside = places <= limit - shape.itemsize
            windows = np.ndarray((limit - shape.itemsize + 1,), f"V{shape.itemsize}", buffer=buffer, strides=(1,))
            headers = windows[places if inside.all() else np.where(inside, places, 0)].view(shape)
            starts = places + shape.itemsize
            sizes = headers["size"].astype(np.int64)
            good = (
                inside
                & (headers["length"] == shape.itemsize - 8)
                & (headers["op"] == MESSAGE)
                & (headers["conn"] == connections)
                & (headers["sec"] == entries[:, 0])
                & (headers["nsec"] == entries[:, 1])
                & (starts + sizes <= limit)
            )
            if good.all():
                return starts, sizes, None
        records = Records(buffer)
        for row in np.flatnonzero(~good).tolist():
            found = _message_at(records, int(places[row]), entries[row], int(connections[row]), limit)
            if found is not None:
                starts[row], sizes[row] = found.start, found.end - found.start
                good[row] = True
        return starts, sizes, good

    def _shape(self, buffer: Any, place: int) -> np.dtype[np.void] | None:
        """Return the shape of the message header at a place, None where none is."""
        try:
            known = self._shapes.get(_U32(buffer, place)[0])
            return known or self._new_shape(Records(buffer).at(place))
        except (RecordError, struct.error):
            return None

    def _new_shape(self, record: Record) -> np.dtype[np.void]:
        at, cursor = {}, 4
        # The fields come in the writer's order, each as its length, its name, "=" and the value.
        for name, value in record.fields.items():
            cursor += 4 + len(name) + 1
            at[name, len(value)] = cursor
            cursor += len(value)
        try:
            time = at[b"time", 8]
            places = [0, at[b"op", 1], at[b"conn", 4], time, time + 4, cursor]
        except KeyError as error:
            raise RecordError(f"no message at byte {record.position}") from error
        names, formats = ["length", "op", "conn", "sec", "nsec", "size"], ["<u4", "u1", "<u4", "<u4", "<u4", "<u4"]
        shape = np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": cursor + 4})
        self._shapes[cursor - 4] = shape
        return shape


def _message_at(records: Records, place: int, entry: Any, connection: int, limit: int) -> Record | None:
    """Return the one message record that an index entry means, None when it is damaged."""
    try:
        record = records.at(place)
        # An index entry may point at the connection record written before its first message.
        while record.op == CONNECTION:
            record = records.at(record.end)
        time = int(entry[0]) | int(entry[1]) << 32
        wanted = record.op == MESSAGE and record.number(b"conn") == connection and record.number(b"time") == time
    except RecordError:
        return None
    return record if wanted and record.end <= limit else None


def decompressed(data: Any, chunk: Chunk, *, exact: bool) -> tuple[Any, str]:
    """Return the messages of a chunk and an empty string, or what is left of them and what is wrong.

    Parameters
    ----------
    data
        The file.
    chunk
        Where in it.
    exact
        Make sure of the length, for a chunk whose messages no index locates: ten times slower with lz4.
    """
    stored = memoryview(data)[chunk.start : min(chunk.end, len(data))]
    fault = "it is cut off" if chunk.end > len(data) else ""
    if chunk.compression == "none":
        return stored, fault or ("its size is wrong" if len(stored) < chunk.size else "")
    if chunk.compression not in COMPRESSIONS:
        return b"", f"its compression {chunk.compression!r} is unknown"
    if chunk.compression == "lz4" and chunk.size > LZ4_RATIO * len(stored):
        return _salvaged(stored, "lz4"), fault or f"its stated size of {chunk.size} bytes is impossible"
    try:
        if chunk.compression == "lz4" and not exact and not fault:
            return memoryview(_lz4().decompress(stored, chunk.size)), ""
        # One byte more than the stated size lets the decoder come to the end mark and its checksum.
        decoder = _decoder(chunk.compression)
        content = decoder.decompress(stored, chunk.size + 1)
        if len(content) == chunk.size and decoder.eof:
            return content, fault
        fault = fault or f"{len(content)} of {chunk.size} bytes decompress"
    except (RuntimeError, OSError, EOFError, ValueError) as error:
        fault = fault or f"it does not decompress ({error})"
    return _salvaged(stored, chunk.compression), fault


@cache
def _lz4() -> Any:
    """Return Arrow's lz4 codec: eight times as fast as lz4.frame, but silent about an output shorter than asked for."""
    import pyarrow as pa

    return pa.Codec("lz4")


def _decoder(compression: str) -> Any:
    return lz4.frame.LZ4FrameDecompressor() if compression == "lz4" else BZ2Decompressor()


def _salvaged(stored: memoryview, compression: str) -> bytes:
    """Decompress up to the first damaged byte: in steps to near it, then from the start again and up to it byte by byte."""
    good = _steps(stored, 0, SALVAGE_STEP, compression)[1]
    return _steps(stored, good, 1, compression)[0]


def _steps(stored: memoryview, first: int, step: int, compression: str) -> tuple[bytes, int]:
    """Decompress `first` bytes at once and then in steps; returns the content and how many bytes were good."""
    decoder = _decoder(compression)
    content = bytearray(decoder.decompress(stored[:first]) if first else b"")
    for place in range(first, len(stored), step):
        if decoder.eof:
            break
        try:
            content += decoder.decompress(stored[place : place + step])
        except (RuntimeError, OSError, EOFError, ValueError):
            return bytes(content), place
    return bytes(content), len(stored)
