"""MCAP files written record by record, so that any field of any record may lie."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard

from ferryid.ingest.log import Loss
from ferryid.ingest.mcap_reader import McapLog

MAGIC = b"\x89MCAP0\r\n"
T0 = 1_700_000_000_000_000_000
COUNT, PER_CHUNK = 60, 15
COMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "": bytes,
    "zstd": zstandard.compress,
    "lz4": lz4.frame.compress,
}


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def channel(key: int = 1, topic: str = "/a") -> bytes:
    return record(4, struct.pack("<HH", key, 1) + text(topic) + text("cdr") + bytes(4))


def message(number: int, key: int = 1, time_ns: int | None = None, data: bytes | None = None) -> bytes:
    time_ns = T0 + number if time_ns is None else time_ns
    data = b"\0\1\0\0" + struct.pack("<d", number) if data is None else data
    return record(5, struct.pack("<HIQQ", key, number + 1, time_ns, time_ns) + data)


def chunk(
    content: bytes, compression: str = "", *, size: int | None = None, crc: bool = True, start: int = T0
) -> bytes:
    """Return a chunk record; `size` is what it states, by default the truth."""
    stored = COMPRESS[compression](content)
    header = (start, start + 100, len(content) if size is None else size, zlib.crc32(content) if crc else 0)
    return record(6, struct.pack("<QQQI", *header) + text(compression) + struct.pack("<Q", len(stored)) + stored)


def message_index(entries: Sequence[tuple[int, int]], key: int = 1) -> bytes:
    return record(7, struct.pack("<HI", key, 16 * len(entries)) + b"".join(struct.pack("<QQ", *one) for one in entries))


DEFINITIONS = record(3, struct.pack("<H", 1) + text("std_msgs/msg/Float64") + text("ros2msg") + text("float64 data"))
HEAD = MAGIC + record(1, text("ros2") + text("test")) + DEFINITIONS + channel()
DATA_END = record(15, bytes(4))


def footer(start: int, summary: bytes = b"", *, crc: bool = False) -> bytes:
    begin = struct.pack("<BQQQ", 2, 20, start, 0)
    return begin + struct.pack("<I", zlib.crc32(summary + begin) if crc else 0) + MAGIC


def chunk_records(compression: str = "", *, crc: bool = True) -> list[tuple[bytes, list[tuple[int, int]]]]:
    """Return four chunks of 15 messages, each with the entries of its index."""
    made = []
    for first in range(0, COUNT, PER_CHUNK):
        parts = [message(number) for number in range(first, first + PER_CHUNK)]
        places = np.cumsum([0, *map(len, parts[:-1])]).tolist()
        entries = [(T0 + first + row, place) for row, place in enumerate(places)]
        made.append((chunk(b"".join(parts), compression, crc=crc, start=T0 + first), entries))
    return made


def without_summary(chunks: Sequence[tuple[bytes, Sequence[tuple[int, int]]]]) -> bytes:
    return HEAD + b"".join(one + message_index(entries) for one, entries in chunks)


def chunk_index(offset: int, one: bytes, entries: int) -> bytes:
    start, end, size = struct.unpack_from("<QQQ", one, 9)
    (length,) = struct.unpack_from("<I", one, 37)
    name = one[41 : 41 + length].decode()
    lengths = struct.pack("<QQQQI", start, end, offset, len(one), 10) + struct.pack("<HQ", 1, offset + len(one))
    stored = len(one) - 49 - length
    return record(8, lengths + struct.pack("<Q", 15 + 16 * entries) + text(name) + struct.pack("<QQ", stored, size))


def statistics(messages: int = COUNT, by_channel: int | None = None, chunks: int = 4) -> bytes:
    counts = struct.pack("<IHQ", 10, 1, messages if by_channel is None else by_channel)
    return record(11, struct.pack("<QHIIIIQQ", messages, 1, 1, 0, 0, chunks, T0, T0 + COUNT) + counts)


def with_summary(
    chunks: Sequence[tuple[bytes, Sequence[tuple[int, int]]]],
    *,
    stated: bytes | None = None,
    definitions: bytes = DEFINITIONS + channel(),
    listed: Sequence[int] | None = None,
) -> bytes:
    """Return a finished file; `listed` are the chunks in the summary, by default all."""
    data, indexes = HEAD, []
    for one, entries in chunks:
        indexes.append(chunk_index(len(data), one, len(entries)))
        data += one + message_index(entries)
    data += DATA_END
    picked = range(len(chunks)) if listed is None else listed
    summary = definitions + b"".join(indexes[number] for number in picked)
    summary += statistics() if stated is None else stated
    return data + summary + footer(len(data), summary, crc=True)


def read(content: bytes, *, verify: bool = False) -> tuple[list[float], tuple[Loss, ...]]:
    """Return the values of ``/a`` and what was reported lost."""
    log = McapLog(Path("log.mcap"), content)
    if "/a" not in {topic.name for topic in log.topics}:
        return [], log.losses
    series = log.read({"/a": ["data"]}, verify=verify)["/a"]
    return series.columns["data"].tolist(), log.losses


def accounted(content: bytes, *, written: int = COUNT, verify: bool = False) -> tuple[list[float], tuple[Loss, ...]]:
    """Read a damaged file and check that nothing is there twice, made up, or gone without a report."""
    got, losses = read(content, verify=verify)
    assert len(set(got)) == len(got)
    assert set(got) <= set(map(float, range(written)))
    lost = sum(loss.messages or 0 for loss in losses)
    assert len(got) + lost == written or any(loss.messages is None for loss in losses), losses
    return got, losses
