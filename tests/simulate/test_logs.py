"""Logs of a simulated trial, read back with other people's readers."""

from __future__ import annotations

import hashlib
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from ferryid.errors import FerryIdError
from ferryid.simulate import load_scenario, render_simulation, run_scenario, scenario_listing, simulate, write_log
from ferryid.simulate.messages import CUSTOM, serialised, typestore

FIXTURES = Path(__file__).parents[2] / "fixtures"
LOGS = {"t.mcap": {}, "t.bag": {}, "t_sqlite": {}, "t_mcap": {"storage": "mcap"}}


@pytest.fixture(scope="module")
def trial():
    return simulate(replace(load_scenario("twelve-corner-wind"), duration_s=12.0))


def leaf(message, path):
    for name in path.split("."):
        message = getattr(message, name)
    return message


def messages(path):
    """Yield (topic, type, receive time, message) of any of the four logs."""
    if path.suffix == ".mcap":
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for schema, channel, record, message in reader.iter_decoded_messages():
                yield channel.topic, schema.name, record.log_time, message
        return
    with AnyReader([path]) as reader:
        for connection, when, raw in reader.messages():
            yield connection.topic, connection.msgtype, when, reader.deserialize(raw, connection.msgtype)


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_every_format_holds_every_message(trial, tmp_path, name):
    write_log(trial, tmp_path / name, **LOGS[name])
    found: dict[str, list] = {}
    times = []
    for topic, kind, when, message in messages(tmp_path / name):
        found.setdefault(topic, []).append((kind, when, message))
        times.append(when)
    assert times == sorted(times)
    assert set(found) == {stream.topic for stream in trial.streams}
    for stream in trial.streams:
        rows = found[stream.topic]
        assert {kind for kind, _, _ in rows} == {stream.type}
        np.testing.assert_array_equal([when for _, when, _ in rows], stream.receive_ns)
        stamps = [m.header.stamp.sec * 10**9 + getattr(m.header.stamp, "nanosec", 0) for _, _, m in rows]
        np.testing.assert_array_equal(stamps, stream.stamp_ns)
        assert {m.header.frame_id for _, _, m in rows} == {stream.frame_id}
        for path, values in stream.columns.items():
            np.testing.assert_array_equal([leaf(m, path) for _, _, m in rows], values)
        for path, value in stream.constants.items():
            np.testing.assert_array_equal(leaf(rows[0][2], path), value)
        if stream.blobs:
            assert tuple(bytes(m.data) for _, _, m in rows) == stream.blobs


def test_topics_are_those_of_the_bundled_profile(trial):
    topics = {stream.topic for stream in trial.streams}
    asked = {signal.topic for signal in trial.profile.signals} - {
        *("/weather/current", "/payload/waterline", "/control/reference")
    }
    assert topics == {*asked, "/imu/data", "/camera/image/compressed"}
    sensors = replace(
        trial.scenario.sensors,
        current_rate_hz=2.0,
        payload_rate_hz=2.0,
        reference_rate_hz=2.0,
        imu_rate_hz=0.0,
        camera_rate_hz=0.0,
    )
    more = simulate(replace(trial.scenario, duration_s=2.0, sensors=sensors))
    assert {stream.topic for stream in more.streams} == {signal.topic for signal in trial.profile.signals}


@pytest.mark.parametrize("ros_version", [1, 2])
def test_messages_are_those_of_the_ordinary_serialiser_byte_for_byte(trial, ros_version):
    store = typestore(ros_version)
    read = store.deserialize_ros1 if ros_version == 1 else store.deserialize_cdr
    write = store.serialize_ros1 if ros_version == 1 else store.serialize_cdr
    odd = replace(trial.streams[0], frame_id="a", constants={**trial.streams[0].constants, "child_frame_id": "längs"})
    for stream in (*trial.streams, odd, replace(odd, frame_id="")):
        for row, raw in enumerate(serialised(stream, ros_version)):
            message = read(raw, stream.type)
            assert bytes(write(message, stream.type)) == raw
            assert message.header.frame_id == stream.frame_id
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stream.stamp_ns[row]
            for path, values in stream.columns.items():
                assert leaf(message, path) == values[row]
            if ros_version == 1:
                assert message.header.seq == row


def test_custom_definitions_travel_in_the_log(trial, tmp_path):
    write_log(trial, tmp_path / "t.mcap")
    with (tmp_path / "t.mcap").open("rb") as file:
        schemas = {s.name: s.data.decode() for s in make_reader(file).get_summary().schemas.values()}
    assert {"ferry_msgs/msg/ThrusterState", "ferry_msgs/msg/Wind"} == set(CUSTOM) & set(schemas)
    assert "float64 azimuth" in schemas["ferry_msgs/msg/ThrusterState"]
    assert "MSG: std_msgs/Header" in schemas["ferry_msgs/msg/ThrusterState"]


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_same_seed_same_bytes(trial, tmp_path, name):
    again = simulate(trial.scenario)
    hashes = []
    for folder, simulation in (("a", trial), ("b", again)):
        write_log(simulation, tmp_path / folder / name, **LOGS[name])
        files = [p for p in sorted((tmp_path / folder).rglob("*")) if p.is_file()]
        hashes.append({str(p.relative_to(tmp_path / folder)): hashlib.sha256(p.read_bytes()).digest() for p in files})
    assert hashes[0] == hashes[1]
    assert len(hashes[0]) >= 1


@pytest.mark.slow
def test_messages_stand_in_the_order_of_their_receipt(trial, tmp_path):
    write_log(trial, tmp_path / "t.mcap")
    with (tmp_path / "t.mcap").open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)
    write_log(trial, tmp_path / "t")
    with sqlite3.connect(tmp_path / "t" / "t.db3") as database:
        times = [when for (when,) in database.execute("SELECT timestamp FROM messages ORDER BY id")]
    database.close()
    assert times == sorted(times)


def test_folder_and_storage_carry_the_name_asked_for(trial, tmp_path):
    write_log(trial, tmp_path / "sea_trial")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["metadata.yaml", "sea_trial", "sea_trial.db3"]


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_existing_output_is_refused_unless_asked(trial, tmp_path, name):
    out = tmp_path / name
    write_log(trial, out, **LOGS[name])
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FerryIdError, match=r"exists already.*--overwrite"):
        write_log(trial, out, **LOGS[name])
    write_log(trial, out, overwrite=True, **LOGS[name])
    assert sorted(tmp_path.rglob("*")) == before


def test_what_is_not_a_recording_is_never_replaced(trial, tmp_path):
    (tmp_path / "papers").mkdir()
    (tmp_path / "papers" / "thesis.txt").write_text("keep me")
    with pytest.raises(FerryIdError, match="no ROS2 recording"):
        write_log(trial, tmp_path / "papers", overwrite=True)
    (tmp_path / "note").write_text("keep me")
    with pytest.raises(FerryIdError, match="found a file"):
        write_log(trial, tmp_path / "note", overwrite=True)
    assert (tmp_path / "papers" / "thesis.txt").read_text() == (tmp_path / "note").read_text() == "keep me"


def test_bad_names_and_places(trial, tmp_path):
    with pytest.raises(FerryIdError, match=r'found "\.csv"'):
        write_log(trial, tmp_path / "t.csv")
    with pytest.raises(FerryIdError, match='Did you mean "sqlite3"'):
        write_log(trial, tmp_path / "t", storage="sqlite")
    (tmp_path / "file").write_text("")
    for name in ("t.mcap", "t.bag", "t"):
        with pytest.raises(FerryIdError, match="cannot be written"):
            write_log(trial, tmp_path / "file" / name)
    with pytest.raises(FerryIdError, match="cannot be the same file"):
        write_log(trial, tmp_path / "t.mcap", tmp_path / "t.mcap")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("name", LOGS)
def test_an_interrupt_leaves_nothing_behind(trial, tmp_path, name):
    class Interrupting:
        """Columns that can be asked for their first rows only."""

        def __getitem__(self, rows):
            raise KeyboardInterrupt

    last = replace(trial.streams[0], columns={"pose.pose.position.x": Interrupting()})
    broken = replace(trial, streams=(*trial.streams[1:], last))
    with pytest.raises(KeyboardInterrupt):
        write_log(broken, tmp_path / name, **LOGS[name])
    assert list(tmp_path.iterdir()) == []


def test_truth_is_a_file_of_its_own_and_only_when_asked(trial, tmp_path):
    write_log(trial, tmp_path / "a.mcap")
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]
    write_log(trial, tmp_path / "b.mcap", tmp_path / "truth.parquet")
    table = pq.read_table(tmp_path / "truth.parquet")
    np.testing.assert_array_equal(table["psi"].to_numpy(), trial.truth.eta[:, 2])
    np.testing.assert_array_equal(table["alpha_thruster2"].to_numpy(), trial.truth.angles[:, 1])
    assert table.schema.metadata[b"seed"] == b"13"
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_run_scenario_says_what_it_wrote(tmp_path):
    scenario = (FIXTURES / "short.toml").read_text().replace("duration_s = 90", "duration_s = 10")
    (tmp_path / "mine.toml").write_text(scenario)
    result = run_scenario(str(tmp_path / "mine.toml"), tmp_path, seed=3, progress=print)
    assert result["log"] == str(tmp_path / "mine.mcap")
    assert (tmp_path / "mine.mcap").is_file()
    assert result["schema"] == "ferryid.simulate/1"
    assert (result["scenario"], result["seed"], result["duration_s"]) == ("mine", 3, 10.0)
    assert result["topics"]["/navigation/odometry"] == 100
    text = render_simulation(result)
    assert "/weather/wind" in text
    assert "10 s of milliampere, seed 3" in text
    assert "twelve-corner-wind" in {one["name"] for one in scenario_listing()["scenarios"]}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["short.mcap", "short.bag"])
def test_fixtures_are_what_the_simulator_writes(name):
    simulation = simulate(load_scenario(FIXTURES / "short.toml"))
    found: dict[str, list] = {}
    for topic, _, when, message in messages(FIXTURES / name):
        found.setdefault(topic, []).append((when, message))
    for stream in simulation.streams:
        np.testing.assert_array_equal([when for when, _ in found[stream.topic]], stream.receive_ns)
        for path, values in stream.columns.items():
            np.testing.assert_allclose([leaf(m, path) for _, m in found[stream.topic]], values, rtol=1e-6, atol=1e-6)


def test_fixtures_are_small():
    assert sum(p.stat().st_size for p in FIXTURES.rglob("*") if p.is_file() and p.suffix != ".pyc") < 2.4e6
