"""SQLite files of rosbag2: pages, rows and tables."""

from __future__ import annotations

import sqlite3
import struct
import tempfile
from collections.abc import Callable
from contextlib import closing
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from rosbags.rosbag2 import StoragePlugin, Writer

from tests.attack import definitions
from tests.attack.case import HEAVY_SHARE, Base, Mutated, Mutation, odd_number, replaced
from tests.attack.logs import STORES, TYPES, WANTED, in_folder, messages, serialized, truth_of

NAME = "log.db3"


def bases() -> list[Base]:
    """Pages of 4096 and of 512 bytes."""
    return [_base(4096), _base(512)]


def write_folder(folder: Path, plugin: StoragePlugin, packing: tuple[Any, Any] | None = None) -> Path:
    """Write a recording's folder by rosbags."""
    path = folder / "log"
    writer = Writer(path, version=9, storage_plugin=plugin)
    if packing is not None:
        writer.set_compression(*packing)
    with writer:
        store = STORES["cdr"]
        connections = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in TYPES.items()}
        for topic, time, value in messages():
            writer.write(connections[topic], time, serialized(topic, time, value, "cdr"))
    return path


def _base(page: int) -> Base:
    files, _, folder = in_folder(lambda place: write_folder(place, StoragePlugin.SQLITE3))
    truth = truth_of(folder / "log", "cdr")
    content = edited(files["log/log.db3"], lambda db: db.executescript(f"PRAGMA page_size = {page}; VACUUM"))
    _counted(content, truth)
    return Base("sqlite3_bag", f"pages of {page}", {NAME: content}, NAME, truth, WANTED)


def _counted(content: bytes, truth: Any) -> None:
    """Hold the truth against what SQLite itself counts."""
    counts: dict[str, int] = {}

    def count(db: sqlite3.Connection) -> None:
        query = "SELECT name, count(*) FROM messages JOIN topics ON topics.id = topic_id GROUP BY name"
        counts.update(db.execute(query).fetchall())

    edited(content, count)
    if counts != {topic: len(rows.times) for topic, rows in truth.items()}:
        raise AssertionError("rosbags and SQLite count differently")


def edited(content: bytes, edit: Callable[[sqlite3.Connection], object]) -> bytes:
    """Return the database after an edit by SQLite."""
    with tempfile.TemporaryDirectory(prefix="attack-edit-", ignore_cleanup_errors=True) as folder:
        path = Path(folder) / NAME
        path.write_bytes(content)
        with closing(sqlite3.connect(path, isolation_level=None)) as db:
            edit(db)
        return path.read_bytes()


@cache
def _pages(content: bytes) -> tuple[int, tuple[int, ...]]:
    size = struct.unpack_from(">H", content, 16)[0] or 65536
    found = []
    for start in range(0, len(content), size):
        at = start + (100 if start == 0 else 0)
        if content[at] in (2, 5, 10, 13):
            found.append(at)
    return size, tuple(found)


def header_of_file(random: Random, base: Base) -> Mutated | None:
    """Set a field of the first 100 bytes."""
    name = _database(base)
    fields = (
        ("page size", 16, 2),
        ("write version", 18, 1),
        ("read version", 19, 1),
        ("reserved bytes", 20, 1),
        ("payload fractions", 21, 3),
        ("change counter", 24, 4),
        ("pages", 28, 4),
        ("first free page", 32, 4),
        ("free pages", 36, 4),
        ("schema cookie", 40, 4),
        ("schema format", 44, 4),
        ("largest root page", 52, 4),
        ("text encoding", 56, 4),
        ("user version", 60, 4),
        ("incremental vacuum", 64, 4),
        ("version valid for", 92, 4),
    )
    what, at, size = random.choice(fields)
    return _set(random, base, name, at, size, f"file header, {what}")


def header_of_page(random: Random, base: Base) -> Mutated | None:
    """Set a field of a page's header: type, cell count, content start, right pointer."""
    name = _database(base)
    _, pages = _pages(base.files[name])
    at = random.choice(pages)
    fields = [("type", 0, 1), ("first free block", 1, 2), ("cells", 3, 2), ("content start", 5, 2), ("fragments", 7, 1)]
    if base.files[name][at] in (2, 5):
        fields.append(("right-most page", 8, 4))
    what, offset, size = random.choice(fields)
    return _set(random, base, name, at + offset, size, f"page header at {at}, {what}")


def cell(random: Random, base: Base) -> Mutated | None:
    """Set a cell pointer, or the first bytes of a cell: payload length, rowid, header of the row."""
    name = _database(base)
    content = base.files[name]
    size, pages = _pages(content)
    at = random.choice(pages)
    count = struct.unpack_from(">H", content, at + 3)[0]
    if count == 0:
        return None
    pointer = at + (12 if content[at] in (2, 5) else 8) + 2 * random.randrange(count)
    if random.random() < 0.4:
        if count > 1 and random.random() < 0.5:
            other = at + (12 if content[at] in (2, 5) else 8) + 2 * random.randrange(count)
            changed = bytearray(content)
            changed[pointer : pointer + 2] = content[other : other + 2]
            what = f"cell pointer at {pointer} set to that at {other}"
            return None if changed == content else Mutated(what, replaced(base, name, bytes(changed)))
        return _set(random, base, name, pointer, 2, f"cell pointer of page at {at}")
    start = at - at % size + struct.unpack_from(">H", content, pointer)[0]
    place = min(start + random.randrange(12), len(content) - 1)
    return _set(random, base, name, place, 1, f"byte {place - start} of a cell of the page at {at}")


def _set(random: Random, base: Base, name: str, at: int, size: int, what: str) -> Mutated | None:
    content = bytearray(base.files[name])
    old = int.from_bytes(content[at : at + size], "big")
    new = odd_number(random, size, old)
    if new == old:
        return None
    content[at : at + size] = new.to_bytes(size, "big")
    return Mutated(f"{what} (byte {at}) set from {old} to {new}", replaced(base, name, bytes(content)))


def pages_moved(random: Random, base: Base) -> Mutated | None:
    """Copy one page over another, or swap two."""
    name = _database(base)
    content = bytearray(base.files[name])
    size, _ = _pages(bytes(content))
    count = len(content) // size
    first, second = (size * random.randrange(1, count) for _ in range(2))
    if first == second:
        return None
    one, two = bytes(content[first : first + size]), bytes(content[second : second + size])
    swapped = random.random() < 0.5
    content[second : second + size] = one
    if swapped:
        content[first : first + size] = two
    what = f"page at {first} {'swapped with' if swapped else 'copied over'} that at {second}"
    # Swapped leaves hold the same rows under other parents, so that only their order differs.
    return Mutated(what, replaced(base, name, bytes(content)), content=True)


# SQL, messages that it takes away, messages that it adds.
EDITS: tuple[tuple[str, int, int], ...] = (
    ("UPDATE topics SET name = NULL WHERE id = 1", 0, 0),
    ("UPDATE topics SET name = x'ff00fe' WHERE id = 1", 0, 0),
    ("UPDATE topics SET type = NULL WHERE id = 2", 0, 0),
    ("UPDATE topics SET type = x'80'", 0, 0),
    ("UPDATE topics SET type = '1a/msg/2b'", 0, 0),
    ("UPDATE topics SET serialization_format = NULL", 0, 0),
    ("UPDATE topics SET serialization_format = 7.5", 0, 0),
    ("UPDATE topics SET type_description_hash = x'00'", 0, 0),
    ("UPDATE topics SET offered_qos_profiles = NULL", 0, 0),
    ("UPDATE topics SET name = '/speed'", 0, 0),
    ("UPDATE topics SET id = id + 9223372036854775800", 0, 0),
    ("INSERT INTO topics SELECT id + 10, name, type, serialization_format, offered_qos_profiles, "
     "type_description_hash FROM topics", 0, 0),
    ("DELETE FROM topics WHERE id = 1", 0, 0),
    ("DELETE FROM topics", 0, 0),
    ("UPDATE messages SET data = NULL WHERE id % 7 = 0", 0, 0),
    ("UPDATE messages SET data = 'text' WHERE id % 7 = 0", 0, 0),
    ("UPDATE messages SET data = x'' WHERE id % 7 = 0", 0, 0),
    ("UPDATE messages SET data = zeroblob(100000000) WHERE id = 9", 0, 0),
    ("UPDATE messages SET timestamp = NULL WHERE id % 5 = 0", 0, 0),
    ("UPDATE messages SET timestamp = 'noon' WHERE id % 5 = 0", 0, 0),
    ("UPDATE messages SET timestamp = 9223372036854775807 WHERE id = 5", 0, 0),
    ("UPDATE messages SET timestamp = -9223372036854775807 WHERE id = 5", 0, 0),
    ("UPDATE messages SET timestamp = 1.5e300 WHERE id = 5", 0, 0),
    ("UPDATE messages SET topic_id = 99 WHERE id % 5 = 0", 0, 0),
    ("UPDATE messages SET topic_id = NULL WHERE id % 5 = 0", 0, 0),
    ("UPDATE messages SET topic_id = 'one' WHERE id % 5 = 0", 0, 0),
    ("UPDATE messages SET id = 9223372036854775807 WHERE id = 7", 0, 0),
    ("UPDATE messages SET id = -id", 0, 0),
    ("DELETE FROM messages WHERE id % 3 = 0", 1000, 0),
    ("INSERT INTO messages SELECT id + 1000, topic_id, timestamp, data FROM messages WHERE id < 5", 0, 4),
    ("DROP INDEX timestamp_idx", 0, 0),
    ("DROP TABLE message_definitions", 0, 0),
    ("DROP TABLE metadata", 0, 0),
    ("DROP TABLE schema", 0, 0),
    ("DROP TABLE topics", 0, 0),
    ("DROP TABLE messages", 1000, 0),
    ("ALTER TABLE messages ADD COLUMN odd TEXT DEFAULT 'x'", 0, 0),
    ("ALTER TABLE messages RENAME COLUMN timestamp TO time", 0, 0),
    ("ALTER TABLE messages RENAME TO kept; CREATE VIEW messages AS SELECT * FROM kept", 0, 0),
    ("ALTER TABLE topics RENAME TO kept; CREATE VIEW topics AS SELECT * FROM kept", 0, 0),
    ("UPDATE message_definitions SET encoded_message_definition = NULL", 0, 0),
    ("UPDATE message_definitions SET encoded_message_definition = x'00ff'", 0, 0),
    ("UPDATE message_definitions SET topic_type = NULL", 0, 0),
    ("UPDATE message_definitions SET encoding = 'ros2idl'", 0, 0),
    ("UPDATE metadata SET metadata = x'ff'", 0, 0),
    ("UPDATE schema SET schema_version = 99", 0, 0),
    ("UPDATE schema SET ros_distro = NULL", 0, 0),
    ("PRAGMA encoding = 'UTF-16le'; VACUUM", 0, 0),
    ("PRAGMA auto_vacuum = 1; VACUUM", 0, 0),
    ("PRAGMA journal_mode = WAL", 0, 0),
    ("CREATE TABLE sizes AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 3000) "
     "SELECT i FROM n", 0, 0),
    ("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 50000) INSERT INTO topics "
     "SELECT i + 10, '/t' || i, 'std_msgs/msg/Float64', 'cdr', '', '' FROM n", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET sql = NULL WHERE name = 'messages'", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET sql = x'ff' WHERE name = 'topics'", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET name = NULL WHERE name = 'metadata'", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET rootpage = 99999 WHERE name = 'messages'", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET rootpage = NULL WHERE name = 'messages'", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET rootpage = 'x' WHERE name = 'topics'", 0, 0),
    ("PRAGMA writable_schema = 1; UPDATE sqlite_master SET rootpage = 1 WHERE name = 'messages'", 0, 0),
)  # fmt: skip


# Files of other recorders lack the constraints of rosbags.
_RELAXED = "PRAGMA writable_schema = 1; UPDATE sqlite_master SET sql = replace(sql, ' NOT NULL', '')"


@cache
def _edit(content: bytes, sql: str) -> bytes | None:
    try:
        if "NULL" in sql:
            content = edited(content, lambda db: db.executescript(_RELAXED))
        return edited(content, lambda db: db.executescript(sql))
    except sqlite3.Error:
        return None


def sql(random: Random, base: Base) -> Mutated | None:
    """Edit tables by SQL, as a tool or an attacker may."""
    name = _database(base)
    script, missing, extra = random.choice(EDITS)
    if "50000" in script and random.random() > HEAVY_SHARE:
        return None
    content = _edit(base.files[name], script)
    if content is None or content == base.files[name]:
        return None
    # What SQLite deleted is no damage, although a gap in the ids may be reported as one.
    return Mutated(f"SQL: {script}", replaced(base, name, content), missing=missing, extra=extra, content=True)


def definition(random: Random, base: Base) -> Mutated | None:
    """Put a hostile definition in."""
    name = _database(base)
    topic = random.choice(list(TYPES))
    kind = TYPES[topic]
    text = STORES["cdr"].generate_msgdef(kind, ros_version=2)[0].encode()
    language = random.choice(("ros2msg", "ros2msg", "ros2idl"))
    if language == "ros2idl":
        text = b"module std_msgs { module msg { struct Float64 { double data; }; }; };\n"
        topic, kind = "/speed", TYPES["/speed"]
    what, changed, other = definitions.hostile(random, language, kind, text)

    def edit(db: sqlite3.Connection) -> None:
        query = "UPDATE message_definitions SET encoded_message_definition = ?, encoding = ?, topic_type = ?"
        db.execute(query + " WHERE topic_type = ?", (changed, language, other, kind))
        db.execute("UPDATE topics SET type = ?, type_description_hash = '' WHERE name = ?", (other, topic))

    content = edited(base.files[name], edit)
    return Mutated(f"definition of {topic} ({language}): {what}", replaced(base, name, content), content=True)


def _database(base: Base) -> str:
    return next(name for name in base.files if name.endswith(".db3"))


MUTATIONS: dict[str, Mutation] = {
    "header of the file": header_of_file,
    "header of a page": header_of_page,
    "cell": cell,
    "pages moved": pages_moved,
    "SQL": sql,
    "definition": definition,
}
