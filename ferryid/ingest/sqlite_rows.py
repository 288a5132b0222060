"""Rows of rosbag2's messages table: which there are, and which are lost.

A row that becomes Python objects costs more than its decoding. SQLite itself concatenates the columns of some
thousand rows, so that one statement returns their numbers as one text. Where a statement
meets a damaged page, its range of rowids is divided until only the rows of that page are left out.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, fields

import numpy as np

from ferryid.counts import counted
from ferryid.ingest.sqlite_database import FAULTS, Database
from ferryid.types import Flags, Ints

LAST_ROWID = 2**63 - 1
CHUNK_ROWS = 4096
# No row with four columns takes less of a page than this.
ROW_BYTES = 8
# Statements that may fail on a damaged file before the rest of it is given up.
MAX_FAILURES = 100_000
MAX_RETRIES = 2_000
SPARSE_CHUNKS = 1_000

TABLE = "FROM messages NOT INDEXED WHERE rowid BETWEEN ? AND ?"
NUMBERS = (
    "SELECT count(*), max(topic_id), max(timestamp), group_concat(rowid), group_concat(topic_id), "
    f"group_concat(timestamp), group_concat(length(data)) {TABLE}"
)
ROWS = f"SELECT rowid, topic_id, timestamp, length(data) {TABLE}"


@dataclass(frozen=True)
class Rows:
    """Columns of the messages, every array of shape (n,).

    Attributes
    ----------
    rowid, topic_id, time_ns
        As in the table.
    size
        Length of the data [bytes].
    """

    rowid: Ints
    topic_id: Ints
    time_ns: Ints
    size: Ints

    def __len__(self) -> int:
        return self.rowid.size

    def take(self, which: Flags | Ints | slice) -> Rows:
        """Return the rows chosen by a mask, indices or a slice."""
        return Rows(*(getattr(self, field.name)[which] for field in fields(self)))


@dataclass(frozen=True)
class Stretch:
    """Lost rows between two that were read: rowids ``low < rowid < high``, and their number or None."""

    low: int
    high: int
    count: int | None


@dataclass(frozen=True)
class Scan:
    """What the messages table holds.

    Attributes
    ----------
    rows
        Readable rows, in order of rowid.
    invalid
        Number of rows whose topic, time or data are of another type.
    stretches
        Where rows are lost.
    complete
        False where more rows may be lost than those of `stretches`.
    indexed
        Whether an index lists all rows of the table, so that deleted rows are not taken for lost ones.
    reason
        What is damaged, or an empty string.
    """

    rows: Rows
    invalid: int
    stretches: tuple[Stretch, ...]
    complete: bool
    indexed: bool
    reason: str


class _Salvage:
    """Reads the numbers of all rows that can be read."""

    def __init__(self, database: Database, connection: sqlite3.Connection) -> None:
        self._database = database
        self._connection = connection
        self._failures = 0
        self.pieces: list[Rows] = []
        self.invalid: list[int] = []
        self.bad: list[tuple[int, int]] = []
        self.reason = ""

    def add(self, piece: tuple[Rows, list[int]]) -> None:
        """Take rows that were read, and the rowids of invalid ones."""
        if len(piece[0]):
            self.pieces.append(piece[0])
        self.invalid += piece[1]

    def read(self, low: int, high: int) -> None:
        """Add every readable row with ``low <= rowid <= high``."""
        width = high - low + 1
        while low <= high:
            width = min(width, high - low + 1)
            piece = self._try(low, low + width - 1)
            if piece is not None:
                self.add(piece)
                low += width
                width *= 2
            elif self._failures > MAX_FAILURES:
                self.bad.append((low, high))
                return
            elif width > 1:
                width //= 2
            else:
                after = self._next(low, high)
                self.bad.append((low, after - 1))
                low = after

    def _try(self, low: int, high: int) -> tuple[Rows, list[int]] | None:
        try:
            return read_numbers(self._connection, low, high)
        except FAULTS as error:
            self.reason = self.reason or str(self._database.checked(error))
            self._failures += 1
            return None

    def _next(self, low: int, high: int) -> int:
        """Return the first readable rowid behind an unreadable one, ``high + 1`` where there is none."""
        step, good = 1, high + 1
        while low + step <= high:
            if self._try(low + step, low + step) is not None:
                good = low + step
                break
            low += step
            step *= 2
        while good - low > 1:
            middle = (low + good) // 2
            if self._try(middle, middle) is None:
                low = middle
            else:
                good = middle
        return good

    def rows(self) -> Rows:
        """Return the rows in order of rowid, each once."""
        if not self.pieces:
            return Rows(*(np.zeros(0, np.int64) for _ in fields(Rows)))
        rows = Rows(*(np.concatenate([getattr(piece, f.name) for piece in self.pieces]) for f in fields(Rows)))
        if (np.diff(rows.rowid) > 0).all():
            return rows
        # A damaged page that refers to another one twice shows its rows twice.
        return rows.take(np.unique(rows.rowid, return_index=True)[1])


def read_numbers(connection: sqlite3.Connection, low: int, high: int) -> tuple[Rows, list[int]]:
    """Read all but the data of the rows with ``low <= rowid <= high``; return them and the rowids of invalid ones.

    Raises
    ------
    sqlite3.Error
        A page is damaged.
    """
    count, last_topic, last_time, *texts = connection.execute(NUMBERS, (low, high)).fetchone()
    if count == 0:
        return Rows(*(np.zeros(0, np.int64) for _ in fields(Rows))), []
    # Texts and blobs sort behind all numbers, a real number has a point, and a NULL is missing in the text.
    numbers = isinstance(last_topic, int) and isinstance(last_time, int) and all(texts)
    if numbers and not any(text.translate(None, b"0123456789-,") for text in texts):
        columns = [np.fromstring(text, np.int64, sep=",") for text in texts]
        if all(column.size == count for column in columns):
            return Rows(*columns), []
    found = connection.execute(ROWS, (low, high)).fetchall()
    good = [row for row in found if all(isinstance(value, int) for value in row)]
    invalid = [row[0] for row in found if not all(isinstance(value, int) for value in row)]
    return Rows(*np.array(good, np.int64).reshape(-1, 4).T), invalid


def scan_rows(database: Database) -> Scan:
    """Read the numbers of all rows, and compare them with the index of their times.

    Raises
    ------
    FerryIdError
        Reading the file does not end.
    """
    with closing(database.connect()) as connection:
        index = _index_name(connection)
        summary = _index_summary(database, connection, index) if index else None
        salvage = _Salvage(database, connection)
        low, high = _ends(database, connection, summary[1] if summary else 0)
        spans = list(_spans(low, high, database.bytes // ROW_BYTES + 1))
        for span, piece in zip(spans, database.in_order(_numbers_or_none, spans), strict=True):
            if piece is None:
                salvage.read(*span)
            else:
                salvage.add(piece)
        rows = salvage.rows()
        if summary is not None and _plain(rows, *summary) and not salvage.bad and not salvage.invalid:
            return Scan(rows, 0, (), True, True, "")
        invalid = np.setdiff1d(np.array(salvage.invalid, np.int64), rows.rowid)
        listed = _index_rowids(database, connection, index) if index and summary is not None else None
        if listed is not None:
            _retry(salvage, rows, np.setdiff1d(listed, np.append(rows.rowid, invalid)))
            rows = salvage.rows()
            invalid = np.setdiff1d(np.array(salvage.invalid, np.int64), rows.rowid)
    return _compared(database, rows, invalid, salvage, index, listed)


def _compared(
    database: Database,
    rows: Rows,
    invalid: Ints,
    salvage: _Salvage,
    index: str,
    listed: Ints | None,
) -> Scan:
    """Hold the rows against the rowids that the index lists, None where there is no readable index."""
    reason = salvage.reason
    if listed is not None:
        held = np.append(rows.rowid, invalid)
        missing = np.setdiff1d(listed, held)
        if missing.size:
            # A rowid that the index does not list is a damaged one, and so is a row of other types.
            rows = rows.take(np.isin(rows.rowid, listed))
            stretches = _stretches(rows.rowid, np.setdiff1d(listed, rows.rowid))
            # Damage may have taken rows out of the index too.
            complete = database.index_entries() <= listed.size
            return Scan(rows, 0, stretches, complete, True, reason or "a page of the table is damaged")
        if extra := held.size - listed.size:
            reason = f"the index {index} lacks {extra} of {counted(held.size, 'row')}"
        return Scan(rows, invalid.size, (), not extra, True, reason)
    faults: list[str] = []
    if index:
        reason = reason or f"the index {index} cannot be read"
    elif not salvage.bad:
        # Without an index, nothing but the pages that nothing refers to shows what is lost.
        faults = database.integrity()
        if not faults:
            return Scan(rows, invalid.size, (), True, True, "")
        reason = faults[0]
    return Scan(rows, 0, _gaps(rows.rowid, database.bytes // ROW_BYTES + 1), False, False, reason)


def _numbers_or_none(connection: sqlite3.Connection, span: tuple[int, int]) -> tuple[Rows, list[int]] | None:
    try:
        return read_numbers(connection, *span)
    except FAULTS:
        return None


def _index_name(connection: sqlite3.Connection) -> str:
    """Return the name of an index that lists every row, an empty string where there is none."""
    try:
        names = [row[1] for row in connection.execute("PRAGMA index_list(messages)") if not row[4]]
    except FAULTS:
        return ""
    return names[0].decode(errors="replace").replace('"', '""') if names else ""


def _index_summary(database: Database, connection: sqlite3.Connection, index: str) -> tuple[int, int] | None:
    """Return the number of rows that an index lists and the last rowid, None where it cannot be read."""
    try:
        # With a maximum, SQLite walks the entries instead of trusting the counts of the pages.
        found = connection.execute(f'SELECT count(*), max(rowid) FROM messages INDEXED BY "{index}"').fetchone()
    except FAULTS as error:
        database.checked(error)
        return None
    return int(found[0]), int(found[1] or 0)


def _index_rowids(database: Database, connection: sqlite3.Connection, index: str) -> Ints | None:
    """Return the rowids that an index lists, ascending; None where it cannot be read to its end."""
    try:
        found = connection.execute(f'SELECT rowid FROM messages INDEXED BY "{index}"')
        rowids = np.fromiter((row[0] for row in found), np.int64)
    except FAULTS as error:
        database.checked(error)
        return None
    return np.unique(rowids)


def _plain(rows: Rows, count: int, last: int) -> bool:
    """Tell whether the rows are numbered without a gap from 1, as recorded, and the index lists as many."""
    if len(rows) != count or count == 0:
        return len(rows) == count
    return int(rows.rowid[0]) == 1 and int(rows.rowid[-1]) == count == last


def _ends(database: Database, connection: sqlite3.Connection, last_listed: int) -> tuple[int, int]:
    """Return the first and last rowid that can be in the table."""
    ends = []
    for order, unknown in (("ASC", 1), ("DESC", last_listed or database.bytes // ROW_BYTES + 1)):
        try:
            found = connection.execute(
                f"SELECT rowid FROM messages NOT INDEXED ORDER BY rowid {order} LIMIT 1"
            ).fetchone()
            ends.append(int(found[0]) if found else 0)
        except FAULTS as error:
            database.checked(error)
            ends.append(unknown)
    return min(ends[0], 1), max(ends[1], last_listed)


def _spans(low: int, high: int, capacity: int) -> Iterator[tuple[int, int]]:
    """Cut the rowids into ranges: as many as can be in the file finely, those of a sparse table behind them coarsely."""
    for first, last, width in (
        (low, min(high, low + capacity), CHUNK_ROWS),
        (low + capacity + 1, high, max(CHUNK_ROWS, (high - low) // SPARSE_CHUNKS)),
    ):
        while first <= last:
            end = min(first + width - 1, last)
            yield first, end
            first = end + 1


def _retry(salvage: _Salvage, rows: Rows, missing: Ints) -> None:
    """Look once more for rows behind a damaged rowid, where a search may find what a walk did not."""
    for low, high in salvage.bad:
        missing = missing[(missing < low) | (missing > high)]
    edges = np.flatnonzero(np.diff(missing) > 1) + 1
    for run in np.split(missing, edges)[:MAX_RETRIES]:
        if run.size:
            salvage.read(int(run[0]), int(run[-1]))


def _stretches(held: Ints, missing: Ints) -> tuple[Stretch, ...]:
    """Group missing rowids by the rows between which they are missing."""
    if not missing.size:
        return ()
    places, counts = np.unique(np.searchsorted(held, missing), return_counts=True)
    low = np.append(0, held)[places].tolist()
    high = np.append(held, LAST_ROWID)[places].tolist()
    return tuple(Stretch(*entry) for entry in zip(low, high, counts.tolist(), strict=True))


def _gaps(held: Ints, capacity: int) -> tuple[Stretch, ...]:
    """Return the gaps of a table without an index; one that is wider than the file is of unknown size."""
    if not held.size:
        return ()
    low = np.append(min(0, int(held[0]) - 1), held[:-1])
    places = np.flatnonzero(held - low > 1)
    return tuple(
        Stretch(int(low[i]), int(held[i]), gap if (gap := int(held[i]) - int(low[i]) - 1) <= capacity else None)
        for i in places.tolist()
    )
