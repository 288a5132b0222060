"""ROS2 folders and SQLite files, against sqlite3's and rosbags' own reading of the same files."""

from __future__ import annotations

import re
import shutil
import sqlite3
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import pytest
import zstandard
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Reader
from ferryid.ingest.unpack import message_unpacker

STORE = get_typestore(Stores.ROS2_HUMBLE)
POINT = "geometry_msgs/msg/PointStamped"
IMAGE = "sensor_msgs/msg/Image"
START = 1_700_000_000_000_000_000
SCHEMA = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
    encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""


def point(i: int, frame: str = "map") -> bytes:
    """Message number `i`: its x is i."""
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](sec=1_700_000_000 + i // 100, nanosec=i % 100 * 10_000_000)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
    where = types["geometry_msgs/msg/Point"](x=float(i), y=-0.5 * i, z=0.0)
    return bytes(STORE.serialize_cdr(types[POINT](header=header, point=where), POINT))


def image(i: int, size: int) -> bytes:
    """Picture of `size` bytes whose height is i."""
    types = STORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](sec=i, nanosec=0), "camera")
    data = np.full(size, i % 256, np.uint8)
    return bytes(STORE.serialize_cdr(types[IMAGE](header, i, 1, "mono8", 0, 1, data), IMAGE))


def definition(msgtype: str) -> str:
    return STORE.generate_msgdef(msgtype, ros_version=2)[0]


def create(connection: sqlite3.Connection, definitions: bool = True, distro: str = "jazzy") -> None:
    """Tables as rosbag2 makes them, with topics 1 (points) and 2 (pictures)."""
    connection.executescript(SCHEMA)
    connection.execute("INSERT INTO schema VALUES (4, ?)", (distro,))
    for number, name, msgtype in ((1, "/point", POINT), (2, "/image", IMAGE)):
        connection.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '', '')", (number, name, msgtype))
        if definitions:
            connection.execute(
                "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition,"
                " type_description_hash) VALUES (?, 'ros2msg', ?, '')",
                (msgtype, definition(msgtype)),
            )


def insert(connection: sqlite3.Connection, rows: Sequence[tuple[int, int, bytes]]) -> None:
    connection.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
    connection.commit()


def points(first: int, last: int) -> list[tuple[int, int, bytes]]:
    return [(1, START + i * 10_000_000, point(i)) for i in range(first, last)]


def database(path: Path, rows: Sequence[tuple[int, int, bytes]], page_size: int = 4096) -> Path:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f"PRAGMA page_size={page_size}")
        create(connection)
        insert(connection, rows)
    return path


def xs(log: Reader) -> list[int]:
    """Numbers of the points in a log; each must come with its own receive time and stamp."""
    series = log.read({"/point": ["point.x"]})["/point"]
    numbers = series.columns["point.x"].astype(int)
    assert series.stamp_ns is not None
    assert (series.receive_ns == START + numbers * 10_000_000).all()
    assert (series.stamp_ns == START + numbers * 10_000_000).all()
    return [int(i) for i in numbers]


def kinds(path: Path, page_size: int = 4096) -> list[int]:
    """First byte of every page: 5 for an interior and 13 for a leaf page of a table."""
    return list(path.read_bytes()[::page_size])


def root_page(path: Path, name: str = "messages") -> int:
    with closing(sqlite3.connect(path)) as connection:
        (root,) = connection.execute("SELECT rootpage FROM sqlite_master WHERE name=?", (name,)).fetchone()
    return int(root)


def test_columns_equal_those_of_rosbags(tmp_path: Path) -> None:
    frames = ["map", "", "odom", "a longer name"]
    rows = [(1, START + i * 10_000_000, point(i, frames[i // 7 % 4])) for i in range(400)]
    rows += [(2, START + i, image(i, 20 + 3 * i)) for i in range(50)]
    path = database(tmp_path / "log.db3", rows)
    series = open_log(path).read({"/point": ["point.x", "header.frame_id"], "/image": ["height", "data[2]"]})
    with AnyReader([path]) as reader:
        theirs = {name: [] for name in ("/point", "/image")}
        for connection, time, raw in reader.messages():
            theirs[connection.topic].append((time, reader.deserialize(raw, connection.msgtype)))
    ours = series["/point"]
    assert ours.receive_ns.tolist() == [time for time, _ in theirs["/point"]]
    assert ours.columns["point.x"].tolist() == [m.point.x for _, m in theirs["/point"]]
    assert list(ours.columns["header.frame_id"]) == [m.header.frame_id for _, m in theirs["/point"]]
    assert series["/image"].columns["height"].tolist() == [m.height for _, m in theirs["/image"]]
    assert series["/image"].columns["data[2]"].tolist() == [m.data[2] for _, m in theirs["/image"]]


def test_messages_larger_than_a_page_keep_their_order(tmp_path: Path) -> None:
    rows = [(2, START + i, image(i, 9000 if i % 3 else 10)) for i in range(60)]
    log = open_log(database(tmp_path / "log.db3", [*rows[:30], *points(0, 50), *rows[30:]]))
    assert log.read({"/image": ["height"]})["/image"].columns["height"].tolist() == list(range(60))
    assert xs(log) == list(range(50))
    topics = {topic.name: topic for topic in log.topics}
    assert (topics["/image"].count, topics["/point"].count) == (60, 50)
    assert (topics["/point"].start_ns, topics["/point"].end_ns) == (START, START + 490_000_000)


def test_an_empty_message_at_the_end_of_the_file_is_a_corrupt_one(tmp_path: Path) -> None:
    """SQLite fills a page from its end: the first row's data, of no bytes, stand behind the file's last byte."""
    path = database(tmp_path / "log.db3", points(0, 10))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("DROP TABLE messages")
        connection.execute("VACUUM")
        connection.executescript(SCHEMA[SCHEMA.index("CREATE TABLE messages") : SCHEMA.index("CREATE INDEX")])
        insert(connection, [(1, START, b""), *points(0, 5)])
    assert root_page(path) == path.stat().st_size // 4096
    log = open_log(path)
    assert xs(log) == list(range(5))
    assert lost_messages(log) == 1


# Damage


def lost_messages(log: Reader) -> int:
    counts = [loss.messages for loss in log.losses]
    assert None not in counts
    return sum(count for count in counts if count is not None)


def damaged(path: Path, start: int, data: bytes) -> Path:
    with path.open("r+b") as file:
        file.seek(start)
        file.write(data)
    return path


def test_a_destroyed_page_costs_its_own_messages_and_they_are_counted(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 2000))
    leaf = len(kinds(path)) // 2
    while kinds(path)[leaf] != 0x0D:
        leaf += 1
    log = open_log(damaged(path, leaf * 4096, bytes(4096)))
    found = xs(log)
    missing = sorted(set(range(2000)) - set(found))
    assert 10 < len(missing) < 100
    assert missing == list(range(missing[0], missing[-1] + 1))
    assert lost_messages(log) == len(missing)
    (loss,) = log.losses
    assert loss.start_ns == START + (missing[0] - 1) * 10_000_000
    assert loss.end_ns == START + (missing[-1] + 1) * 10_000_000


@pytest.mark.slow
def test_many_destroyed_pages_are_as_long_as_they_are_together(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 6000), page_size=1024)
    with closing(sqlite3.connect(path)) as connection:
        (root,) = connection.execute("SELECT rootpage FROM sqlite_master WHERE name='messages'").fetchone()
    leaves = [page for page, kind in enumerate(kinds(path, 1024)) if kind == 0x0D and page > root]
    for leaf in leaves[100:400:5]:
        damaged(path, leaf * 1024, bytes(1024))
    log = open_log(path)
    missing = np.setdiff1d(np.arange(6000), xs(log))
    stretches = 1 + np.count_nonzero(np.diff(missing) > 1)
    (loss,) = log.losses
    assert f"in {stretches} places" in loss.what
    assert loss.messages == len(missing)
    assert loss.seconds == pytest.approx((len(missing) + stretches) * 0.01)


@pytest.mark.slow
def test_messages_below_a_destroyed_interior_page_are_counted(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 6000), page_size=512)
    root = root_page(path)
    page = path.read_bytes()[(root - 1) * 512 : root * 512]
    first_cell = int.from_bytes(page[12:14], "big")
    first_child = int.from_bytes(page[first_cell : first_cell + 4], "big")
    assert kinds(path, 512)[root - 1] == 5
    assert kinds(path, 512)[first_child - 1] == 5
    assert xs(open_log(path)) == list(range(6000))
    log = open_log(damaged(path, (first_child - 1) * 512, b"\xff" * 512))
    found = xs(log)
    assert found == list(range(6000 - len(found), 6000))
    assert 5000 < len(found) == 6000 - lost_messages(log)
    log = open_log(damaged(path, (root - 1) * 512, b"\xff" * 512))
    assert xs(log) == []
    assert lost_messages(log) == 6000


@pytest.mark.parametrize("part", [0.2, 0.5, 0.93, 0.999])
def test_a_truncated_file_yields_what_is_left(tmp_path: Path, part: float) -> None:
    path = database(tmp_path / "log.db3", points(0, 5000))
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.truncate(int(size * part))
    log = open_log(path)
    found = xs(log)
    assert found == sorted(set(found))
    assert len(found) > (part - 0.15) * 5000
    assert any("ends after" in loss.what for loss in log.losses)


@pytest.mark.parametrize("change", [1, -1])
def test_a_cell_that_contradicts_itself_is_left_out(tmp_path: Path, change: int) -> None:
    """The payload size of one row no longer fits its columns."""
    path = database(tmp_path / "log.db3", points(0, 20))
    # Before the message: payload size, rowid, header of five bytes, time. The topic, 1, is a constant type.
    cell = path.read_bytes().index(point(7)) - 8 - 5 - 2
    size = len(point(7)) + 5 + 8
    assert path.read_bytes()[cell] == size
    log = open_log(damaged(path, cell, bytes([size + change])))
    assert xs(log) == [*range(7), *range(8, 20)]
    assert lost_messages(log) == 1


def test_verify_reports_what_sqlite_itself_finds(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 500))
    log = open_log(path)
    log.read({"/point": []}, verify=True)
    assert log.losses == ()
    with closing(sqlite3.connect(path)) as connection:
        (index,) = connection.execute("SELECT rootpage FROM sqlite_master WHERE name='timestamp_idx'").fetchone()
    log = open_log(damaged(path, (index - 1) * 4096, b"\x0a" + bytes(200)))
    log.read({"/point": []}, verify=True)
    assert any("integrity check" in loss.what for loss in log.losses)


# A recorder that was interrupted


def snapshot(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_messages_in_a_write_ahead_log_count_and_nothing_is_written_beside_it(tmp_path: Path) -> None:
    live, copy = tmp_path / "live", tmp_path / "copy"
    live.mkdir()
    copy.mkdir()
    with closing(sqlite3.connect(live / "log.db3")) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA wal_autocheckpoint=0")
        create(connection)
        insert(connection, points(0, 300))
        for file in live.iterdir():
            shutil.copy(file, copy)
    before = snapshot(copy)
    assert before["log.db3-wal"]
    copy.chmod(0o555)
    assert xs(open_log(copy / "log.db3")) == list(range(300))
    assert snapshot(copy) == before


def test_empty_wal_and_shm_files_change_nothing(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 30))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
    (tmp_path / "log.db3-wal").write_bytes(b"")
    (tmp_path / "log.db3-shm").write_bytes(bytes(32768))
    before = snapshot(tmp_path)
    assert xs(open_log(path)) == list(range(30))
    assert snapshot(tmp_path) == before


def test_an_unfinished_transaction_is_rolled_back(tmp_path: Path) -> None:
    live, copy = tmp_path / "live", tmp_path / "copy"
    live.mkdir()
    copy.mkdir()
    path = database(live / "log.db3", points(0, 300))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA cache_size=1")
        connection.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", points(300, 900))
        for file in live.iterdir():
            shutil.copy(file, copy)
        connection.rollback()
    assert (copy / "log.db3-journal").stat().st_size > 0
    assert xs(open_log(copy / "log.db3")) == list(range(300))


# Folders


def recording(
    folder: Path,
    storage: StoragePlugin = StoragePlugin.SQLITE3,
    mode: CompressionMode = CompressionMode.NONE,
    count: int = 500,
    topics: Sequence[str] = ("/point",),
) -> Path:
    """Folder written by rosbags."""
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for name in topics:
            connection = writer.add_connection(name, POINT, typestore=STORE)
            for _, time, data in points(0, count):
                writer.write(connection, time, data)
    return folder


def edit(folder: Path, **changes: object) -> Path:
    """Change entries of a folder's metadata.yaml."""
    yaml = YAML(typ="safe")
    document = yaml.load(folder / "metadata.yaml")
    document["rosbag2_bagfile_information"].update(changes)
    with (folder / "metadata.yaml").open("w") as out:
        yaml.dump(document, out)
    return folder


@pytest.mark.parametrize("mode", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE])
@pytest.mark.parametrize("storage", list(StoragePlugin))
def test_every_storage_and_compression_gives_the_same_columns(
    tmp_path: Path, storage: StoragePlugin, mode: CompressionMode
) -> None:
    folder = recording(tmp_path / "trial", storage, mode)
    log = open_log(folder)
    assert [(topic.name, topic.count, topic.note) for topic in log.topics] == [("/point", 500, "")]
    assert xs(log) == list(range(500))
    assert log.losses == ()
    assert folder / "metadata.yaml" in log.paths
    assert xs(open_log(folder / "metadata.yaml")) == list(range(500))


@pytest.mark.parametrize("storage", list(StoragePlugin))
def test_topics_share_what_unpacks_their_messages(
    tmp_path: Path, storage: StoragePlugin, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def counted(*args: Any, **settings: Any) -> Any:
        made.append(settings)
        return decompressor(*args, **settings)

    topics = [f"/point{number}" for number in range(20)]
    folder = recording(tmp_path / "trial", storage, CompressionMode.MESSAGE, topics=topics)
    decompressor = zstandard.ZstdDecompressor
    log = open_log(folder)
    monkeypatch.setattr(zstandard, "ZstdDecompressor", counted)
    series = log.read({name: ["point.x"] for name in topics})
    assert [len(one.receive_ns) for one in series.values()] == [500] * len(topics)
    # A context of zstd takes some 100 kB, and a file may list tens of thousands of topics.
    assert len(made) == 1


@pytest.mark.parametrize("compress", [zstandard.ZstdCompressor().compress, lz4.frame.compress])
def test_a_bare_compressed_file_is_read(tmp_path: Path, compress: Callable[[bytes], bytes]) -> None:
    ending = "lz4" if compress is lz4.frame.compress else "zstd"
    data = database(tmp_path / "log.db3", points(0, 300)).read_bytes()
    packed = tmp_path / f"packed.db3.{ending}"
    # Two frames, as a tool that compresses in pieces writes them.
    packed.write_bytes(compress(data[:50_000]) + compress(data[50_000:]))
    log = open_log(packed)
    assert xs(log) == list(range(300))
    assert log.paths == (packed,)


@pytest.mark.slow
def test_a_cut_compressed_file_yields_its_beginning(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rows = [(1, START + i * 10_000_000, point(i, rng.bytes(30).hex())) for i in range(4000)]
    data = database(tmp_path / "log.db3", rows).read_bytes()
    packed = zstandard.ZstdCompressor().compress(data)
    (tmp_path / "cut.db3.zstd").write_bytes(packed[: len(packed) * 2 // 3])
    log = open_log(tmp_path / "cut.db3.zstd")
    assert len(xs(log)) > 1500
    assert any("cut off" in loss.what for loss in log.losses)
    assert all(loss.file == str(tmp_path / "cut.db3.zstd") for loss in log.losses)


def test_messages_compressed_with_lz4(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial", count=1)
    file = folder / "trial.db3"
    file.unlink()
    database(file, [(topic, time, lz4.frame.compress(data)) for topic, time, data in points(0, 40)])
    edit(folder, compression_mode="MESSAGE", compression_format="lz4")
    assert xs(open_log(folder)) == list(range(40))
    edit(folder, compression_format="brotli")
    with pytest.raises(FerryIdError, match=r"brotli.* Fix: "):
        open_log(folder)


@pytest.mark.parametrize(
    ("codec", "compress"), [("zstd", zstandard.ZstdCompressor().compress), ("lz4", lz4.frame.compress)]
)
def test_a_cut_message_is_not_taken_for_a_short_one(codec: str, compress: Callable[[bytes], bytes]) -> None:
    data = np.random.default_rng(3).bytes(300_000)
    unpack = message_unpacker(codec)
    assert unpack(compress(data)) == data
    assert unpack(compress(data)[:-1]) is None
    assert unpack(b"") is None


def test_a_message_that_cannot_be_unpacked_is_counted(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial", mode=CompressionMode.MESSAGE)
    with closing(sqlite3.connect(folder / "trial.db3")) as connection:
        connection.execute("UPDATE messages SET data=substr(data, 1, length(data) - 5) WHERE id IN (3, 4)")
        connection.commit()
    log = open_log(folder)
    assert xs(log) == [0, 1, *range(4, 500)]
    assert lost_messages(log) == 2


def split(folder: Path) -> Path:
    """A recording of three files whose order is not that of their names."""
    folder.mkdir()
    names = ["log_10.db3", "log_8.db3", "log_9.db3"]
    files = []
    for k, name in enumerate(names):
        database(folder / name, points(100 * k, 100 * k + 100))
        start = {"nanoseconds_since_epoch": START + k * 10**9}
        files.append(
            {
                "path": name,
                "starting_time": start,
                "duration": {"nanoseconds": 990_000_000},
                "message_count": 100,
            }
        )
    about = {"name": "/point", "type": POINT, "serialization_format": "cdr", "offered_qos_profiles": ""}
    information = {
        "version": 6,
        "storage_identifier": "sqlite3",
        "duration": {"nanoseconds": 2_990_000_000},
        "starting_time": {"nanoseconds_since_epoch": START},
        "message_count": 300,
        "topics_with_message_count": [{"topic_metadata": about, "message_count": 300}],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": names,
        "files": files,
    }
    with (folder / "metadata.yaml").open("w") as out:
        YAML(typ="safe").dump({"rosbag2_bagfile_information": information}, out)
    return folder


def test_a_split_recording_is_one_log(tmp_path: Path) -> None:
    log = open_log(split(tmp_path / "trial"))
    assert xs(log) == list(range(300))
    assert {topic.name: topic.count for topic in log.topics} == {"/point": 300, "/image": 0}
    assert log.losses == ()


def test_a_missing_part_is_a_loss_with_its_messages_and_times(tmp_path: Path) -> None:
    folder = split(tmp_path / "trial")
    (folder / "log_8.db3").unlink()
    log = open_log(folder)
    assert xs(log) == [*range(100), *range(200, 300)]
    (loss,) = log.losses
    assert (loss.file, loss.messages) == (str(folder / "log_8.db3"), 100)
    assert loss.seconds == pytest.approx(0.99)


def test_an_unreadable_part_is_a_loss_and_the_others_are_read(tmp_path: Path) -> None:
    folder = split(tmp_path / "trial")
    (folder / "log_8.db3").write_bytes(b"")
    log = open_log(folder)
    assert xs(log) == [*range(100), *range(200, 300)]
    assert [(loss.messages, "empty" in loss.what) for loss in log.losses] == [(100, True)]


def test_a_file_that_the_metadata_does_not_name_is_told(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial")
    database(folder / "other.db3", points(0, 10))
    log = open_log(folder)
    assert xs(log) == list(range(500))
    assert [(loss.file, "not named" in loss.what) for loss in log.losses] == [(str(folder / "other.db3"), True)]


@pytest.mark.parametrize(
    "text",
    ["", "rosbag2_bagfile_information: [", "other: 1\n", "rosbag2_bagfile_information:\n  version: 5\n"],
)
def test_a_broken_metadata_file_does_not_hide_the_recording(tmp_path: Path, text: str) -> None:
    folder = recording(tmp_path / "trial")
    (folder / "metadata.yaml").write_text(text)
    log = open_log(folder)
    assert xs(log) == list(range(500))
    assert [(loss.file, loss.messages) for loss in log.losses] == [(str(folder / "metadata.yaml"), 0)]
    assert re.fullmatch(r"the file (is|lacks) .*; the recording was read without it", log.losses[0].what)


def test_counts_that_contradict_the_files_are_told(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial")
    document = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").write_text(document.replace("message_count: 500", "message_count: 520"))
    log = open_log(folder)
    assert [(loss.topic, loss.messages) for loss in log.losses] == [("/point", 20)]
    (folder / "metadata.yaml").write_text(document.replace("message_count: 500", "message_count: 480"))
    log = open_log(folder)
    assert log.losses == ()
    assert "counts 480 messages, the files hold 500" in log.topics[0].note


def test_a_truncated_file_of_a_folder_says_exactly_how_much_is_lost(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial", count=3000)
    with (folder / "trial.db3").open("r+b") as file:
        file.truncate((folder / "trial.db3").stat().st_size // 2)
    log = open_log(folder)
    found = xs(log)
    assert lost_messages(log) == 3000 - len(found)
    loss = log.losses[-1]
    assert loss.start_ns == START + found[-1] * 10_000_000
    assert loss.end_ns == START + 2999 * 10_000_000


def test_a_recording_without_messages_lists_its_topics(tmp_path: Path) -> None:
    log = open_log(recording(tmp_path / "trial", count=0))
    (topic,) = log.topics
    assert (topic.count, topic.start_ns, topic.end_ns) == (0, None, None)
    series = log.read({"/point": ["point.x"]})["/point"]
    assert series.receive_ns.size == series.columns["point.x"].size == 0


def test_a_folder_without_its_files_is_refused(tmp_path: Path) -> None:
    folder = recording(tmp_path / "trial")
    (folder / "trial.db3").unlink()
    with pytest.raises(FerryIdError, match=r"holds no recording, metadata.yaml names: trial\.db3\. Fix: "):
        open_log(folder)


# Definitions


def test_bundled_definitions_stand_in_and_say_so(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 10))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("DELETE FROM message_definitions")
        connection.execute("UPDATE schema SET ros_distro='jazzy'")
        connection.commit()
    log = open_log(path)
    assert "that of ROS2 Jazzy stands in" in log.topics[0].note
    assert log.topics[0].fields["point.x"] == "float64"
    assert xs(log) == list(range(10))


@pytest.mark.parametrize(
    ("digest", "said"), [("right", "confirmed by the type hash"), ("RIHS01_00", "cannot be decoded")]
)
def test_the_type_hash_decides_whether_a_definition_stands_in(tmp_path: Path, digest: str, said: str) -> None:
    path = database(tmp_path / "log.db3", points(0, 10))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("DELETE FROM message_definitions")
        stated = STORE.hash_rihs01(POINT) if digest == "right" else digest
        connection.execute("UPDATE topics SET type_description_hash=?", (stated,))
        connection.commit()
    log = open_log(path)
    assert said in log.topics[0].note
    if digest != "right":
        with pytest.raises(FerryIdError, match=r"/point .* Fix: "):
            log.read({"/point": []})


@pytest.mark.parametrize("text", ["int64 a\n---\nint64 b", "(((", "other_msgs/Missing m\n", None])
def test_an_unknown_type_is_listed_and_refused_only_when_wanted(tmp_path: Path, text: str | None) -> None:
    path = database(tmp_path / "log.db3", points(0, 10))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("INSERT INTO topics VALUES (3, '/mystery', 'ferry_msgs/msg/Mystery', 'cdr', '', '')")
        if text is not None:
            connection.execute(
                "INSERT INTO message_definitions VALUES (9, 'ferry_msgs/msg/Mystery', 'ros2msg', ?, '')",
                (text,),
            )
        insert(connection, [(3, START, b"\x00\x01\x00\x00abcd")])
    log = open_log(path)
    topic = next(topic for topic in log.topics if topic.name == "/mystery")
    assert (topic.count, topic.fields) == (1, {})
    assert "cannot be decoded" in topic.note
    assert xs(log) == list(range(10))
    with pytest.raises(FerryIdError, match=r"/mystery of type ferry_msgs/msg/Mystery cannot be decoded.* Fix: "):
        log.read({"/mystery": []})


def test_a_custom_type_is_read_by_the_definition_in_the_file(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", [])
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("INSERT INTO topics VALUES (3, '/state', 'ferry_msgs/msg/State', 'cdr', '', '')")
        connection.execute(
            "INSERT INTO message_definitions VALUES (9, 'ferry_msgs/msg/State', 'ros2msg', 'uint8 mode\nfloat64 rpm', '')"
        )
        data = b"\x00\x01\x00\x00" + b"\x07" + bytes(7) + np.float64(600.5).tobytes()
        insert(connection, [(3, START, data)])
    columns = open_log(path).read({"/state": ["mode", "rpm"]})["/state"].columns
    assert columns["mode"].tolist() == [7]
    assert columns["rpm"].tolist() == [600.5]


# Refusals


def refusal(path: Path) -> str:
    with pytest.raises(FerryIdError) as caught:
        open_log(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert " Fix: " in line
    assert "\n" not in line
    return line


def test_what_is_not_a_bag_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.db3").write_text("this is no database, whatever its name says" * 10)
    assert "not a readable SQLite database" in refusal(tmp_path / "text.db3")
    with closing(sqlite3.connect(tmp_path / "other.db3")) as connection:
        connection.execute("CREATE TABLE photos(id INTEGER)")
    assert "photos" in refusal(tmp_path / "other.db3")
    (tmp_path / "log.db3.zstd").write_bytes(b"this was never compressed")
    assert "neither a zstd nor an lz4 file" in refusal(tmp_path / "log.db3.zstd")
    head = database(tmp_path / "log.db3", points(0, 10)).read_bytes()[:3000]
    (tmp_path / "head.db3").write_bytes(head)
    assert "damaged or cut off" in refusal(tmp_path / "head.db3")


def test_a_foreign_serialisation_is_refused(tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", points(0, 10))
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE topics SET serialization_format='flatbuffers' WHERE id=2")
        connection.commit()
        log = open_log(path)
        assert xs(log) == list(range(10))
        with pytest.raises(FerryIdError, match=r'/image .* serialised as "flatbuffers".* Fix: '):
            log.read({"/image": []})
        connection.execute("UPDATE topics SET serialization_format='flatbuffers'")
        connection.commit()
    assert "flatbuffers" in refusal(path)


def test_a_misspelt_topic_or_field_gets_a_suggestion(tmp_path: Path) -> None:
    log = open_log(recording(tmp_path / "trial", count=5))
    with pytest.raises(FerryIdError, match='Did you mean "/point"'):
        log.read({"/pont": []})
    with pytest.raises(FerryIdError, match=r'Did you mean "point\.x"'):
        log.read({"/point": ["point.xx"]})
