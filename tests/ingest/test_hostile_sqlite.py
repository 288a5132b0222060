"""SQLite files of wrong types, endless tables and unreadable pages: a line or a counted loss, and nothing else."""

from __future__ import annotations

import shutil
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import zstandard
from rosbags.rosbag2 import CompressionMode

from ferryid.errors import FerryIdError
from ferryid.ingest import message_compression, open_log
from ferryid.ingest.log import Loss, Reader
from tests.ingest.test_rosbag2 import (
    START,
    create,
    damaged,
    database,
    edit,
    image,
    insert,
    kinds,
    lost_messages,
    point,
    points,
    recording,
    root_page,
    snapshot,
    xs,
)


def changed(path: Path, *statements: str) -> Path:
    """Run SQL on a database, and allow changes of its schema."""
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA writable_schema=ON")
        for statement in statements:
            connection.execute(statement)
        connection.commit()
    return path


def relaxed(path: Path) -> Path:
    """Take NOT NULL out of the tables' definitions."""
    return changed(path, "UPDATE sqlite_master SET sql=replace(sql, ' NOT NULL', '')")


def outcome(path: Path, verify: bool = False) -> tuple[int, tuple[Loss, ...]]:
    """Number of points that are returned, and the losses."""
    log = open_log(path)
    series = log.read({"/point": ["point.x"]}, verify=verify)["/point"]
    return len(series.receive_ns), log.losses


def refusal_or_outcome(path: Path, verify: bool = False) -> tuple[str, int, tuple[Loss, ...]]:
    """The line of a refusal, or an empty string and the outcome."""
    try:
        return "", *outcome(path, verify)
    except FerryIdError as error:
        return str(error), 0, ()


def reported(log: Reader) -> int | None:
    counts = [loss.messages for loss in log.losses]
    return None if None in counts else sum(count or 0 for count in counts)


# Rows that are missing


@pytest.mark.parametrize("verify", [False, True])
@pytest.mark.parametrize("which", [0, 5, -1])
def test_a_leaf_with_fewer_cells_than_it_had_loses_no_message_silently(
    tmp_path: Path, which: int, verify: bool
) -> None:
    """One byte of a page's cell count, at the beginning, in the middle and at the end of the table."""
    path = database(tmp_path / "log.db3", points(0, 300), page_size=1024)
    text = path.read_bytes()
    leaves = [
        k for k, kind in enumerate(kinds(path, 1024)) if kind == 13 and b"map\0" in text[k * 1024 : k * 1024 + 1024]
    ]
    page = leaves[which] * 1024
    assert text[page + 4] > 2
    log = open_log(damaged(path, page + 4, b"\1"))
    series = log.read({"/point": ["point.x"]}, verify=verify)["/point"]
    assert len(series.receive_ns) < 300
    lost = sum(loss.messages or 0 for loss in log.losses)
    assert len(series.receive_ns) + lost == 300


@pytest.mark.parametrize("index", ["kept", "dropped", "destroyed"])
def test_the_last_page_cannot_lose_rows_silently(tmp_path: Path, index: str) -> None:
    path = database(tmp_path / "log.db3", points(0, 300))
    if index == "dropped":
        changed(path, "DROP INDEX timestamp_idx")
    root = root_page(path, "timestamp_idx") if index == "destroyed" else 0
    text = path.read_bytes()
    page = text.index(points(299, 300)[0][2]) // 4096 * 4096
    damaged(path, page + 3, (int.from_bytes(text[page + 3 : page + 5], "big") - 3).to_bytes(2, "big"))
    if root:
        damaged(path, (root - 1) * 4096, bytes(4096))
    log = open_log(path)
    assert xs(log) == list(range(297))
    assert reported(log) == (3 if index == "kept" else None)


def test_a_page_that_is_read_twice_gives_its_rows_once_and_the_others_are_counted(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 300))
    root = (root_page(path) - 1) * 4096
    text = path.read_bytes()
    cells = [int.from_bytes(text[root + 12 + 2 * i : root + 14 + 2 * i], "big") + root for i in (0, 1)]
    log = open_log(damaged(path, cells[1], text[cells[0] : cells[0] + 4]))
    found = xs(log)
    assert len(set(found)) == len(found) < 300
    assert len(found) + lost_messages(log) == 300


def test_deleted_rows_are_not_lost_ones(tmp_path: Path) -> None:
    path = changed(database(tmp_path / "log.db3", points(0, 300)), "DELETE FROM messages WHERE id % 3 = 1 OR id < 50")
    log = open_log(path)
    assert len(xs(log)) == 300 - len([i for i in range(1, 301) if i % 3 == 1 or i < 50])
    assert log.losses == ()


def test_rows_deleted_from_a_table_without_an_index_are_not_lost_unless_the_metadata_counts_them(
    tmp_path: Path,
) -> None:
    folder = recording(tmp_path / "trial", count=300)
    file = changed(folder / "trial.db3", "DROP INDEX timestamp_idx", "DELETE FROM messages WHERE id BETWEEN 11 AND 20")
    changed(file, "VACUUM")
    assert open_log(file).losses == ()
    assert lost_messages(open_log(folder)) == 10


def test_rows_that_table_and_index_both_lost_are_not_taken_for_deleted(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 900), page_size=512)
    text = path.read_bytes()
    for name in ("messages", "timestamp_idx"):
        root = (root_page(path, name) - 1) * 512
        assert text[root] in (2, 5)
        damaged(path, root + 3, (int.from_bytes(text[root + 3 : root + 5], "big") - 1).to_bytes(2, "big"))
    leaf = next(k for k, kind in enumerate(kinds(path, 512)) if kind == 13 and point(50) in text[k * 512 :][:512])
    damaged(path, leaf * 512, bytes(512))
    log = open_log(path)
    assert len(xs(log)) < 900
    assert None in [loss.messages for loss in log.losses]


def test_a_damaged_index_costs_no_message_and_is_reported(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 300))
    root = (root_page(path, "timestamp_idx") - 1) * 4096
    log = open_log(damaged(path, root, b"\xff" * 200))
    assert xs(log) == list(range(300))
    assert [("index" in loss.what, loss.messages) for loss in log.losses] == [(True, None)]


def test_broken_overflow_pages_cost_their_own_message(tmp_path: Path) -> None:
    rows = [(2, START + i, image(i, 9000)) for i in range(20)]
    path = database(tmp_path / "log.db3", [*rows, *points(0, 20)])
    text = path.read_bytes()
    page = text.index(bytes([7]) * 4000) // 4096 * 4096
    log = open_log(damaged(path, page, b"\xff" * 4))
    heights = log.read({"/image": ["height"]})["/image"].columns["height"].tolist()
    assert heights == [i for i in range(20) if i != 7]
    assert lost_messages(log) == 1
    assert xs(log) == list(range(20))


# Values of other types


VALUES = ["NULL", "x'00ff'", "-9223372036854775808", "9e999", "'text'", "'1-2'", "zeroblob(10000)"]


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("column", ["name", "type", "serialization_format", "type_description_hash"])
def test_topics_of_other_types_are_refused_or_counted(tmp_path: Path, column: str, value: str) -> None:
    path = relaxed(database(tmp_path / "log.db3", points(0, 20)))
    changed(path, f"UPDATE topics SET {column}={value} WHERE id=1")
    refused, count, losses = refusal_or_outcome(path)
    if refused:
        assert "\n" not in refused
        assert " Fix: " in refused
    else:
        assert count + sum(loss.messages or 0 for loss in losses) == 20


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("column", ["topic_id", "timestamp", "data"])
@pytest.mark.parametrize("rows", ["id=3", "id>0"])
def test_messages_of_other_types_are_counted(tmp_path: Path, column: str, value: str, rows: str) -> None:
    path = relaxed(database(tmp_path / "log.db3", points(0, 20)))
    changed(path, f"UPDATE messages SET {column}={value} WHERE {rows}")
    count, losses = outcome(path)
    assert count + sum(loss.messages or 0 for loss in losses) == 20


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("column", ["topic_type", "encoding", "encoded_message_definition"])
def test_definitions_of_other_types_stand_aside(tmp_path: Path, column: str, value: str) -> None:
    path = relaxed(database(tmp_path / "log.db3", points(0, 20)))
    changed(path, f"UPDATE message_definitions SET {column}={value}", f"UPDATE schema SET ros_distro={value}")
    assert outcome(path) == (20, ())


@pytest.mark.parametrize("table", ["topics", "messages"])
def test_a_missing_column_is_one_line(tmp_path: Path, table: str) -> None:
    column = "type" if table == "topics" else "topic_id"
    path = changed(database(tmp_path / "log.db3", []), f"ALTER TABLE {table} DROP COLUMN {column}")
    with pytest.raises(FerryIdError, match=r"not one of rosbag2.* Fix: "):
        open_log(path)


@pytest.mark.parametrize("column", ["rowid TEXT DEFAULT 'x'", "RowId INTEGER DEFAULT 5", "rowid INTEGER AS (7)"])
def test_a_column_that_hides_the_row_numbers_is_refused(tmp_path: Path, column: str) -> None:
    path = changed(database(tmp_path / "a.db3", points(0, 30)), f"ALTER TABLE messages ADD COLUMN {column}")
    with pytest.raises(FerryIdError, match=r"a\.db3: .*a column named rowid hides them\. Fix: copy the columns"):
        outcome(path)


def test_messages_without_row_numbers_are_refused(tmp_path: Path) -> None:
    path = changed(
        database(tmp_path / "a.db3", points(0, 30)),
        "ALTER TABLE messages RENAME TO old",
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB) WITHOUT ROWID",
        "INSERT INTO messages SELECT id, topic_id, timestamp, data FROM old",
    )
    with pytest.raises(FerryIdError, match=r"a\.db3: .*created WITHOUT ROWID\. Fix: copy the columns"):
        outcome(path)


def test_a_database_of_wide_characters_gives_the_same_messages(tmp_path: Path) -> None:
    path = tmp_path / "log.db3"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA encoding='UTF-16le'")
        create(connection)
        insert(connection, points(0, 50))
    log = open_log(path)
    assert xs(log) == list(range(50))
    assert log.losses == ()


# Tables without an end

ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS id, 1 AS topic_id"


@pytest.mark.parametrize("lie", [False, True])
@pytest.mark.parametrize("table", ["topics", "messages"])
def test_a_view_in_place_of_a_table_is_not_read(tmp_path: Path, table: str, lie: bool) -> None:
    path = database(tmp_path / "log.db3", points(0, 5))
    view = f"CREATE VIEW {table} AS {ENDLESS}, 2 AS timestamp, 3 AS data, 'a' AS name, 'b' AS type FROM n"
    if lie:
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("PRAGMA writable_schema=ON")
            connection.execute("UPDATE sqlite_master SET sql=? WHERE name=?", (view, table))
            connection.commit()
    else:
        changed(path, f"DROP TABLE {table}", view)
    with pytest.raises(FerryIdError, match=r" Fix: "):
        open_log(path)


def test_computed_columns_are_not_read(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 5))
    changed(
        path,
        "DROP TABLE messages",
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
        "data BLOB AS (zeroblob(1000000000)))",
        "INSERT INTO messages(topic_id, timestamp) VALUES (1, 2)",
    )
    with pytest.raises(FerryIdError, match=r"not one of rosbag2.* Fix: "):
        open_log(path)


def circle(path: Path, table: str) -> Path:
    """Make interior pages that each refer a hundred times to the next: 100 to the power of 12 leaves."""
    database(path, points(0, 2000), page_size=4096)
    root = root_page(path, table)
    text = bytearray(path.read_bytes())
    first = len(text) // 4096
    leaf = next(
        k
        for k, kind in enumerate(kinds(path))
        if kind == (13 if table == "messages" else 10) and k + 1 not in (1, root)
    )
    chain = [root - 1, *range(first, first + 11)]
    text += bytes(4096 * 11)
    for page, child in zip(chain, [*chain[1:], leaf], strict=True):
        if table == "messages":
            cells = b"".join((child + 1).to_bytes(4, "big") + bytes([i + 1]) for i in range(100))
        else:
            entry = text[leaf * 4096 + 4096 - 20 : (leaf + 1) * 4096]
            cells = b"".join((child + 1).to_bytes(4, "big") + bytes(entry)[-16:] for i in range(100))
        size = len(cells) // 100
        start = 4096 - len(cells)
        head = bytes([5 if table == "messages" else 2, 0, 0, 0, 100]) + start.to_bytes(2, "big") + b"\0"
        head += (child + 1).to_bytes(4, "big")
        head += b"".join((start + size * i).to_bytes(2, "big") for i in range(100))
        text[page * 4096 : (page + 1) * 4096] = head + bytes(start - len(head)) + cells
    text[28:32] = (len(text) // 4096).to_bytes(4, "big")
    path.write_bytes(text)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("table", ["messages", "timestamp_idx"])
def test_pages_that_refer_to_each_other_in_circles_come_to_an_end(tmp_path: Path, table: str) -> None:
    path = circle(tmp_path / "log.db3", table)
    begun = time.monotonic()
    refused, _, losses = refusal_or_outcome(path, verify=True)
    assert losses or " Fix: " in refused
    assert time.monotonic() - begun < 15


@pytest.mark.slow
def test_many_topics_take_linear_time(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", [])
    count = 20_000
    with closing(sqlite3.connect(path)) as connection:
        connection.executemany(
            "INSERT INTO topics VALUES (?, ?, 'std_msgs/msg/Float64', 'cdr', '', '')",
            ((i, f"/t{i}") for i in range(3, count + 3)),
        )
        data = b"\0\1\0\0" + np.float64(2.5).tobytes()
        insert(connection, [(i, START + i, data) for i in range(3, count + 3)])
    begun = time.process_time()
    log = open_log(path)
    series = log.read({f"/t{i}": ["data"] for i in range(3, 1003)})
    assert all(one.columns["data"].tolist() == [2.5] for one in series.values())
    assert log.losses == ()
    assert time.process_time() - begun < 5


# A damaged write-ahead log


def test_a_damaged_write_ahead_log_is_reported(tmp_path: Path) -> None:
    live, copy = tmp_path / "live", tmp_path / "copy"
    live.mkdir()
    copy.mkdir()
    with closing(sqlite3.connect(live / "log.db3")) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA wal_autocheckpoint=0")
        create(connection)
        for k in range(3):
            insert(connection, points(100 * k, 100 * k + 100))
        for file in live.iterdir():
            shutil.copy(file, copy)
    assert open_log(copy / "log.db3").losses == ()
    damaged(copy / "log.db3-wal", (copy / "log.db3-wal").stat().st_size - 6000, b"\xff" * 10)
    before = snapshot(copy)
    log = open_log(copy / "log.db3")
    assert xs(log) == list(range(200))
    assert [("unfinished or damaged" in loss.what, loss.messages) for loss in log.losses] == [(True, None)]
    assert snapshot(copy) == before


# metadata.yaml

BOMB = "rosbag2_bagfile_information:\n  a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"  {c}: &{c} [{', '.join([f'*{b}'] * 9)}]\n" for b, c in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE: dict[str, Callable[[str], str]] = {
    "aliases": lambda text: BOMB,
    "alias": lambda text: text.replace("message_count: 50", "message_count: &a 50", 1),
    "nested lists": lambda text: "[" * 20_000,
    "nested keys": lambda text: "".join(" " * i + "a:\n" for i in range(1000)),
    "nested maps": lambda text: "{a: " * 20_000,
    "large": lambda text: text + "# " + "x" * (1 << 20),
    "infinite": lambda text: text.replace("message_count: 50", "message_count: .inf"),
    "no number": lambda text: text.replace("message_count: 50", "message_count: .nan"),
    "a date": lambda text: text.replace("message_count: 50", "message_count: 2020-01-01"),
    "too large a number": lambda text: text.replace("message_count: 50", "message_count: 9223372036854775808"),
    "many digits": lambda text: text.replace("message_count: 50", "message_count: " + "9" * 6000),
    "negative": lambda text: text.replace("message_count: 50", "message_count: -1"),
    "a tag": lambda text: text.replace("message_count: 50", "message_count: !!float 50"),
    "an object": lambda text: text.replace("message_count: 50", "message_count: !!python/object:os.system 50"),
    "a key twice": lambda text: text.replace("  storage_identifier:", "  version: 5\n  storage_identifier:"),
    "a key that is no text": lambda text: text + "? [a, b]\n: 3\n",
    "two documents": lambda text: text + "---\n" + text,
    "a list": lambda text: "- a\n- b\n",
    "NUL": lambda text: text + "\0",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_metadata_is_reported_and_the_recording_read(tmp_path: Path, name: str) -> None:
    folder = recording(tmp_path / "trial", count=50)
    text = (folder / "metadata.yaml").read_text()
    changed_text = HOSTILE[name](text)
    assert changed_text != text
    (folder / "metadata.yaml").write_text(changed_text)
    begun = time.process_time()
    log = open_log(folder)
    assert time.process_time() - begun < 3
    assert xs(log) == list(range(50))
    assert [(loss.file, loss.messages) for loss in log.losses] == [(str(folder / "metadata.yaml"), 0)]
    assert all("\n" not in loss.what and len(loss.what) < 300 for loss in log.losses)


def test_a_file_named_twice_or_renamed_is_read_once_and_whole(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial", count=50)
    log = open_log(edit(folder, relative_file_paths=["trial.db3", "trial.db3"]))
    assert xs(log) == list(range(50))
    assert log.losses == ()
    log = open_log(edit(folder, relative_file_paths=["renamed.db3"]))
    assert xs(log) == list(range(50))
    assert [("trial.db3 there was read" in loss.what, loss.messages) for loss in log.losses] == [(True, 0)]


def test_messages_that_only_the_metadata_knows_are_counted_beside_corrupt_ones(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial", count=50)
    changed(folder / "trial.db3", "UPDATE messages SET data=x'0001' WHERE id<=3", "DELETE FROM messages WHERE id>48")
    log = open_log(folder)
    assert len(xs(log)) == 45
    assert lost_messages(log) == 5


def test_messages_that_unpack_to_far_more_than_their_file_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(message_compression, "FREE_BYTES", 100_000)
    monkeypatch.setattr(message_compression, "MAX_RATIO", 10)
    folder = recording(tmp_path / "trial", mode=CompressionMode.MESSAGE, count=1)
    (folder / "trial.db3").unlink()
    packed = zstandard.ZstdCompressor().compress(image(0, 60_000))
    database(folder / "trial.db3", [(2, START + i, packed) for i in range(20)])
    edit(folder, topics_with_message_count=[])
    log = open_log(folder)
    heights = log.read({"/image": ["height"]})["/image"].columns["height"]
    assert 0 < heights.size < 5
    assert heights.size + lost_messages(log) == 20
