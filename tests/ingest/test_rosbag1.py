"""ROS1 bags: the same messages as rosbags gives, and every intact one of a damaged file."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log

STORE = get_typestore(Stores.ROS1_NOETIC)
NS = 1_000_000_000
START = 1_600_000_000 * NS
COUNT = 600
COMPRESSIONS = ["none", "lz4", "bz2"]


def write_bag(path: Path, compression: str, *, count: int = COUNT, chunk: int = 4000) -> Path:
    """Write `count` speeds at 100 Hz and a stamped wrench at 50 Hz in many small chunks."""
    writer = Writer(path)
    if compression != "none":
        writer.set_compression(getattr(Writer.CompressionFormat, compression.upper()))
    writer.chunk_threshold = chunk
    types = STORE.types
    writer.open()
    speed = writer.add_connection("/speed", "std_msgs/msg/Float64", typestore=STORE)
    force = writer.add_connection("/force", "geometry_msgs/msg/WrenchStamped", typestore=STORE)
    for index in range(count):
        time = START + index * NS // 100
        message = types["std_msgs/msg/Float64"](float(index))
        writer.write(speed, time, STORE.serialize_ros1(message, "std_msgs/msg/Float64"))
        if index % 2 == 0:
            stamp = types["builtin_interfaces/msg/Time"](time // NS, time % NS - time % 1000)
            vector = types["geometry_msgs/msg/Vector3"]
            wrench = types["geometry_msgs/msg/Wrench"](vector(index * 0.5, 0.0, 0.0), vector(0.0, 0.0, -index * 0.25))
            header = types["std_msgs/msg/Header"](index, stamp, "base_link")
            message = types["geometry_msgs/msg/WrenchStamped"](header, wrench)
            writer.write(force, time + 5, STORE.serialize_ros1(message, "geometry_msgs/msg/WrenchStamped"))
    writer.close()
    return path


WANTED = {"/speed": ["data"], "/force": ["wrench.force.x", "header.frame_id"]}


def chunk_places(path: Path) -> list[int]:
    """Bytes at which the chunk records of a bag begin, by rosbags' own reader."""
    with AnyReader([path]) as reader:
        return sorted(info.pos for info in reader.readers[0].chunk_infos)  # type: ignore[union-attr]


def assert_rows_are_right(series: dict[str, Any]) -> None:
    """What was read is what was written at that time, however much of it there is."""
    index = (series["/speed"].receive_ns - START + NS // 200) // (NS // 100)
    np.testing.assert_array_equal(series["/speed"].columns["data"], index)
    index = (series["/force"].receive_ns - START + NS // 200) // (NS // 100)
    np.testing.assert_array_equal(series["/force"].columns["wrench.force.x"], index * 0.5)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_every_compression_gives_what_was_written(tmp_path: Path, compression: str) -> None:
    reader = open_log(write_bag(tmp_path / "a.bag", compression))
    speed, force = (next(topic for topic in reader.topics if topic.name == name) for name in ("/speed", "/force"))
    assert (speed.count, speed.start_ns, speed.end_ns) == (COUNT, START, START + (COUNT - 1) * NS // 100)
    assert (speed.type, speed.encoding, dict(speed.fields)) == ("std_msgs/msg/Float64", "ros1", {"data": "float64"})
    assert "no header" in speed.note
    assert force.note == ""
    series = reader.read(WANTED)
    assert len(series["/speed"].receive_ns) == COUNT
    assert len(series["/force"].receive_ns) == COUNT // 2
    assert_rows_are_right(series)
    assert series["/speed"].stamp_ns is None
    stamps = series["/force"].stamp_ns
    np.testing.assert_array_equal(stamps, series["/force"].receive_ns - 5)
    assert set(series["/force"].columns["header.frame_id"]) == {"base_link"}
    assert reader.losses == ()


@pytest.mark.slow
@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_truncated_bag_yields_every_message_before_the_cut(tmp_path: Path, compression: str) -> None:
    path = write_bag(tmp_path / "a.bag", compression)
    whole, places = path.read_bytes(), chunk_places(path)
    for cut in (places[3] + 7, places[5] + 400, places[-1] + 60, len(whole) - 30):
        path.write_bytes(whole[:cut])
        intact = sum(place < cut for place in places) - 1
        reader = open_log(path)
        series = reader.read(WANTED)
        assert_rows_are_right(series)
        rows = len(series["/speed"].receive_ns)
        with_all = _rows_of_chunks(whole, places, tmp_path / "whole.bag")
        assert rows >= sum(with_all[:intact])
        assert reader.losses
        assert all(loss.file == str(path) for loss in reader.losses)
        if cut < places[-1]:
            assert any("ends at byte" in loss.what and "messages in" in loss.what for loss in reader.losses)


def _rows_of_chunks(whole: bytes, places: list[int], path: Path) -> list[int]:
    path.write_bytes(whole)
    with AnyReader([path]) as reader:
        bag: Any = reader.readers[0]
        speed = next(one.id for one in bag.connections if one.topic == "/speed")
        return [info.connection_counts.get(speed, 0) for info in sorted(bag.chunk_infos)]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("cut", ["inside the last", "between the two", "inside the first"])
def test_a_cut_among_the_index_records_of_a_chunk_loses_no_message_of_it(
    tmp_path: Path, compression: str, cut: str
) -> None:
    path = write_bag(tmp_path / "a.bag", compression, chunk=8000)
    whole, places = path.read_bytes(), chunk_places(path)
    rows = _rows_of_chunks(whole, places, tmp_path / "whole.bag")
    # Of the two index records the last is that of the force; its header begins 28 bytes before its connection's name.
    last = places[4] - (whole.rindex(b"conn=\1\0\0\0", 0, places[4]) - 28)
    assert struct.unpack_from("<I", whole, places[4] - last)[0] == 47
    path.write_bytes(
        whole[: places[4] - {"inside the last": 1, "between the two": last, "inside the first": last + 9}[cut]]
    )
    series = open_log(path).read(WANTED)
    assert len(series["/speed"].receive_ns) == sum(rows[:4])
    assert len(series["/force"].receive_ns) == sum(rows[:4]) // 2
    assert_rows_are_right(series)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_bag_that_was_never_closed_is_read_whole(tmp_path: Path, compression: str) -> None:
    path = write_bag(tmp_path / "a.bag", compression)
    whole = path.read_bytes()
    with AnyReader([path]) as reader:
        end = max(info.pos for info in reader.readers[0].chunk_infos)  # type: ignore[union-attr]
    # What a recorder that was killed leaves: no index behind the last chunk and none announced in the bag header.
    (place,) = struct.unpack("<Q", whole[whole.index(b"index_pos=") + 10 :][:8])
    assert place > end
    active = tmp_path / "a.bag.active"
    active.write_bytes(whole[:place].replace(b"index_pos=" + struct.pack("<Q", place), b"index_pos=" + bytes(8)))
    recovered = open_log(active)
    series = recovered.read(WANTED)
    assert len(series["/speed"].receive_ns) == COUNT
    assert_rows_are_right(series)
    assert [topic.count for topic in recovered.topics] == [COUNT // 2, COUNT]
    assert ["not closed" in loss.what for loss in recovered.losses] == [True, False]
    assert [loss.messages for loss in recovered.losses] == [0, None]


@pytest.mark.parametrize("compression", ["lz4", "bz2"])
def test_a_damaged_chunk_costs_its_own_messages_and_they_are_counted(tmp_path: Path, compression: str) -> None:
    path = write_bag(tmp_path / "a.bag", compression, chunk=60_000)
    places = chunk_places(path)
    per_chunk = _rows_of_chunks(path.read_bytes(), places, tmp_path / "whole.bag")
    raw = bytearray(path.read_bytes())
    raw[places[1] + 60 : places[1] + 70] = b"\xff" * 10
    path.write_bytes(raw)
    reader = open_log(path)
    assert reader.losses == ()
    series = reader.read({"/speed": ["data"]})
    rows = len(series["/speed"].receive_ns)
    assert COUNT - per_chunk[1] <= rows < COUNT
    (loss,) = reader.losses
    assert loss.messages == COUNT - rows
    assert f"byte {places[1]}" in loss.what
    assert loss.start_ns is not None
    assert loss.start_ns > START
    assert loss.seconds == pytest.approx((COUNT - rows - 1) / 100, abs=1e-6)


def test_damage_to_the_record_of_a_chunk_is_walked_past(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none")
    places = chunk_places(path)
    per_chunk = _rows_of_chunks(path.read_bytes(), places, tmp_path / "whole.bag")
    raw = bytearray(path.read_bytes())
    raw[places[2] : places[2] + 20] = b"\xff" * 20
    path.write_bytes(raw)
    reader = open_log(path)
    series = reader.read(WANTED)
    assert_rows_are_right({**series})
    assert len(series["/speed"].receive_ns) == COUNT - per_chunk[2]
    # The record at the file's end tells how much the chunk held, and when.
    (loss,) = [loss for loss in reader.losses if f"byte {places[2]} " in loss.what]
    rows = [*series["/speed"].receive_ns, *series["/force"].receive_ns]
    assert loss.messages == COUNT * 3 // 2 - len(rows)
    assert loss.start_ns not in rows
    assert START < loss.start_ns < loss.end_ns < START + COUNT * NS // 100


def test_damage_to_the_length_of_a_chunk_does_not_swallow_those_behind_it(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none")
    places = chunk_places(path)
    per_chunk = _rows_of_chunks(path.read_bytes(), places, tmp_path / "whole.bag")
    raw = bytearray(path.read_bytes())
    length = places[2] + 4 + struct.unpack_from("<I", raw, places[2])[0]
    raw[length : length + 4] = struct.pack("<I", 9000)
    path.write_bytes(raw)
    reader = open_log(path)
    series = reader.read(WANTED)
    assert_rows_are_right(series)
    assert len(series["/speed"].receive_ns) >= COUNT - per_chunk[2]
    assert reader.losses


def test_damage_to_an_index_record_costs_no_message(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "lz4")
    places = chunk_places(path)
    raw = bytearray(path.read_bytes())
    raw[places[3] - 100 : places[3] - 90] = b"\xff" * 10
    header = raw.index(b"conn=\1\0\0\0", places[3] - 600)
    raw[header - 20 : header] = b"\xff" * 20
    path.write_bytes(raw)
    reader = open_log(path)
    series = reader.read(WANTED)
    assert_rows_are_right(series)
    assert len(series["/speed"].receive_ns) == COUNT
    assert len(series["/force"].receive_ns) == COUNT // 2
    assert reader.losses


def test_blocks_before_the_damage_in_a_compressed_chunk_are_recovered(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat.LZ4)
    writer.open()
    rng = np.random.default_rng(0)
    speeds = rng.normal(size=9000)
    connection = writer.add_connection("/speed", "std_msgs/msg/Float64", typestore=STORE)
    for index, speed in enumerate(speeds):
        writer.write(connection, START + index * 1000, struct.pack("<d", speed))
    writer.close()
    raw = bytearray(path.read_bytes())
    (place,) = chunk_places(path)
    # lz4 frames hold blocks of 64 kB; a length of a later block that is nonsense ends the frame there.
    frame = raw.index(struct.pack("<I", 0x184D2204), place)
    block = frame + 15
    for _ in range(4):
        block += 4 + (struct.unpack_from("<I", raw, block)[0] & 0x7FFFFFFF)
    raw[block : block + 4] = b"\xff" * 4
    path.write_bytes(raw)
    reader = open_log(path)
    found = reader.read({"/speed": ["data"]})["/speed"].columns["data"]
    assert 4 * 65536 // 54 - 10 < len(found) < len(speeds)
    np.testing.assert_array_equal(found, speeds[: len(found)])
    assert [loss.messages for loss in reader.losses] == [len(speeds) - len(found)]
    # No checksum vouches for a part of a frame.
    assert len(reader.read({"/speed": ["data"]}, verify=True)["/speed"].receive_ns) == 0
    assert [loss.messages for loss in reader.losses] == [len(speeds)]


def test_an_index_entry_that_contradicts_its_message_is_counted(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "lz4")
    raw = bytearray(path.read_bytes())
    entry = raw.index(struct.pack("<II", START // NS, 50 * NS // 100), chunk_places(path)[0])
    raw[entry + 4] ^= 1
    path.write_bytes(raw)
    reader = open_log(path)
    assert len(reader.read({"/speed": ["data"]})["/speed"].receive_ns) == COUNT - 1
    assert [loss.messages for loss in reader.losses] == [1]


def test_a_damaged_message_record_is_left_out(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none")
    raw = bytearray(path.read_bytes())
    # The header of the record that holds the speed 300.0.
    place = raw.index(struct.pack("<d", 300.0)) - 30
    raw[place : place + 8] = b"\xff" * 8
    path.write_bytes(raw)
    reader = open_log(path)
    series = reader.read(WANTED)
    assert 300.0 not in series["/speed"].columns["data"]
    assert len(series["/speed"].receive_ns) == COUNT - 1
    assert [loss.messages for loss in reader.losses] == [1]


def test_verify_reads_chunks_that_nobody_wants(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat.LZ4)
    writer.chunk_threshold = 1
    writer.open()
    for name in ("/a", "/b"):
        connection = writer.add_connection(name, "std_msgs/msg/Float64", typestore=STORE)
        writer.write(connection, START, bytes(8))
    writer.close()
    raw = bytearray(path.read_bytes())
    frame = raw.rindex(struct.pack("<I", 0x184D2204))
    raw[frame : frame + 30] = b"\xff" * 30
    path.write_bytes(raw)
    reader = open_log(path)
    reader.read({"/a": ["data"]})
    assert reader.losses == ()
    reader.read({"/a": ["data"]}, verify=True)
    assert len(reader.losses) == 1


def test_lz4_as_ros_writes_it_without_a_content_size(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none")
    with AnyReader([path]) as reader:
        expected = [stamp for _, stamp, _ in reader.messages()]
    writer_compress = lambda data: lz4.frame.compress(data, store_size=False, block_size=5, block_linked=False)  # noqa: E731
    other = tmp_path / "b.bag"
    writer = Writer(other)
    writer.set_compression(Writer.CompressionFormat.LZ4)
    writer.compressor = writer_compress
    writer.open()
    with AnyReader([path]) as reader:
        for connection in reader.connections:
            writer.add_connection(connection.topic, connection.msgtype, typestore=STORE)
        for connection, stamp, data in reader.messages():
            writer.write(next(one for one in writer.connections if one.topic == connection.topic), stamp, data)
    writer.close()
    series = open_log(other).read(WANTED)
    assert sorted([*series["/speed"].receive_ns, *series["/force"].receive_ns]) == expected
    assert_rows_are_right(series)


def test_two_publishers_of_one_topic_are_one_series_in_file_order(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.open()
    pair = [
        writer.add_connection("/speed", "std_msgs/msg/Float64", typestore=STORE, callerid=name)
        for name in ("/n1", "/n2")
    ]
    for index in range(20):
        writer.write(pair[index % 2], START + index, struct.pack("<d", index))
    writer.close()
    reader = open_log(path)
    assert [(topic.name, topic.count) for topic in reader.topics] == [("/speed", 20)]
    assert reader.read({"/speed": ["data"]})["/speed"].columns["data"].tolist() == list(range(20))


def test_two_types_on_one_topic_are_listed_and_refused_when_wanted(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.open()
    for msgtype, data in (("std_msgs/msg/Float64", bytes(8)), ("std_msgs/msg/Float32", bytes(4))):
        writer.write(writer.add_connection("/speed", msgtype, typestore=STORE), START, data)
    writer.close()
    reader = open_log(path)
    assert reader.topics[0].count == 2
    assert "different" in reader.topics[0].note
    with pytest.raises(FerryIdError, match="different types or definitions"):
        reader.read({"/speed": ["data"]})


def test_types_of_the_log_need_no_installation(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("float32[3] rpm\nMode mode\n", "ferry_msgs/msg/Thrusters"))
    store.register(get_types_from_msg("uint8 level\nbool armed\n", "ferry_msgs/msg/Mode"))
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.open()
    connection = writer.add_connection("/thrusters", "ferry_msgs/msg/Thrusters", typestore=store)
    writer.write(connection, START, struct.pack("<3fB?", 1.0, 2.5, 3.0, 4, True))
    writer.close()
    reader = open_log(path)
    assert dict(reader.topics[0].fields) == {"rpm[3]": "float32", "mode.level": "uint8", "mode.armed": "bool"}
    columns = reader.read({"/thrusters": ["rpm[1]", "mode.armed"]})["/thrusters"].columns
    assert (columns["rpm[1]"].tolist(), columns["mode.armed"].tolist()) == ([2.5], [True])


def test_a_definition_that_fails_its_checksum_is_told(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none", count=3)
    path.write_bytes(path.read_bytes().replace(b"float64 data", b"float64 date"))
    reader = open_log(path)
    assert reader.read({"/speed": ["date"]})["/speed"].columns["date"].tolist() == [0.0, 1.0, 2.0]
    assert ["does not match its checksum" in loss.what for loss in reader.losses] == [True]


def test_a_definition_that_cannot_be_parsed_is_told_and_refused(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none", count=3)
    path.write_bytes(path.read_bytes().replace(b"float64 data", b"float64!data"))
    reader = open_log(path)
    assert ["cannot be read" in topic.note for topic in reader.topics] == [False, True]
    with pytest.raises(FerryIdError, match="no readable definition of std_msgs/msg/Float64"):
        reader.read({"/speed": ["data"]})
    assert len(reader.read({"/force": []})["/force"].receive_ns) == 2


def test_two_definitions_of_one_inner_type_stay_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.open()
    for name, inner, data in (("A", "uint8 level", b"\5"), ("B", "uint16 level\nuint8 extra", b"\6\1\0")):
        store = get_typestore(Stores.ROS1_NOETIC)
        store.register(get_types_from_msg("Mode mode\n", f"ferry_msgs/msg/{name}"))
        store.register(get_types_from_msg(inner + "\n", "ferry_msgs/msg/Mode"))
        writer.write(writer.add_connection(f"/{name}", f"ferry_msgs/msg/{name}", typestore=store), START, data)
    writer.close()
    series = open_log(path).read({"/A": ["mode.level"], "/B": ["mode.level"]})
    assert series["/A"].columns["mode.level"].tolist() == [5]
    assert series["/B"].columns["mode.level"].tolist() == [262]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"#ROSBAG V1.2\n" + bytes(100), "version 1.2"),
        (b"", "empty"),
        (b"PK\x03\x04 not a bag", "not a ROS1 bag"),
        (b"#ROSBAG V2.0\n", "no message can be recovered"),
        (b"#ROSBAG V2.0\n" + b"\xff" * 5000, "no message can be recovered"),
    ],
)
def test_what_is_no_bag_is_refused_in_one_line(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "a.bag"
    path.write_bytes(content)
    with pytest.raises(FerryIdError) as caught:
        open_log(path)
    message = str(caught.value)
    assert says in message
    assert message.startswith(str(path))
    assert "Fix: " in message
    assert "\n" not in message


@pytest.mark.slow
def test_any_cut_and_any_flipped_bytes_end_in_rows_or_one_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    path = write_bag(tmp_path / "a.bag", "lz4", count=60, chunk=1500)
    whole = path.read_bytes()
    for trial in range(60):
        raw = bytearray(whole)
        if trial % 2:
            raw = raw[: int(rng.integers(1, len(raw)))]
        for _ in range(int(rng.integers(0 if trial % 2 else 1, 6))):
            place = int(rng.integers(13, max(14, len(raw))))
            raw[place : place + 1] = rng.bytes(1)
        path.write_bytes(raw)
        try:
            reader = open_log(path)
            read = {topic.name: [] for topic in reader.topics if topic.fields}
            series = reader.read(read)
        except FerryIdError as error:
            refused = str(error)
        else:
            refused = ""
            assert sum(len(one.receive_ns) for one in series.values()) <= 90
        assert "\n" not in refused


REAL = ["ROS_example.bag", "tf_example.bag"]
FIXTURES = ["example.bag", "example-bz2.bag", "example-lz4.bag", "example-unsorted-chunks.bag", "no-messages.bag"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [f"conformance/MichaelGrupp+evo/test/data/{name}" for name in REAL]
    + [f"conformance/cruise-automation+rosbag.js/fixtures/{name}" for name in FIXTURES]
    + ["vtec_usv/edge/u_1_psi_ref_2021-08-16-15-07-44.bag"],
)
def test_published_bags_give_what_rosbags_gives(shared_data: Callable[[str], Path], name: str) -> None:
    path = shared_data(name)
    reader = open_log(path)
    numeric = {
        topic.name: [path for path, kind in topic.fields.items() if "[" not in path and kind != "string"][:12]
        for topic in reader.topics
    }
    series = reader.read(numeric)
    rows: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in series}
    with AnyReader([path]) as ordinary:
        for connection, stamp, data in ordinary.messages():
            rows[connection.topic].append((stamp, ordinary.deserialize(data, connection.msgtype)))
    for topic, one in series.items():
        order = np.argsort(one.receive_ns, kind="stable")
        times = one.receive_ns[order]
        assert times.tolist() == [stamp for stamp, _ in rows[topic]]
        unique = np.append(True, np.diff(times) > 0) & np.append(np.diff(times) > 0, True)
        for path_, column in one.columns.items():
            expected = []
            for _, message in rows[topic]:
                for part in path_.split("."):
                    message = getattr(message, part)
                expected.append(message)
            # Messages with one time have no order of their own.
            np.testing.assert_array_equal(column[order][unique], np.array(expected, column.dtype)[unique])
    assert reader.losses == ()
