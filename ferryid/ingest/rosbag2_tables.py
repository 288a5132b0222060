"""Tables of a rosbag2 SQLite file beside that of the messages: topics, definitions, distribution."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.ingest.ros2_types import RecordedText, normalized
from ferryid.ingest.sqlite_database import FAULTS, Database

COLUMNS = {
    "topics": {"id", "name", "type"},
    "messages": {"id", "topic_id", "timestamp", "data"},
    "message_definitions": {"topic_type", "encoding", "encoded_message_definition"},
    "schema": {"ros_distro"},
}


@dataclass(frozen=True)
class RecordedTopic:
    """One row of the table of topics; what is not text there is None."""

    number: int
    name: str
    type: str | None
    encoding: str | None
    digest: str


@dataclass(frozen=True)
class Recorded:
    """The tables beside the messages: topics, definitions by type, and the ROS distribution."""

    topics: tuple[RecordedTopic, ...]
    definitions: Mapping[str, RecordedText]
    distro: str


def read_tables(database: Database) -> Recorded:
    """Read the tables of topics, definitions and the distribution.

    Raises
    ------
    FerryIdError
        Not a database of rosbag2, or one whose lists of tables and topics are damaged.
    """
    path = database.name
    try:
        with closing(database.connect()) as connection:
            connection.text_factory = lambda raw: raw.decode(errors="replace")
            tables = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type='table'").fetchall())
            columns = {
                # A view is of no use here: what it selects may never end. Computed columns are not listed.
                name: {row[1] for row in connection.execute(f"PRAGMA table_info('{name}')")}
                for name in COLUMNS
                if str(tables.get(name)).upper().startswith("CREATE TABLE")
            }
            sound = {name for name in columns if COLUMNS[name] <= columns[name]}
            if not {"topics", "messages"} <= sound:
                if database.cut:
                    raise sqlite3.DatabaseError(database.cut)
                found = ", ".join(sorted(map(str, tables))[:10]) or "none"
                raise FerryIdError(
                    f"{path}: an SQLite database but not one of rosbag2, whose tables topics and messages with "
                    f"their columns are needed, found the tables: {found}. "
                    "Fix: give the .db3 file that rosbag2 recorded"
                )
            _check_rowid(connection, path)
            encoding = "serialization_format" if "serialization_format" in columns["topics"] else "'cdr'"
            digest = "type_description_hash" if "type_description_hash" in columns["topics"] else "''"
            topics = connection.execute(f"SELECT id, name, type, {encoding}, {digest} FROM topics ORDER BY id")
            listed = tuple(_listed(topics))
            definitions = {}
            if "message_definitions" in sound:
                for name, kind, text in connection.execute(
                    "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
                ):
                    if isinstance(name, str):
                        both = isinstance(kind, str) and isinstance(text, str)
                        definitions[normalized(name)] = RecordedText(kind, text) if both else RecordedText("", "")
            distro = ""
            if "schema" in sound:
                distro = next((str(row[0]) for row in connection.execute("SELECT ros_distro FROM schema")), "")
    except FAULTS as error:
        raise FerryIdError(
            f"{path}: the list of topics cannot be read, the SQLite file is damaged or cut off ({line(error)}). "
            "Fix: copy it from the recorder again, or recover it with sqlite3's .recover"
        ) from database.checked(error)
    return Recorded(listed, definitions, distro)


def _check_rowid(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a table of messages without SQLite's own row numbers, or whose column hides them, generated ones too.

    Raises
    ------
    FerryIdError
        With the way to copy the table.
    """
    fault = ""
    if any(str(row[1]).lower() == "rowid" for row in connection.execute("PRAGMA table_xinfo('messages')")):
        fault = "a column named rowid hides them"
    else:
        try:
            connection.execute("SELECT rowid FROM messages LIMIT 0").close()
        except sqlite3.OperationalError as error:
            if "no such column" not in str(error):
                raise
            fault = "it was created WITHOUT ROWID"
    if fault:
        raise FerryIdError(
            f"{path}: SQLite's row numbers of the table messages are needed to read it, {fault}. "
            "Fix: copy the columns id, topic_id, timestamp and data into a table as rosbag2 creates it"
        )


def _listed(rows: Iterable[tuple[Any, ...]]) -> Iterator[RecordedTopic]:
    """Check the rows of the table of topics; one without a name or number is left out, its messages are then lost."""
    seen = set()
    for number, name, msgtype, encoding, digest in rows:
        if isinstance(number, int) and isinstance(name, str) and number not in seen:
            seen.add(number)
            yield RecordedTopic(
                number,
                name,
                msgtype if isinstance(msgtype, str) else None,
                encoding if isinstance(encoding, str) else None,
                digest if isinstance(digest, str) else "",
            )


def line(error: BaseException) -> str:
    """Return the message of an error without line breaks."""
    return " ".join(str(error).split()) or type(error).__name__
