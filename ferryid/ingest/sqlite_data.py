"""Data of the messages in rosbag2's messages table, some thousand concatenated by one statement."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from ferryid.ingest.sqlite_database import FAULTS, Database
from ferryid.ingest.sqlite_rows import CHUNK_ROWS, TABLE, Rows
from ferryid.types import Flags, Ints

CHUNK_BYTES = 1 << 19
# Topics that a statement names; of more, all rows are read.
NAMED_TOPICS = 500


@dataclass(frozen=True)
class Piece:
    """Messages read together: `data` end to end, of the rows whose `kept` is true, and their sizes [bytes]."""

    rows: Rows
    kept: Flags
    data: bytes
    size: Ints


def read_data(database: Database, rows: Rows, topic_ids: Sequence[int]) -> Iterator[Piece]:
    """Read the data of all rows of some topics.

    Parameters
    ----------
    rows
        Rows of any topics, in order of rowid.
    topic_ids
        Wanted topics; of more than a statement can name, the rows of all topics are read.

    Yields
    ------
    Piece
        In order of rowid, until twice as many bytes as the file has were read: only a damaged or hostile file holds
        rows that share pages. The rows behind are kept nowhere.
    """
    where = ""
    if len(topic_ids) <= NAMED_TOPICS:
        rows = rows.take(np.isin(rows.topic_id, topic_ids))
        where = f" AND topic_id IN ({','.join(map(str, topic_ids))})"
    with closing(database.connect()) as connection:
        encoding = connection.execute("PRAGMA encoding").fetchone()[0]
    # Of another encoding, SQLite would convert the concatenated bytes as if they were text.
    joined = f"SELECT group_concat(data, '') {TABLE}{where}" if encoding == b"UTF-8" else ""
    parts = [rows.take(slice(*edge)) for edge in _edges(rows.size)]
    left = 2 * database.bytes

    def work(connection: sqlite3.Connection, part: Rows) -> Piece:
        return _piece(database, connection, joined, part)

    done = 0
    for piece in database.in_order(work, parts):
        yield piece
        done += 1
        left -= len(piece.data)
        if left < 0:
            break
    for part in parts[done:]:
        yield Piece(part, np.zeros(len(part), bool), b"", np.zeros(0, np.int64))


def _edges(size: Ints) -> Iterator[tuple[int, int]]:
    """Cut rows into parts of limited number and size."""
    ends = np.cumsum(size)
    first = 0
    while first < size.size:
        before = int(ends[first] - size[first])
        last = int(np.searchsorted(ends, before + CHUNK_BYTES, "right"))
        last = min(max(last, first + 1), first + CHUNK_ROWS)
        yield first, last
        first = last


def _piece(database: Database, connection: sqlite3.Connection, joined: str, rows: Rows) -> Piece:
    """Read the data of a few rows, in halves where they do not come out as they should."""
    everything = np.ones(len(rows), bool)
    if joined:
        try:
            data = connection.execute(joined, (int(rows.rowid[0]), int(rows.rowid[-1]))).fetchone()[0] or b""
        except FAULTS as error:
            database.checked(error)
            data = None
        if data is not None and len(data) == int(rows.size.sum()):
            return Piece(rows, everything, data, rows.size)
    if len(rows) > 1:
        half = len(rows) // 2
        halves = [_piece(database, connection, joined, rows.take(part)) for part in (slice(half), slice(half, None))]
        kept, sizes = (np.concatenate([getattr(h, name) for h in halves]) for name in ("kept", "size"))
        return Piece(rows, kept, b"".join(h.data for h in halves), sizes)
    try:
        found = connection.execute("SELECT data FROM messages NOT INDEXED WHERE rowid=?", (int(rows.rowid[0]),))
        row = found.fetchone()
    except FAULTS as error:
        database.checked(error)
        row = None
    if row is None or not isinstance(row[0], bytes):
        return Piece(rows, ~everything, b"", np.zeros(0, np.int64))
    return Piece(rows, everything, row[0], np.array([len(row[0])], np.int64))
