"""First and last time of every channel of an MCAP file, without reading its messages."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.mcap_index import Chunk, DamagedRecord, Index, index_entries
from ferryid.types import Nanoseconds


def spans(index: Index, file: memoryview, channels: Iterable[int]) -> dict[int, tuple[int, int]]:
    """Return the first and last log time [ns] of each channel, from as few message indexes as possible."""
    known: dict[int, list[NDArray[np.int64]]] = {channel: [] for channel in channels}
    holding: dict[int, list[Chunk]] = {}
    tables = [] if index.loose is None else [index.loose]
    for chunk in index.chunks:
        if chunk.table is not None:
            tables.append(chunk.table)
        else:
            for channel in chunk.indexed or ():
                holding.setdefault(channel, []).append(chunk)
    for table in tables:
        for channel, messages in table.by_channel(known).items():
            known[channel].append(messages.log_ns)
    found: dict[int, tuple[int, int]] = {}
    for channel, parts in known.items():
        chunks = holding.get(channel, [])
        times = np.concatenate([*parts, np.empty(0, np.int64)])
        times = times[times >= 0]
        first = int(times.min()) if len(times) else None
        last = int(times.max()) if len(times) else None
        for chunk in sorted(chunks, key=lambda chunk: chunk.start_ns):
            if first is not None and chunk.start_ns >= first:
                break
            times = _times(chunk, file, channel)
            if len(times):
                first = int(times.min()) if first is None else min(first, int(times.min()))
        for chunk in sorted(chunks, key=lambda chunk: -chunk.end_ns):
            if last is not None and chunk.end_ns <= last:
                break
            times = _times(chunk, file, channel)
            if len(times):
                last = int(times.max()) if last is None else max(last, int(times.max()))
        if first is not None and last is not None:
            found[channel] = first, last
    return found


def _times(chunk: Chunk, file: memoryview, channel: int) -> Nanoseconds:
    """Return the log times of a channel's messages in a chunk that was not walked, without those past `LATEST_NS`."""
    offset, count = (chunk.indexed or {}).get(channel, (0, 0))
    if not count:
        return np.empty(0, np.int64)
    try:
        entries = index_entries(file, channel, offset, count)
    except DamagedRecord:
        # Found again, and reported, when the chunk is read.
        return np.array([chunk.start_ns, chunk.end_ns], np.int64)
    times: Nanoseconds = entries[:, 0]
    return times[times >= 0]
