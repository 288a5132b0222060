"""The summary section of an MCAP file: definitions, chunk indexes and statistics, held against the file around it."""

from __future__ import annotations

import struct
from collections.abc import Callable
from itertools import pairwise

from mcap.records import Statistics

from ferryid.ingest.checksum import crc32
from ferryid.ingest.formats.mcap import MAGIC
from ferryid.ingest.mcap_index import (
    ATTACHMENT,
    CHANNEL,
    CHUNK_INDEX,
    DATA_END,
    FOOTER,
    FOOTER_SIZE,
    HEADER,
    LATEST_NS,
    METADATA,
    PRIVATE,
    RECORD_HEADER,
    SCHEMA,
    STATISTICS,
    Chunk,
    DamagedRecord,
    Index,
    parsed,
    record_header,
    walk,
)

_chunk_index_fields: Callable[..., tuple[int, int, int, int, int]] = struct.Struct("<QQQQI").unpack_from
_BETWEEN = frozenset({HEADER, SCHEMA, CHANNEL, ATTACHMENT, METADATA, DATA_END})
"""Records that may stand between chunks without a message in them."""


def summary_start(file: memoryview) -> tuple[int, int, int]:
    """Return where the footer stands, where it has the summary (0 for none) and the checksum of that (0 for none).

    Raises
    ------
    DamagedRecord
        Where the file does not end as a finished file does.
    """
    footer = len(file) - FOOTER_SIZE
    if footer < len(MAGIC) or file[-len(MAGIC) :] != MAGIC or record_header(file, footer) != (FOOTER, 20):
        raise DamagedRecord("the end of the file is missing")
    start, _, crc = struct.unpack_from("<QQI", file, footer + RECORD_HEADER)
    return footer, start, crc


def read_summary(file: memoryview, moved_to: int | None = None) -> Index | None:
    """Read the summary section.

    Parameters
    ----------
    file
        The bytes of the file.
    moved_to
        Where it begins, in a file whose footer has it elsewhere.

    Returns
    -------
    Index or None
        None where a finished file simply has no summary.

    Raises
    ------
    DamagedRecord
        Where the file does not end as a finished file does, or the summary is damaged.
    """
    footer, start, crc = summary_start(file)
    if start == 0:
        return None
    start = start if moved_to is None else moved_to
    if not len(MAGIC) <= start <= footer:
        raise DamagedRecord("the footer points nowhere")
    if crc and crc32(file[start : footer + RECORD_HEADER + 16]) != crc:
        raise DamagedRecord("the checksum of the summary is wrong")
    messages, others, end = walk(file, start, footer)
    if end != footer or messages:
        raise DamagedRecord("the summary is damaged")
    index = Index(data_end=start)
    extents: list[tuple[int, int]] = []
    try:
        for opcode, position, length in others:
            content = file[position + RECORD_HEADER : position + RECORD_HEADER + length]
            if opcode in (SCHEMA, CHANNEL):
                index.define(opcode, content)
            elif opcode == CHUNK_INDEX:
                try:
                    chunk, extent = _chunk_from_index(content)
                except DamagedRecord as error:
                    index.contradiction = str(error)
                    continue
                index.chunks.append(chunk)
                extents.append(extent)
            elif opcode == STATISTICS:
                statistics = parsed(Statistics.read, content)
                if index.statistics not in (None, statistics):
                    raise DamagedRecord("the summary holds two statistics")
                index.statistics = statistics
    except (struct.error, UnicodeDecodeError) as error:
        raise DamagedRecord(f"a record of the summary cannot be parsed ({error})") from error
    index.chunks.sort(key=lambda chunk: chunk.offset)
    index.contradiction = index.contradiction or _contradiction(file, start, sorted(extents))
    return index


def _chunk_from_index(content: memoryview) -> tuple[Chunk, tuple[int, int]]:
    """Parse a ChunkIndex record; returns the chunk, and where it and its message indexes begin and end in the file.

    The lengths of the message indexes follow from where the next one begins.
    """
    start_ns, end_ns, offset, length, size = _chunk_index_fields(content, 0)
    places = sorted((place, channel) for channel, place in struct.iter_unpack("<HQ", content[36 : 36 + size]))
    index_length, name_length = struct.unpack_from("<QI", content, 36 + size)
    name = bytes(content[48 + size : 48 + size + name_length]).decode("ascii")
    stored, unpacked = struct.unpack_from("<QQ", content, 48 + size + name_length)
    end = offset + length + index_length
    ends = [place for place, _ in [*places, (end, 0)][1:]]
    indexed = {channel: (place, (end - place - 15) // 16) for (place, channel), end in zip(places, ends, strict=True)}
    if (
        length != 49 + name_length + stored
        or any(count < 0 for _, count in indexed.values())
        or len(indexed) != len(places)
        or (places and places[0][0] != offset + length)
    ):
        raise DamagedRecord("a chunk index contradicts itself")
    times = min(start_ns, LATEST_NS), min(end_ns, LATEST_NS)
    data_offset = offset + 49 + name_length
    return Chunk(offset, *times, name, data_offset, stored, unpacked, indexed or None), (offset, end)


def _contradiction(file: memoryview, stop: int, extents: list[tuple[int, int]]) -> str | None:
    """Tell whether listed chunks overlap, or leave out another chunk; None where they do not."""
    if not extents:
        # Messages outside chunks are found by walking the file.
        return None
    for (_, end), (start, _) in pairwise([(0, len(MAGIC)), *extents, (stop, stop)]):
        if end > start or start > stop:
            return "the summary lists chunks that overlap or lie outside the data"
        if end < start:
            _, others, reached = walk(file, end, start)
            if reached != start or any(opcode not in _BETWEEN and opcode < PRIVATE for opcode, _, _ in others):
                return "the summary and the records between the chunks disagree"
    return None
