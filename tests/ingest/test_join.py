"""Several files of one recording are one log; what is no log is one clear line."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log, supported_formats

STORE = get_typestore(Stores.ROS1_NOETIC)


def bag(path: Path, values: range, topics: tuple[str, ...] = ("/speed",), kind: str = "Float64") -> Path:
    """Write a bag whose message `value` is received at `value` seconds."""
    writer = Writer(path)
    writer.open()
    for topic in topics:
        connection = writer.add_connection(topic, f"std_msgs/msg/{kind}", typestore=STORE)
        for value in values:
            code = "<d" if kind == "Float64" else "<f"
            writer.write(connection, value * 1_000_000_000, struct.pack(code, value))
    writer.close()
    return path


def test_joined_parts_are_one_log_in_order_of_time(tmp_path: Path) -> None:
    later, earlier = bag(tmp_path / "a.bag", range(5, 9)), bag(tmp_path / "b.bag", range(1, 5), ("/speed", "/rpm"))
    reader = open_log(f"{later}+{earlier}")
    listed = {topic.name: (topic.count, topic.start_ns, topic.end_ns) for topic in reader.topics}
    assert listed == {"/speed": (8, 10**9, 8 * 10**9), "/rpm": (4, 10**9, 4 * 10**9)}
    assert reader.paths == (earlier, later)
    series = reader.read({"/speed": ["data"], "/rpm": ["data"]})
    assert series["/speed"].columns["data"].tolist() == list(range(1, 9))
    assert series["/rpm"].columns["data"].tolist() == [1, 2, 3, 4]


def test_a_folder_of_bags_is_one_log(tmp_path: Path) -> None:
    for index in range(3):
        bag(tmp_path / f"trial_{index}.bag", range(10 * index, 10 * index + 10))
    (tmp_path / "notes.txt").write_text("windy")
    assert len(open_log(tmp_path).read({"/speed": []})["/speed"].receive_ns) == 30


def test_a_folder_with_one_bag_is_that_bag(tmp_path: Path) -> None:
    path = bag(tmp_path / "only.bag", range(3))
    assert open_log(tmp_path).paths == (path,)


def test_a_plus_in_a_name_is_no_joint(tmp_path: Path) -> None:
    folder = tmp_path / "a+b"
    folder.mkdir()
    first, second = bag(folder / "x+y.bag", range(2)), bag(folder / "z.bag", range(2, 4))
    assert open_log(first).paths == (first,)
    assert open_log(f"{first}+{second}").paths == (first, second)


def test_losses_keep_the_name_of_their_part(tmp_path: Path) -> None:
    whole, cut = bag(tmp_path / "a.bag", range(500)), bag(tmp_path / "b.bag", range(500, 1000))
    cut.write_bytes(cut.read_bytes()[:20_000])
    reader = open_log(f"{whole}+{cut}")
    assert {loss.file for loss in reader.losses} == {str(cut)}
    rows = len(reader.read({"/speed": ["data"]})["/speed"].receive_ns)
    assert 500 < rows < 1000


def test_losses_found_in_reading_are_told_too(tmp_path: Path) -> None:
    whole, damaged = bag(tmp_path / "a.bag", range(50)), bag(tmp_path / "b.bag", range(50, 100))
    raw = bytearray(damaged.read_bytes())
    record = raw.index(struct.pack("<d", 70.0)) - 30
    raw[record : record + 8] = b"\xff" * 8
    damaged.write_bytes(raw)
    reader = open_log(f"{whole}+{damaged}")
    assert reader.losses == ()
    assert len(reader.read({"/speed": ["data"]})["/speed"].receive_ns) == 99
    assert [(loss.file, loss.messages) for loss in reader.losses] == [(str(damaged), 1)]


def test_a_topic_with_another_type_in_another_part_is_refused(tmp_path: Path) -> None:
    parts = bag(tmp_path / "a.bag", range(3), ("/speed", "/rpm")), bag(tmp_path / "b.bag", range(3, 6), kind="Float32")
    reader = open_log(f"{parts[0]}+{parts[1]}")
    assert "another part has std_msgs/msg/Float32" in reader.topics[1].note
    assert len(reader.read({"/rpm": []})["/rpm"].receive_ns) == 3
    with pytest.raises(FerryIdError, match="cannot be read as one"):
        reader.read({"/speed": ["data"]})
    with pytest.raises(FerryIdError, match='Did you mean "/speed"'):
        reader.read({"/sped": ["data"]})


def refusal(path: Path | str) -> str:
    with pytest.raises(FerryIdError) as caught:
        open_log(path)
    line = str(caught.value)
    assert line.startswith(str(path))
    assert "\n" not in line
    assert "Fix: " in line
    return line


def test_what_is_no_log_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\xff\xe0" + bytes(100))
    (tmp_path / "folder").mkdir()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "readme.md").write_text("nothing")
    assert "no such file" in refusal(tmp_path / "missing.bag")
    assert "empty" in refusal(tmp_path / "empty.mcap")
    assert "ROS1 bag" in refusal(tmp_path / "photo.jpg")
    assert "found nothing" in refusal(tmp_path / "folder")
    assert "readme.md" in refusal(tmp_path / "other")
    bag(tmp_path / "a.bag", range(2))
    assert f"lacks {tmp_path / 'b.bag'}" in refusal(f"{tmp_path / 'a.bag'}+{tmp_path / 'b.bag'}")
    assert "lacks a name beside a +" in refusal("+")
    assert "lacks a name beside a +" in refusal(f"{tmp_path / 'a.bag'}+")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_refused_in_one_line(tmp_path: Path) -> None:
    path = bag(tmp_path / "a.bag", range(2))
    path.chmod(0)
    assert "permission" in refusal(path)


def test_formats_are_found_by_being_there() -> None:
    names = [entry.name for entry in supported_formats()]
    assert "ROS1 bag (.bag)" in names
    assert [entry.order for entry in supported_formats()] == sorted(entry.order for entry in supported_formats())
