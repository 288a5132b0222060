"""What a ROS1 bag that was read without its index has lost, as it is told to the user."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ferryid.counts import counted, verb
from ferryid.ingest.log import Loss
from ferryid.ingest.rosbag1_records import (
    CHUNK_INFO,
    CONNECTION,
    MAGIC,
    Chunk,
    RecordError,
    Records,
    nanoseconds,
)
from ferryid.ingest.rosbag1_recovery import Walked


def losses(file: str, data: Any, found: Walked, error: RecordError) -> list[Loss]:
    """Return what a walk found to be lost, and what it read in spite of damage, of a bag whose index failed."""
    size = len(data)
    lost: list[Loss] = []

    def add(what: str, messages: int | None, start_ns: int | None = None, end_ns: int | None = None) -> None:
        lost.append(Loss(file, what, None, messages, start_ns, end_ns))

    count = sum(chunk.count(number) for chunk in found.chunks for number in chunk.connections)
    add(f"the index cannot be used ({error}): a walk over all records found {counted(count, 'message')} without it", 0)
    _add_chunks(data, found, add)
    try:
        header = Records(data).at(len(MAGIC))
        announced, chunks = header.number(b"index_pos"), header.number(b"chunk_count")
    except RecordError:
        announced = chunks = 0
    # An index that is there shows that only its announced place is damaged, not that the file was cut.
    cut = found.index is None and announced > size
    if cut:
        add(*_estimate(data, found.chunks, announced))
    elif found.index is None and not announced:
        extent = _extent(data, found.chunks)
        add("the file ends without an index, and whatever followed is missing", None, extent and extent[1], None)
    for info in found.missing:
        messages = sum(info.counts.values())
        what = (
            f"the chunk at byte {info.chunk} is damaged: its {counted(messages, 'message')} {verb(messages, 'is')} lost"
        )
        add(what, messages, info.start_ns, info.end_ns)
    reported = {info.chunk for info in found.missing}
    index = found.index if found.index is not None else size
    if announced < size and Records(data).kind(announced) in (CONNECTION, CHUNK_INFO):
        index = announced
    # Without a gap in it the index lists every chunk that there was, as many as the bag header counts.
    listed = chunks == found.infos and index < size and all(chunk.counts is not None for chunk in found.chunks)
    listed = listed and all(end <= index for _, end in found.gaps)
    for first, end in found.gaps:
        # Damage to the index itself, the end of a cut file and chunks with a count are in the list already.
        if first in reported or first >= index or (end >= size and cut):
            continue
        if listed:
            add(f"bytes {first} to {end} are damaged: every chunk that the index lists was found without them", 0)
        else:
            add(f"bytes {first} to {end} are damaged: what they held is lost", None)
    return lost


def _add_chunks(data: Any, found: Walked, add: Callable[..., None]) -> None:
    """Report what each chunk lost, and in one line the chunks that were read in spite of their index records."""
    walked = [chunk for chunk in found.chunks if chunk.position in found.doubts and chunk.position not in found.faults]
    if walked:
        first = walked[0].position
        more = f" and {len(walked) - 1} more" if len(walked) > 1 else ""
        add(
            f"the index records of the chunk at byte {first}{more} are damaged ({found.doubts[first]}): "
            "its messages were read from the chunk itself",
            0,
        )
    for position, first in found.repeats.items():
        add(f"the chunk at byte {position} repeats that at byte {first}: its messages are taken once", 0)
    for chunk in found.chunks:
        fault = found.faults.get(chunk.position)
        if fault is None:
            continue
        kept = sum(chunk.count(number) for number in chunk.connections)
        if chunk.end > len(data):
            what = (
                f"the file ends in the chunk at byte {chunk.position}, which has {len(data) - chunk.start} of its "
                f"{counted(chunk.end - chunk.start, 'byte')}: {counted(kept, 'message')} of it {verb(kept, 'is')} intact"
            )
        else:
            what = (
                f"the chunk at byte {chunk.position} is damaged, {fault}: {counted(kept, 'message')} of it "
                f"{verb(kept, 'is')} intact"
            )
        counts = chunk.counts
        lost = None if counts is None else sum(max(0, n - chunk.count(one)) for one, n in counts.items())
        add(what, lost, chunk.start_ns, chunk.end_ns)


def _estimate(data: Any, chunks: Sequence[Chunk], index: int) -> tuple[str, None, int | None, int | None]:
    """Estimate how much of a bag is missing behind the end of the file, from the bytes that its header announces."""
    size, part = len(data), (index - len(data)) / len(data)
    what = f"the file ends at byte {size} of more than {index}: about {100 * (index - size) / index:.0f} % is lost at the end"
    extent = _extent(data, chunks)
    if extent is None:
        return what, None, None, None
    first, last, count = extent
    messages, seconds = part * count, part * (last - first) * 1e-9
    return f"{what}, by the rate before it {messages:.0f} messages in {seconds:.1f} s", None, last, None


def _extent(data: Any, chunks: Sequence[Chunk]) -> tuple[int, int, int] | None:
    """Return the first and the last receive time [ns] of the messages in chunks, and their number; None without any."""
    times = [
        nanoseconds(entries)
        for chunk in chunks
        for entries in (chunk.entries(data, number) for number in chunk.connections)
        if len(entries)
    ]
    if not times:
        return None
    return min(int(one.min()) for one in times), max(int(one.max()) for one in times), sum(map(len, times))
