"""Rows of rosbag2's messages table, found in the pages of an SQLite file instead of through SQL.

SQL makes three Python objects of every row, and stops at the first damaged page. The pages themselves hold the
messages as they are: their places are found with vectorised arithmetic and handed on without a copy, and damage
costs the rows it covers and no others. Layout: "Database File Format", sections 1.3, 1.6 and 2.1
(sqlite.org/fileformat2.html).
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

MAGIC = b"SQLite format 3\0"
LEAF, INTERIOR = 0x0D, 0x05
LAST_ROWID = 2**63 - 1
# Pages are read in runs of about this many bytes: they stay in the cache while their rows are decoded.
RUN_BYTES = 4 << 20
# More than the widest head of a row, so that a damaged one at the end of a buffer is still read inside it.
MARGIN = 64
# Bytes of an integer of serial type 0 to 9; 8 and 9 are the constants 0 and 1, and 7 is a float.
INTEGER_BYTES = np.array([0, 1, 2, 3, 4, 6, 8, 0, 0, 0], np.int64)


@dataclass(frozen=True)
class Rows:
    """Where the messages stand in the file, in order of rowid; every array has shape (n,).

    Attributes
    ----------
    rowid, topic_id, time_ns
        The columns of the table.
    start, size
        First byte in the file and number of bytes of the blob.
    local
        How many of these bytes follow `start` directly; fewer than `size` when the rest is on overflow pages.
    """

    rowid: Integers
    topic_id: Integers
    time_ns: Integers
    start: Integers
    size: Integers
    local: Integers

    def __len__(self) -> int:
        return self.rowid.size

    def take(self, which: Mask | Integers | slice) -> Rows:
        """Return the rows chosen by a mask, indices or a slice."""
        return Rows(*(getattr(self, field.name)[which] for field in fields(self)))


@dataclass(frozen=True)
class Damage:
    """Rows with ``low < rowid <= high`` that stood on a damaged or missing page.

    `high` is LAST_ROWID where the damage hides it. `rows` is how many are lost where the page itself still tells.
    """

    low: int
    high: int
    where: str
    rows: int | None = None


class Pages:
    """The pages of one SQLite file, read only; a context manager that closes the file.

    Raises
    ------
    FerryIdError
        The header of the file is not that of an SQLite database.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("rb", buffering=0)
        self.bytes = os.fstat(self._file.fileno()).st_size
        head = self._file.read(100)
        self.size = int.from_bytes(head[16:18], "big")
        if self.size == 1:
            self.size = 65536
        if len(head) < 100 or head[:16] != MAGIC or self.size < 512 or self.size & (self.size - 1):
            self._file.close()
            raise FerryIdError(
                f"{path}: not a readable SQLite database, the header of its {self.bytes} bytes is damaged or cut "
                "off. Fix: give the .db3 file as rosbag2 recorded it"
            )
        self.usable = self.size - head[20]
        # A page cut short by the end of the file is not used.
        self.count = self.bytes // self.size
        # Size that the header states, which old writers left at 0.
        self.stated = int.from_bytes(head[28:32], "big") * self.size

    def __enter__(self) -> Pages:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def page(self, number: int) -> Bytes:
        """Return one page, with a margin of zeros; pages count from 1."""
        raw = os.pread(self._file.fileno(), self.size, (number - 1) * self.size)
        return np.frombuffer(raw + bytes(MARGIN), np.uint8)

    def fill(self, buffer: Bytes, start: int, size: int) -> None:
        """Fill ``buffer[:size]`` with the bytes of the file from `start`."""
        view, done = buffer[:size].data, 0
        while done < size:
            got = os.preadv(self._file.fileno(), [view[done:]], start + done)
            if got == 0:
                raise FerryIdError(
                    f"{self.path}: became shorter while it was read, it had {self.bytes} bytes at first. "
                    "Fix: copy the file once its recorder has stopped"
                )
            done += got

    def blob(self, rows: Rows, i: int) -> bytes | None:
        """Return the message of row `i` gathered from its overflow pages, None when they are broken."""
        descriptor, left = self._file.fileno(), int(rows.size[i])
        local = int(rows.local[i])
        head = os.pread(descriptor, local + 4, int(rows.start[i]))
        parts, following = [head[:local]], int.from_bytes(head[local:], "big")
        left -= local
        while left > 0:
            if not 1 < following <= self.count:
                return None
            page = os.pread(descriptor, min(self.usable, left + 4), (following - 1) * self.size)
            parts.append(page[4:])
            left -= len(page) - 4
            following = int.from_bytes(page[:4], "big")
        return b"".join(parts)


def runs(numbers: Integers, page_size: int) -> Iterator[tuple[int, int]]:
    """Cut a list of pages into runs [first, last) that are worth reading in one piece.

    Parameters
    ----------
    numbers
        Pages in the order in which they are wanted, shape (n,); the same one may come several times in a row.
    """
    # Few foreign pages are read through; over many, or backwards, it pays to begin again.
    step = np.diff(numbers)
    jumps = np.flatnonzero((step < 0) | (step > 32)) + 1
    edges = [0, *jumps.tolist(), numbers.size]
    for first, end in itertools.pairwise(edges):
        while first < end:
            limit = numbers[first] + max(1, RUN_BYTES // page_size)
            last = first + int(np.searchsorted(numbers[first:end], limit))
            yield first, last
            first = last


def read_runs(pages: Pages, numbers: Integers) -> Iterator[tuple[int, int, Bytes, int]]:
    """Read pages run by run, each while the caller still works on the one before.

    Yields
    ------
    tuple
        The run as [first, last) of `numbers`; a buffer that holds it, followed by a margin, until the next is asked for;
        and where in the file the buffer begins.
    """
    buffers = [np.zeros(max(RUN_BYTES, pages.size) + MARGIN, np.uint8) for _ in range(2)]
    spans = []
    for first, last in runs(numbers, pages.size):
        start = (int(numbers[first]) - 1) * pages.size
        spans.append((first, last, start, int(numbers[last - 1]) * pages.size - start))
    with ThreadPoolExecutor(1) as pool:
        reading = [pool.submit(pages.fill, buffers[0], *span[2:]) for span in spans[:1]]
        for k, (first, last, start, _) in enumerate(spans):
            reading.pop().result()
            reading += [pool.submit(pages.fill, buffers[(k + 1) % 2], *span[2:]) for span in spans[k + 1 : k + 2]]
            yield first, last, buffers[k % 2], start


def words(buffer: Bytes, at: Integers) -> Integers:
    """Return the eight bytes from each place as a big-endian integer: one gather instead of eight."""
    windows: Any = np.ndarray((buffer.size - 7,), "V8", buffer=buffer, strides=(1,))
    gathered: Integers = windows[at].view(">i8").astype(np.int64)
    return gathered


def varint(buffer: Bytes, at: Integers) -> tuple[Integers, Integers]:
    """Decode SQLite's variable-length integers: 7 bits a byte, most significant first, 8 bits in a ninth.

    Returns
    -------
    tuple
        The values and the places behind them, shape (n,).
    """
    word = words(buffer, at)
    value = (word >> 56) & 0x7F
    more = word < 0
    end = at + 1
    for k in range(1, 9):
        if not more.any():
            break
        byte = (word >> (56 - 8 * k)) & 0xFF if k < 8 else buffer[at + 8].astype(np.int64)
        longer = (value << 7) | (byte & 0x7F) if k < 8 else (value << 8) | byte
        # Most often all go on together.
        value = longer if more.all() else np.where(more, longer, value)
        end += more
        more = more & (byte >= 0x80)
    return value, end


def integer(buffer: Bytes, at: Integers, serial: Integers) -> Integers:
    """Decode big-endian integers of the serial types 1 to 6, and the constants 8 and 9."""
    bits = 8 * INTEGER_BYTES[serial]
    # A shift by 64 is not defined; where there are no bytes it does not matter.
    return np.where(serial >= 8, serial - 8, words(buffer, at) >> np.minimum(64 - bits, 63))


def read_rows(pages: Pages, buffer: Bytes, at: Integers, file_start: int) -> tuple[Rows, Integers]:
    """Find the rows on leaf pages that lie in a buffer.

    Parameters
    ----------
    buffer
        Bytes of the file from `file_start`, followed by a margin.
    at
        Where the leaf pages begin in the buffer, shape (m,).

    Returns
    -------
    tuple
        The intact rows, and for each page the number of its rows that are damaged, shape (m,); -1 for a page that
        is no leaf at all.
    """
    cells = buffer[at + 3].astype(np.int64) << 8 | buffer[at + 4]
    good = (buffer[at] == LEAF) & (8 + 2 * cells <= pages.usable)
    cells[~good] = 0
    owner = np.repeat(np.arange(at.size), cells)
    rank = np.arange(owner.size) - np.repeat(np.cumsum(cells) - cells, cells)
    base = at[owner]
    offset = (words(buffer, base + 8 + 2 * rank) >> 48) & 0xFFFF

    sound = (offset >= 8) & (offset < pages.usable)
    payload, place = varint(buffer, base + np.where(sound, offset, 0))
    rowid, place = varint(buffer, place)
    word = words(buffer, place)
    header, null = (word >> 56) & 0xFF, (word >> 48) & 0xFF
    topic_kind, time_kind = (word >> 40) & 0xFF, (word >> 32) & 0xFF
    blob_kind, body = varint(buffer, place + 4)
    sound &= (body == place + header) & (null == 0) & (blob_kind >= 12)
    for kind in (topic_kind, time_kind):
        sound &= (kind >= 1) & (kind <= 9) & (kind != 7)
        kind[~sound] = 9
    time_at = body + INTEGER_BYTES[topic_kind]
    start = time_at + INTEGER_BYTES[time_kind]
    size = (blob_kind - 12) >> 1
    sound &= payload == header + (start - body) + size

    # What does not fit on the page is cut as section 1.6 says, the rest stands on overflow pages.
    usable = pages.usable
    least = (usable - 12) * 32 // 255 - 23
    kept = least + (payload - least) % (usable - 4)
    kept = np.where(payload <= usable - 35, payload, np.where(kept <= usable - 35, kept, least))
    local = kept - (start - place)
    sound &= (local >= 0) & (start + local <= base + usable)

    rows = Rows(
        rowid,
        integer(buffer, body, topic_kind),
        integer(buffer, time_at, time_kind),
        start + file_start,
        size,
        local,
    )
    bad = np.where(good, np.bincount(owner[~sound], minlength=at.size), -1)
    return (rows if sound.all() else rows.take(sound)), bad


def children(pages: Pages, number: int) -> tuple[Integers, Integers] | None:
    """Return the pages under an interior page and the last rowid under each but the last, None if it is damaged."""
    page = pages.page(number)
    cells = int(page[3]) << 8 | int(page[4])
    if page[0] != INTERIOR or 12 + 2 * cells > pages.usable:
        return None
    pointers = page[12 : 12 + 2 * cells].astype(np.int64)
    at = pointers[0::2] << 8 | pointers[1::2]
    if cells and int(at.max()) + 4 > pages.usable:
        return None
    places = np.append(at, 8)
    numbers = np.zeros(cells + 1, np.int64)
    for k in range(4):
        numbers = numbers << 8 | page[places + k]
    keys, _ = varint(page, at + 4)
    return numbers, keys


def leaves(pages: Pages, root: int) -> tuple[Integers, Integers, Integers, list[Damage], bool]:
    """Walk a table's b-tree level by level from its root.

    Returns
    -------
    tuple
        Numbers of the leaf pages in order of rowid, shape (m,), with the bounds ``low < rowid <= high`` of each; what
        is lost on the way; and whether an interior page is, so that sound leaves may lie unreached.
    """
    numbers, low, high = np.array([root]), np.array([0]), np.array([LAST_ROWID])
    damages: list[Damage] = []
    lost_branch = False
    # A tree deeper than this cannot be: each level has at least two children.
    for _ in range(64):
        there = (numbers > 1) & (numbers <= pages.count)
        damages += [
            Damage(int(a), int(b), f"page {n} is missing")
            for n, a, b in zip(numbers[~there], low[~there], high[~there], strict=True)
        ]
        numbers, low, high = numbers[there], low[there], high[there]
        kinds = (int(pages.page(n)[0]) for n in numbers.tolist())
        kind = next((kind for kind in kinds if kind in (LEAF, INTERIOR)), None)
        if kind != INTERIOR:
            # All leaves are at one level. Where no page of it can be told, more may have been below.
            return numbers, low, high, damages, lost_branch or kind is None
        lost_branch |= not there.all()
        below: list[tuple[Integers, Integers, Integers]] = []
        for number, after, until in zip(numbers.tolist(), low.tolist(), high.tolist(), strict=True):
            found = children(pages, number)
            if found is None:
                lost_branch = True
                damages.append(Damage(after, until, f"page {number} is damaged"))
                continue
            below.append((found[0], np.append(after, found[1]), np.append(found[1], until)))
        if not below:
            break
        numbers, low, high = (np.concatenate(part) for part in zip(*below, strict=True))
    return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64), damages, True


def find_rows(pages: Pages, root: int, topics: set[int]) -> tuple[Rows, list[Damage]]:
    """Index every intact row of the messages table.

    Parameters
    ----------
    root
        Root page of the table.
    topics
        Rows of other topics are not of this table: it tells a stray leaf from one of another table.

    Returns
    -------
    tuple
        The rows in order of rowid, and the stretches of rowids in which rows are lost.
    """
    numbers, low, high, damages, lost_branch = leaves(pages, root)
    rows = _Table()
    bad = _visit(pages, numbers, rows)
    damages += [
        Damage(int(low[i]), int(high[i]), f"page {numbers[i]} is damaged", int(bad[i]) if bad[i] > 0 else None)
        for i in np.flatnonzero(bad).tolist()
    ]
    found = rows.rows()
    if lost_branch:
        # Leaves whose way from the root is lost may stand anywhere in the file.
        strays = _Table()
        _visit(pages, np.setdiff1d(np.arange(2, pages.count + 1), numbers), strays)
        stray = strays.rows()
        lost = np.zeros(len(stray), bool)
        for damage in damages:
            lost |= (stray.rowid > damage.low) & (stray.rowid <= damage.high)
        stray = stray.take(lost & np.isin(stray.topic_id, sorted(topics)))
        found = Rows(*(np.append(getattr(found, f.name), getattr(stray, f.name)) for f in fields(Rows)))
        _, order = np.unique(found.rowid, return_index=True)
        found = found.take(order)
    return found, sorted(damages, key=lambda damage: damage.low)


def _visit(pages: Pages, numbers: Integers, rows: _Table) -> Integers:
    """Add the rows of leaf pages to `rows`; return what `read_rows` says of each page."""
    bad = np.zeros(numbers.size, np.int64)
    for first, last, buffer, start in read_runs(pages, numbers):
        part, bad[first:last] = read_rows(pages, buffer, (numbers[first:last] - 1) * pages.size - start, start)
        rows.add(part, numbers.size / last)
    return bad


class _Table:
    """Rows collected in arrays that seldom grow: fresh memory costs more than decoding."""

    def __init__(self) -> None:
        self._arrays = [np.zeros(0, np.int64) for _ in fields(Rows)]
        self._filled = 0

    def add(self, part: Rows, scale: float) -> None:
        """Append rows; `scale` is how many times what is here so far is expected in the end."""
        end = self._filled + len(part)
        if end > self._arrays[0].size:
            capacity = int(1.02 * scale * end) + 1
            grown = [np.empty(capacity, np.int64) for _ in self._arrays]
            for new, old in zip(grown, self._arrays, strict=True):
                new[: self._filled] = old[: self._filled]
            self._arrays = grown
        for array, field in zip(self._arrays, fields(part), strict=True):
            array[self._filled : end] = getattr(part, field.name)
        self._filled = end

    def rows(self) -> Rows:
        """Return everything added, in that order."""
        return Rows(*(array[: self._filled] for array in self._arrays))
