"""ULog: against pyulog, and what files of a vehicle hold that a sample does not."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.parameters import parameters_of
from tests.ingest.autopilot_logs import (
    MAGIC,
    SYNC,
    ulog,
    ulog_definition,
    ulog_header,
    ulog_message,
)

N = 50
T = np.arange(N, dtype=np.uint64) * 20_000 + 5_000_000
RNG = np.random.default_rng(3)
TOPICS = {
    "vehicle_attitude": {
        "timestamp": T,
        "timestamp_sample": T - 800,
        "q": RNG.normal(size=(N, 4)).astype(np.float32),
        "quat_reset_counter": np.arange(N, dtype=np.uint8),
    },
    "actuator_outputs": {
        "timestamp": T + 7,
        "noutputs": np.full(N, 4, np.uint32),
        "output": RNG.normal(size=(N, 16)).astype("f4"),
    },
    "vehicle_gps_position": {
        "timestamp": T + 9,
        "time_utc_usec": np.r_[np.zeros(5, np.uint64), (T + 9 + 1_700_000_000_000_000)[5:]],
        "lat": (RNG.normal(size=N) * 1e6).astype(np.int32),
    },
}  # fmt: skip


def written(folder: Path, content: bytes, name: str = "log.ulg") -> Path:
    (folder / name).write_bytes(content)
    return folder / name


def test_every_value_is_the_one_that_pyulog_reads(tmp_path: Path) -> None:
    path = written(tmp_path, ulog(TOPICS))
    reader = open_log(path)
    listed = {topic.name: topic for topic in reader.topics}
    theirs = {f"/{data.name}": data.data for data in ULog(str(path)).data_list}
    assert listed.keys() == theirs.keys()
    for name, topic in listed.items():
        series = reader.read({name: list(topic.fields)})[name]
        times = {"timestamp", "timestamp_sample"} & theirs[name].keys()
        assert set(topic.fields) == theirs[name].keys() - times
        for field, column in series.columns.items():
            np.testing.assert_array_equal(column, theirs[name][field])
            assert column.dtype == theirs[name][field].dtype
        offset = 1_700_000_000_000_000
        np.testing.assert_array_equal(series.receive_ns // 1000 - offset, theirs[name]["timestamp"])
    assert "in UTC" in listed["/vehicle_attitude"].note


def test_the_time_of_the_sample_is_the_stamp_where_every_message_has_it(tmp_path: Path) -> None:
    series = open_log(written(tmp_path, ulog(TOPICS))).read({"/vehicle_attitude": ["q[0]"]})["/vehicle_attitude"]
    assert series.stamp_ns is not None
    assert set((series.receive_ns - series.stamp_ns).tolist()) == {800_000}
    some = {"vehicle_attitude": {**TOPICS["vehicle_attitude"], "timestamp_sample": np.where(np.arange(N) > 3, T, 0)}}
    log = open_log(written(tmp_path, ulog(some), "other.ulg"))
    assert log.read({"/vehicle_attitude": []})["/vehicle_attitude"].stamp_ns is None
    assert "no receiver knew UTC" in log.topics[0].note


def test_a_second_instance_is_a_topic_with_its_number(tmp_path: Path) -> None:
    path = written(tmp_path, ulog(TOPICS, instances={"actuator_outputs": 1}))
    assert "/actuator_outputs[1]" in {topic.name for topic in open_log(path).topics}


def test_messages_in_messages_texts_and_padding(tmp_path: Path) -> None:
    content = ulog_header()
    content += ulog_definition("gear:float[2] rpm;uint8_t on;uint8_t[3] _padding0")
    content += ulog_definition("boat:uint64_t timestamp;gear[2] gears;char[8] mode;uint8_t[7] _padding0")
    content += ulog_message("A", struct.pack("<BH", 0, 4) + b"boat")
    row = struct.pack("<QffB3xffB3x8s", 1_000, 1.5, 2.5, 1, 3.5, 4.5, 0, b"auto\0\0\0\0")
    content += ulog_message("D", struct.pack("<H", 4) + row)  # the padding at the end is not written
    content += ulog_message("D", struct.pack("<H", 4) + row + bytes(7))
    reader = open_log(written(tmp_path, content))
    (topic,) = reader.topics
    wanted = {"gears[0].rpm[1]": 2.5, "gears[1].rpm[0]": 3.5, "gears[1].on": 0, "mode": "auto"}
    assert set(topic.fields) == {f"gears[{k}].{one}" for k in (0, 1) for one in ("rpm[0]", "rpm[1]", "on")} | {"mode"}
    series = reader.read({"/boat": list(wanted)})["/boat"]
    assert {name: column.tolist() for name, column in series.columns.items()} == {k: [v, v] for k, v in wanted.items()}
    assert reader.losses == ()


def test_a_damaged_stretch_is_left_out_and_what_follows_is_read(tmp_path: Path) -> None:
    content = bytearray(ulog(TOPICS))
    middle = len(content) // 2
    content[middle : middle + 300] = bytes(300)
    reader = open_log(written(tmp_path, bytes(content)))
    counts = {topic.name: topic.count for topic in reader.topics}
    assert all(N - 8 <= count <= N for count in counts.values())
    assert sum(counts.values()) < 3 * N
    (loss,) = reader.losses
    assert "damaged stretch" in loss.what
    # Why there is a reader of our own: docs/formats.md.
    theirs = {f"/{one.name}": len(one.data["timestamp"]) for one in ULog(str(reader.paths[0])).data_list}
    assert theirs["/vehicle_attitude"] < N / 2 < counts["/vehicle_attitude"]
    whole = open_log(written(tmp_path, ulog(TOPICS), "whole.ulg")).read({"/vehicle_attitude": ["q[2]"]})[
        "/vehicle_attitude"
    ]
    known = dict(zip(whole.receive_ns.tolist(), whole.columns["q[2]"].tolist(), strict=True))
    found = reader.read({"/vehicle_attitude": ["q[2]"]})["/vehicle_attitude"]
    assert [known[time] for time in found.receive_ns.tolist()] == found.columns["q[2]"].tolist()


def test_data_appended_after_a_crash_is_read(tmp_path: Path) -> None:
    whole = ulog({"vehicle_attitude": TOPICS["vehicle_attitude"]})
    size = 3 + 2 + 8 + 8 + 16 + 1
    keep, cut = whole[: -10 * size], whole[-10 * size : -9 * size - 5]
    head = len(ulog_header())
    content = ulog_header(incompatible=1, appended=len(keep) + len(cut)) + (keep + cut + whole[-9 * size :])[head:]
    path = written(tmp_path, content)
    reader = open_log(path)
    times = reader.read({"/vehicle_attitude": []})["/vehicle_attitude"].receive_ns
    assert times.tolist() == (np.delete(T, N - 10).astype(np.int64) * 1000).tolist()
    assert reader.losses == ()


def test_dropouts_and_marks_between_the_messages(tmp_path: Path) -> None:
    content = ulog(TOPICS) + ulog_message("S", SYNC) + ulog_message("L", b"6" + bytes(8) + b"armed")
    content += ulog_message("O", struct.pack("<H", 250)) + ulog_message("I", b"\x09char[2] ab" + b"xy")
    (loss,) = open_log(written(tmp_path, content)).losses
    assert "could not write for 0.25 s" in loss.what


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (MAGIC + b"\x01", "ends within its first 16 bytes"),
        (ulog_header(), "holds no data"),
        (ulog_header(incompatible=2), "of a kind that is not known here"),
        (ulog({"orders": {"value": np.zeros(3, np.float32), "timestamp": np.zeros(3, np.float32)}}), "holds no data"),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path: Path, content: bytes, found: str) -> None:
    with pytest.raises(FerryIdError, match=found) as caught:
        open_log(written(tmp_path, content))
    assert "Fix: " in str(caught.value)


def test_it_is_known_by_its_content_whatever_its_name(tmp_path: Path) -> None:
    assert len(open_log(written(tmp_path, ulog(TOPICS), "log.csv")).topics) == 3
    with pytest.raises(FerryIdError, match="not a log of a supported format"):
        open_log(written(tmp_path, b"PK\x03\x04 something else", "log.ulg"))


def test_parameters_have_the_time_of_the_data_before_them(tmp_path: Path) -> None:
    stated = {"CA_ROTOR_COUNT": 2, "CA_ROTOR0_PX": -1.25}
    log = ulog(TOPICS, parameters=stated, changed=((int(T[20]) + 10, "CA_ROTOR0_PX", -1.5),))
    path = tmp_path / "a.ulg"
    path.write_bytes(log)
    reader = open_log(path)
    found = parameters_of(reader)
    assert {name: one.values.tolist() for name, one in found.items()} == {
        "CA_ROTOR_COUNT": [2.0],
        "CA_ROTOR0_PX": [-1.25, -1.5],
    }
    times = reader.read({"/vehicle_gps_position": ()})["/vehicle_gps_position"].receive_ns
    start = min(topic.start_ns for topic in reader.topics if topic.start_ns is not None)
    assert found["CA_ROTOR0_PX"].time_ns.tolist() == [start, int(times[20])]
    expected = ULog(str(path))
    assert {name: one.values[0] for name, one in found.items()} == expected.initial_parameters
    assert not parameters_of(open_log(Path("fixtures/short.mcap")))
