"""One conformance test for every log format.

A format is covered by one file, ``samples/<module of the format>.py``, with ``write(folder, messages, ros) -> Path``: it
writes the messages that its format can carry and returns the log's path. `ros` serialises ROS messages. Optional there:
``RENAMED`` (name of a topic in the log, None for a topic that the format leaves out) and ``CUT_SHOWS = False`` for a
format whose file can end anywhere without a trace.
"""

from __future__ import annotations

import importlib.util
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import formats, open_log
from ferryid.ingest.log import Loss, Series

FORMATS = sorted(module.name for module in pkgutil.iter_modules(formats.__path__))
SAMPLES = Path(__file__).parent / "samples"
NS = 1_000_000_000
START = 1_600_000_000 * NS
FIELDS = {"/position": ("point.x", "point.y", "point.z"), "/speed": ("data",)}


class Message(NamedTuple):
    """One message, whatever the format: receive time and stamp [ns], and its values by field path."""

    topic: str
    msgtype: str
    receive_ns: int
    stamp_ns: int | None
    values: dict[str, float]


class Ros:
    """Serialises messages the way rosbags does; its stores compile code, once for all tests."""

    ros1, ros2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)

    def serialised(self, message: Message, encoding: str) -> bytes:
        store = self.ros1 if encoding == "ros1" else self.ros2
        types = store.types
        made: Any
        if message.stamp_ns is None:
            made = types[message.msgtype](message.values["data"])
        else:
            stamp = types["builtin_interfaces/msg/Time"](message.stamp_ns // NS, message.stamp_ns % NS)
            sequence = (7,) if encoding == "ros1" else ()
            header = types["std_msgs/msg/Header"](*sequence, stamp, "map")
            made = types[message.msgtype](header, types["geometry_msgs/msg/Point"](*message.values.values()))
        write = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
        return bytes(write(made, message.msgtype))


def messages() -> list[Message]:
    """300 stamped positions at 50 Hz and 600 speeds without a header at 100 Hz, in order of receive time."""
    made = []
    for index in range(600):
        time = START + index * NS // 100
        made.append(Message("/speed", "std_msgs/msg/Float64", time, None, {"data": index * 0.25}))
        if index % 2 == 0:
            values = {"point.x": index * 1.5, "point.y": -1.0 / (index + 1), "point.z": 0.0}
            made.append(Message("/position", "geometry_msgs/msg/PointStamped", time + 1000, time - 5000, values))
    return made


def sample(name: str) -> ModuleType:
    path = SAMPLES / f"{name}.py"
    if not path.exists():
        pytest.fail(f"the format {name} has no sample: add tests/ingest/samples/{name}.py")
    spec = importlib.util.spec_from_file_location(f"sample_{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Written(NamedTuple):
    """A log written by a sample: its path, and the messages it holds by the topic names of the log."""

    path: Path
    topics: dict[str, list[Message]]
    wanted: dict[str, tuple[str, ...]]
    module: ModuleType


@pytest.fixture(params=FORMATS)
def log(request: pytest.FixtureRequest, tmp_path: Path) -> Written:
    module = sample(request.param)
    made = messages()
    renamed = getattr(module, "RENAMED", {})
    topics = {renamed.get(name, name): [one for one in made if one.topic == name] for name in FIELDS}
    wanted = {renamed.get(name, name): fields for name, fields in FIELDS.items()}
    topics.pop(None, None)
    wanted.pop(None, None)
    return Written(module.write(tmp_path, made, Ros()), topics, wanted, module)


def test_topics_are_listed_before_anything_is_read(log: Written) -> None:
    reader = open_log(log.path)
    assert reader.losses == ()
    listed = {topic.name: topic for topic in reader.topics}
    assert listed.keys() == log.topics.keys()
    for name, made in log.topics.items():
        topic = listed[name]
        assert topic.count == len(made)
        assert topic.start_ns is not None
        assert topic.end_ns is not None
        # Tables list the ends as they show them, in double precision; the rows themselves are exact.
        assert abs(topic.start_ns - made[0].receive_ns) <= 256
        assert abs(topic.end_ns - made[-1].receive_ns) <= 256
        assert set(log.wanted[name]) <= set(topic.fields)
    assert all(path.exists() for path in reader.paths)


@pytest.mark.parametrize("verify", [False, True])
def test_what_was_written_is_read(log: Written, verify: bool) -> None:
    reader = open_log(log.path)
    series = reader.read(log.wanted, verify=verify)
    assert series.keys() == log.wanted.keys()
    for name, made in log.topics.items():
        one = series[name]
        assert one.topic == name
        assert one.receive_ns.dtype == np.int64
        assert one.receive_ns.tolist() == [message.receive_ns for message in made]
        if made[0].stamp_ns is None:
            assert one.stamp_ns is None
        else:
            assert one.stamp_ns is not None
            assert one.stamp_ns.tolist() == [message.stamp_ns for message in made]
        assert tuple(one.columns) == log.wanted[name]
        for field, column in one.columns.items():
            assert column.tolist() == [message.values[field] for message in made]
    assert reader.losses == ()


def test_only_what_is_wanted_is_read(log: Written) -> None:
    name = next(iter(log.wanted))
    series = open_log(log.path).read({name: ()})
    assert series.keys() == {name}
    assert dict(series[name].columns) == {}
    assert len(series[name].receive_ns) == len(log.topics[name])


def test_a_reader_reads_twice(log: Written) -> None:
    reader = open_log(log.path)
    first, second = reader.read(log.wanted), reader.read(log.wanted)
    for name, one in first.items():
        np.testing.assert_array_equal(one.receive_ns, second[name].receive_ns)


def test_misspelt_names_are_one_line_with_the_nearest(log: Written) -> None:
    name, fields = next(iter(log.wanted.items()))
    for wanted, nearest in (({name + "s": fields}, name), ({name: (fields[0] + "x",)}, fields[0])):
        with pytest.raises(FerryIdError) as caught:
            open_log(log.path).read(wanted)
        line = str(caught.value)
        assert "\n" not in line
        assert str(log.path) in line or any(str(part) in line for part in open_log(log.path).paths)
        assert f'Did you mean "{nearest}"?' in line
        assert "Fix: " in line


@pytest.mark.parametrize("kept", [0.0, 0.01, 0.3, 0.7, 0.99])
def test_a_cut_file_gives_its_intact_rows_and_says_so_or_one_line(log: Written, kept: float) -> None:
    cut = log.path if log.path.is_file() else max(log.path.iterdir(), key=lambda file: file.stat().st_size)
    whole = cut.read_bytes()
    cut.write_bytes(whole[: int(kept * len(whole))])
    try:
        reader = open_log(log.path)
        listed = {topic.name for topic in reader.topics if topic.fields}
        series = reader.read({name: fields for name, fields in log.wanted.items() if name in listed})
    except FerryIdError as error:
        refusal = str(error)
    else:
        refusal = ""
        assert_intact(log, series, reader.losses)
    assert "\n" not in refusal
    assert ("Fix: " in refusal) == bool(refusal)


def assert_intact(log: Written, series: dict[str, Series], losses: tuple[Loss, ...]) -> None:
    """Every row is one that was written, and where rows are absent a loss says so."""
    complete = True
    for name, made in log.topics.items():
        if name not in series:
            complete = False
            continue
        expected = {message.receive_ns: message for message in made}
        one = series[name]
        complete = complete and len(one.receive_ns) == len(made)
        whole_rows = one.receive_ns[: None if getattr(log.module, "CUT_SHOWS", True) else -1].tolist()
        assert set(whole_rows) <= expected.keys()
        for field, column in one.columns.items():
            assert [expected[time].values[field] for time in whole_rows] == column[: len(whole_rows)].tolist()
    assert complete or losses or not getattr(log.module, "CUT_SHOWS", True)
