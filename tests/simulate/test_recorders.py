"""What a log looks like to other people's readers besides its messages: like one of an ordinary recorder."""

from __future__ import annotations

import sqlite3
from dataclasses import replace

import lz4.frame
import numpy as np
import pyarrow.parquet as pq
import pytest
import zstandard
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML

from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.simulate.messages import CUSTOM
from ferryid.simulate.sections import Payload, Waves

LOGS = {"t.mcap": {}, "t.bag": {}, "t_sqlite": {}, "t_mcap": {"storage": "mcap"}}
STANDARD = ("nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu")


@pytest.fixture(scope="module")
def trial():
    scenario = load_scenario("twelve-corner-wind")
    scenario = replace(
        scenario,
        duration_s=8.0,
        waves=Waves(significant_height_m=0.2),
        payload=(Payload(300.0, 0.5, 4.0),),
        sensors=replace(scenario.sensors, current_rate_hz=2.0, payload_rate_hz=2.0, reference_rate_hz=2.0),
    )
    return simulate(scenario)


@pytest.fixture(scope="module")
def logs(trial, tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for name, keys in LOGS.items():
        write_log(trial, folder / name, folder / f"truth_{name}", **keys)
    return folder


def contents(path):
    """Return all bytes of a log, and those of its compressed chunks as well."""
    files = [file for file in (path.rglob("*") if path.is_dir() else [path]) if file.is_file()]
    raw = b"".join(file.read_bytes() for file in files)
    for magic, expand in (
        (b"\x28\xb5\x2f\xfd", lambda data: zstandard.ZstdDecompressor().decompressobj().decompress(data)),
        (b"\x04\x22\x4d\x18", lambda data: lz4.frame.LZ4FrameDecompressor().decompress(data)),
    ):
        start = raw.find(magic)
        chunks = []
        while start >= 0:
            chunks.append(expand(raw[start:]))
            start = raw.find(magic, start + 4)
        raw += b"".join(chunks)
    return raw


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_nothing_in_a_log_names_its_maker(logs, name):
    raw = contents(logs / name).lower()
    assert b"float64 azimuth" in raw
    for word in (b"ferryid", b"rosbags", b"simulat", b"twelve-corner", b"python"):
        assert word not in raw


def test_mcap_names_no_library(logs):
    for path in (logs / "t.mcap", logs / "t_mcap" / "t_mcap.mcap"):
        with path.open("rb") as file:
            header = make_reader(file, validate_crcs=True).get_header()
        assert (header.profile, header.library) == ("ros2", "")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["t_sqlite", "t_mcap"])
def test_ros2_metadata_is_that_of_the_release_whose_version_it_has(logs, name):
    # Version 9 is that of Jazzy, the first with quality of service as a list.
    stated = YAML(typ="safe").load((logs / name / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (stated["version"], stated["ros_distro"]) == (9, "jazzy")
    with Ros2Reader(logs / name) as reader:
        for connection in reader.connections:
            (offered,) = connection.ext.offered_qos_profiles
            fast = connection.topic.startswith(("/imu", "/camera"))
            assert offered.reliability is (QosReliability.BEST_EFFORT if fast else QosReliability.RELIABLE)
            assert offered.durability is QosDurability.VOLATILE
            assert offered.deadline == offered.lifespan == (9223372036, 854775807)


def test_the_database_says_the_same(logs):
    with sqlite3.connect(logs / "t_sqlite" / "t_sqlite.db3") as database:
        assert database.execute("SELECT schema_version, ros_distro FROM schema").fetchall() == [(4, "jazzy")]
        ((text,),) = database.execute("SELECT metadata FROM metadata").fetchall()
        profiles = [row[0] for row in database.execute("SELECT offered_qos_profiles FROM topics")]
    database.close()
    assert YAML(typ="safe").load(text)["ros_distro"] == "jazzy"
    assert all("reliability" in profile for profile in profiles)


def test_ros1_connections_have_a_node_and_do_not_latch(logs):
    with Ros1Reader(logs / "t.bag") as reader:
        nodes = {connection.topic: connection.ext for connection in reader.connections}
    assert {ext.latching for ext in nodes.values()} == {0}
    assert nodes["/navigation/odometry"].callerid == "/navigation"
    assert nodes["/thruster2/state"].callerid == "/thruster2"
    assert nodes["/thruster2/command"].callerid == nodes["/control/tau_d"].callerid == "/control"


@pytest.mark.parametrize("name", LOGS)
def test_definitions_tell_units_and_hash_as_without(logs, name):
    """Comments stand in what the log holds; digests are those of the bare fields, registered anew."""
    with AnyReader([logs / name]) as reader:
        found = {c.msgtype: (c.msgdef.data, c.digest) for c in reader.connections}
    assert {*CUSTOM, *STANDARD} < set(found)
    ros1 = name == "t.bag"
    bare = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for kind, text in CUSTOM.items():
        data, digest = found[kind]
        assert "# rpm" in data or "# m/s" in data or "# kg" in data
        assert "MSG: std_msgs/Header" in data
        fields = "\n".join(line.split("#")[0].strip() for line in text.splitlines())
        bare.register(get_types_from_msg(fields, kind))
        if name in ("t.bag", "t_sqlite"):
            assert digest == (bare.generate_msgdef(kind)[1] if ros1 else bare.hash_rihs01(kind))
        # Another reader makes the same fields of the text.
        assert get_types_from_msg(data.split("=" * 80)[0], kind) == get_types_from_msg(fields, kind)


def test_truth_holds_payload_waves_and_attitude(trial, logs):
    table = pq.read_table(logs / "truth_t.mcap")
    truth = trial.truth
    assert np.abs(truth.wave).max() > 10.0
    for names, values in (
        (("wave_X", "wave_Y", "wave_N"), truth.wave),
        (("roll", "pitch"), truth.attitude),
        (("payload_mass", "payload_x"), truth.payload),
    ):
        for name, column in zip(names, values.T, strict=True):
            np.testing.assert_array_equal(table[name].to_numpy(), column)
            assert np.ptp(column) > 0.0
