"""Signals that are shares of full power, pulses, entries of arrays with names, angles of a receiver, and forces of a rudder."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Series, Topic
from ferryid.vessel import convert, parse_profile, select
from ferryid.vessel.profile import Profile
from ferryid.vessel.pulses import pulse_of_share, share_of_pulse
from tests.vessel.conftest import STERN_BOAT

THRUST = 'thrust = { kind = "quadratic", ahead = 0.01 }'


def boat(signals: str, kind: str = "propeller", more: str = THRUST) -> Profile:
    return parse_profile(STERN_BOAT.format(kind=kind, more=more) + signals, "boat.toml")


def signal(role: str, *lines: str) -> str:
    return "\n".join([f'[signals."stern.{role}"]', 'topic = "/out"', *lines, ""])


def one(**columns: object) -> Series:
    arrays = {path: np.asarray(values) for path, values in columns.items()}
    return Series("/out", np.arange(len(next(iter(arrays.values())))), None, arrays)


PULSE = ('field = "c1"', 'unit = "us"', "pulse_us = [1100, 1500, 1900]", "dead_band_us = 25")


def test_pulses_with_a_dead_band_are_a_speed() -> None:
    profile = boat(signal("speed.command", *PULSE, "full_rpm = 3000"))
    pulses = [1100, 1475, 1500, 1525, 1712.5, 1900, 2000, 0, math.nan]
    columns = convert(profile, one(c1=pulses))
    # 1712.5 us is half of the 375 us beyond the dead band; 0 us is an output that is off.
    assert columns["n_cmd_stern"] == pytest.approx([-3000, 0, 0, 0, 1500, 3000, 3000, 0, math.nan], nan_ok=True)


def test_pulses_of_a_controller_that_cannot_reverse_and_of_a_reversed_output() -> None:
    lines = ('field = "c1"', 'unit = "us"', "pulse_us = [1000, 1000, 2000]", "full_rpm = 1000")
    assert convert(boat(signal("speed.command", *lines)), one(c1=[900, 1000, 1250]))["n_cmd_stern"].tolist() == [
        0,
        0,
        250,
    ]
    lines = (*PULSE[:3], "sign = -1", "full_rpm = 1000")
    assert convert(boat(signal("speed.command", *lines)), one(c1=[1600]))["n_cmd_stern"].tolist() == [-250]


def test_pulses_and_shares_of_an_angle_and_of_a_force() -> None:
    text = signal("angle.command", *PULSE[:3], "full_deg = 90") + signal(
        "force.command", 'field = "control"', 'unit = "fraction"', "full_N = 80"
    )
    columns = convert(boat(text, kind="azimuth", more=""), one(c1=[1300.0], control=[-0.5]))
    assert columns["alpha_cmd_stern"] == pytest.approx([-math.pi / 4])
    assert columns["F_cmd_stern"].tolist() == [-40.0]


def test_pulses_are_made_again_from_shares() -> None:
    pulse = (1100.0, 1480.0, 1900.0, 30.0)
    shares = np.array([-1.0, -0.3, 0.0, 0.2, 1.0])
    np.testing.assert_allclose(share_of_pulse(pulse_of_share(shares, pulse), pulse), shares, atol=1e-12)


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        (PULSE, '"full_rpm".*the speed at full throttle'),
        ((*PULSE[:2], "full_rpm = 1"), 'lacks "pulse_us"'),
        ((*PULSE[:2], "full_rpm = 1", "pulse_us = [1900, 1500, 1100]"), r"and rise, found .*sign = -1"),
        ((*PULSE[:3], "full_rpm = 1", "dead_band_us = 400"), "leaves nothing of"),
        ((*PULSE, "full_rpm = 1", "offset = 3"), '"offset" has no meaning beside "pulse_us"'),
        (('field = "c1"', 'unit = "us"', "full_N = 3"), "full_rpm"),
        (('field = "p"', 'unit = "rpm"', "element = { }"), '"element" must name one array'),
        (('field = "p"', 'unit = "rpm"', 'element = { a = "x", b = "y" }'), '"element" must name one array'),
    ],
)
def test_faults_of_shares_and_arrays_are_named(lines: tuple[str, ...], found: str) -> None:
    with pytest.raises(FerryIdError, match=found):
        boat(signal("speed.command", *lines))


def test_a_rudder_whose_order_is_a_force_is_a_force_across() -> None:
    text = signal("force.command", 'field = "y"', 'unit = "kN"', "sign = -1")
    profile = boat(text, kind="force", more="angle_deg = 90")
    # An order to starboard pushes the stern to port.
    assert convert(profile, one(y=[0.2]))["F_cmd_stern"].tolist() == [-200.0]
    assert profile.actuators[0].angle_rad == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(("unit", "scale"), [("rad", 1.0), ("deg", 180.0 / math.pi), ("degE7", 1.8e9 / math.pi)])
def test_latitude_and_longitude_in_any_unit(unit: str, scale: float) -> None:
    position = (
        '[signals.position]\ntopic = "/out"\nfields = ["lat", "lon"]\nframe = "geodetic"\n' + f'unit = "{unit}"\n'
    )
    profile = boat(position + signal("force", 'field = "f"', 'unit = "N"'), kind="force", more="")
    lat, lon = np.radians([63.0, 63.001]), np.radians([10.0, 10.001])
    columns = convert(profile, one(lat=lat * scale, lon=lon * scale))
    assert columns["x"] == pytest.approx([0.0, 111.45], abs=0.05)
    assert columns["y"] == pytest.approx([0.0, 50.67], abs=0.05)


JOINTS = signal("angle", 'field = "position"', 'unit = "rad"', 'element = { name = "stern_joint" }') + signal(
    "speed", 'field = "velocity[]"', 'unit = "rad/s"', 'element = { "name[]" = "stern_joint" }'
)


def joint_messages() -> list[tuple[list[str], list[float], list[float]]]:
    """Two orders of the joints, and messages without ours."""
    made = []
    for k in range(30):
        names = (["bow_joint", "stern_joint"], ["stern_joint", "bow_joint", "flap"], ["flap"])[k % 3]
        made.append((names, [0.01 * k if n == "stern_joint" else 9.0 for n in names], [1.0 * k] * len(names)))
    return made


def joints_as(kind: str, folder: Path) -> Path:
    if kind == "json":
        path = folder / "joints.mcap"
        with path.open("wb") as file:
            writer = McapWriter(file)
            writer.start()
            schema = writer.register_schema("JointState", "jsonschema", b"{}")
            channel = writer.register_channel("/out", "json", schema)
            for k, (names, angles, speeds) in enumerate(joint_messages()):
                text = json.dumps({"name": names, "position": angles, "velocity": speeds}).encode()
                writer.add_message(channel, k * 10**8, text, k * 10**8)
            writer.finish()
        return path
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    path = folder / "joints"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/out", "sensor_msgs/msg/JointState", typestore=store)
        for k, (names, angles, speeds) in enumerate(joint_messages()):
            header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](k, 0), "")
            made = types["sensor_msgs/msg/JointState"](header, names, np.array(angles), np.array(speeds), np.array([]))
            writer.write(topic, k * 10**8, store.serialize_cdr(made, made.__msgtype__))
    return path


@pytest.mark.parametrize("kind", ["json", "ros2"])
def test_an_entry_of_an_array_is_found_by_its_name_wherever_it_stands(kind: str, tmp_path: Path) -> None:
    profile = boat(JOINTS, kind="azimuth")
    reader = open_log(joints_as(kind, tmp_path))
    topics = [*reader.topics, Topic("/nav", "x/Y", "cdr", 9, 0, 1, dict.fromkeys("uvr", "float64"))]
    selection = select(profile, topics, "log")
    assert selection.found["alpha_stern"] == "/out: position[] of stern_joint"
    columns = convert(profile, reader.read({"/out": selection.wanted["/out"]})["/out"])
    here = np.arange(30) % 3 != 2
    np.testing.assert_allclose(columns["alpha_stern"][here], 0.01 * np.arange(30)[here])
    np.testing.assert_allclose(columns["n_stern"][here], np.arange(30)[here] * 30.0 / math.pi)
    assert np.isnan(columns["alpha_stern"][~here]).all()


def test_entries_by_number_in_a_fixed_array_and_in_listed_elements() -> None:
    text = signal("speed", 'field = "esc[].rpm"', 'unit = "rpm"', 'element = { "esc[].address" = 7 }')
    profile = boat(text)
    nav = Topic("/nav", "x/Y", "cdr", 9, 0, 1, dict.fromkeys("uvr", "float64"))
    listed = {f"esc[{k}].{name}": "int32" for k in range(2) for name in ("address", "rpm")}
    for fields, encoding in (({"esc[2].address": "uint8", "esc[2].rpm": "int32"}, "cdr"), (listed, "ulog")):
        selection = select(profile, [nav, Topic("/out", "x/Z", encoding, 9, 0, 1, fields)], "log")
        assert selection.wanted["/out"] == ("esc[0].address", "esc[0].rpm", "esc[1].address", "esc[1].rpm")
    columns = {"esc[0].address": [7, 3], "esc[0].rpm": [10, 20], "esc[1].address": [3, 7], "esc[1].rpm": [30, 40]}
    assert convert(profile, one(**columns))["n_stern"].tolist() == [10.0, 40.0]


@pytest.mark.parametrize(
    ("fields", "found"),
    [
        ({"names[]": "string", "position[]": "float64", "velocity[]": "float64"}, 'no array "name.."'),
        ({"name[]": "string", "position": "float64", "velocity[]": "float64"}, 'no array "position..".*it has name'),
        ({"name[]": "string", "position[]": "string", "velocity[]": "float64"}, "found text .*in position"),
    ],
)
def test_arrays_that_are_not_there_are_named(fields: dict[str, str], found: str) -> None:
    nav = Topic("/nav", "x/Y", "cdr", 9, 0, 1, dict.fromkeys("uvr", "float64"))
    with pytest.raises(FerryIdError, match=found):
        select(boat(JOINTS, kind="azimuth"), [nav, Topic("/out", "x/Z", "cdr", 9, 0, 1, fields)], "log")
