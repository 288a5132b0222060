"""A simulated log has the topics of its vessel: the profile that it was simulated with reads it, in every format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.signals.recording import record
from ferryid.simulate import Simulation, load_scenario, run_scenario, simulate, write_log
from ferryid.simulate.vessel_topics import in_vessel_topics
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel import parse_profile
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Profile

FERRY = load_profile("milliampere")
HULL = FERRY.text[: FERRY.text.index("[signals.position]")].replace('"milliampere"', '"boat"', 1)
BOAT = f"""{HULL}
[signals.position]
topic = "/gnss/fix"
fields = ["latitude", "longitude"]
unit = "deg"
frame = "geodetic"
mount_m = [-0.5, 0.3]

[signals.heading]
topic = "/imu/data"
quaternion = ["orientation.x", "orientation.y", "orientation.z", "orientation.w"]
frame = "ENU"

[signals.velocity]
topic = "/gnss/vel"
fields = ["twist.linear.x", "twist.linear.y"]
unit = "kn"
frame = "ENU"
mount_m = [-0.5, 0.3]

[signals.yaw_rate]
topic = "/imu/data"
field = "angular_velocity.z"
unit = "deg/s"
frame = "FLU"

[signals."thruster1.speed"]
topic = "/motors"
field = "rpm[0]"
unit = "rpm"

[signals."thruster2.speed"]
topic = "/motors"
field = "rpm[2]"
unit = "rps"

[signals."thruster1.angle"]
topic = "/servo"
field = "value"
unit = "deg"
sign = -1
offset = 3.0
where = {{ id = 1 }}

[signals."thruster2.angle"]
topic = "/servo"
field = "value"
unit = "rad"
where = {{ id = 2 }}

[signals."thruster1.speed.command"]
topic = "/rc"
field = "channels[3]"
unit = "us"
pulse_us = [1100, 1500, 1900]
full_rpm = 1050.0

[signals."thruster2.speed.command"]
topic = "/thruster2/command"
field = "speed"
unit = "rpm"

[signals.wind]
topic = "/anemometer"
speed = "speed"
unit = "kn"
direction = "angle"
direction_unit = "deg"
reference = "north"
air = "true"

[signals.current]
topic = "/log"
fields = ["flow.x", "flow.y"]
unit = "m/s"
frame = "ENU"
"""


@pytest.fixture(scope="module")
def trial() -> Simulation:
    scenario = load_scenario("twelve-corner-wind")
    sensors = replace(scenario.sensors, current_rate_hz=2.0, reference_rate_hz=2.0, camera_rate_hz=1.0)
    return simulate(replace(scenario, duration_s=20.0, sensors=sensors))


def columns(log: Path, profile: Profile) -> dict[str, tuple[Nanoseconds, Floats]]:
    """Return times and values of every canonical column that a profile reads of a log."""
    streams = record(log, profile).streams.values()
    return {name: (one.time_ns, values) for one in streams for name, values in one.columns.items()}


@pytest.mark.parametrize("name", ["t.mcap", "t.bag", "t_ros2"])
def test_a_log_is_read_with_the_profile_it_was_simulated_with(trial: Simulation, tmp_path: Path, name: str) -> None:
    boat = parse_profile(BOAT, "boat.toml")
    streams, notes = in_vessel_topics(trial.streams, boat)
    assert notes == ()
    write_log(replace(trial, profile=boat, streams=streams), tmp_path / name)
    write_log(trial, tmp_path / "own.mcap")
    read, known = columns(tmp_path / name, boat), columns(tmp_path / "own.mcap", FERRY)
    assert set(read) >= {
        "x",
        "y",
        "psi",
        "r",
        "n_thruster1",
        "alpha_thruster2",
        "n_cmd_thruster1",
        "wind_from",
        "current_N",
    }
    for column in ("n_thruster1", "n_thruster2", "n_cmd_thruster1", "n_cmd_thruster2", "current_N", "current_E", "r"):
        np.testing.assert_array_equal(read[column][0], known[column][0])
        np.testing.assert_allclose(read[column][1], known[column][1], atol=1e-9)
    for column in ("psi", "alpha_thruster1", "alpha_thruster2"):
        off = np.unwrap(read[column][1]) - np.unwrap(known[column][1])
        np.testing.assert_allclose(np.mod(off + 1.0, 2.0 * np.pi) - 1.0, 0.0, atol=1e-9)
    # Messages of one topic come one after the other, as their stamps say.
    assert {one.clock.source for one in record(tmp_path / name, boat).streams.values()} == {"stamp"}
    # The antenna is half a metre astern and 0.3 m to starboard of the origin; the first fix is the origin of the log.
    psi = known["psi"][1]
    for column, arm in (
        ("x", -0.5 * np.cos(psi) - 0.3 * np.sin(psi)),
        ("y", -0.5 * np.sin(psi) + 0.3 * np.cos(psi)),
    ):
        place = known[column][1] + arm
        np.testing.assert_allclose(read[column][1], place - place[0], atol=1e-3)
    # A wind of the scenario's speed and direction, but for the noise of its sensor.
    truth = trial.truth.wind.mean(axis=0)
    speed, origin = read["wind_speed"][1], read["wind_from"][1]
    found = -np.mean(speed * np.cos(origin)), -np.mean(speed * np.sin(origin))
    np.testing.assert_allclose(found, truth, atol=0.2)


@pytest.mark.parametrize("topic", ["/motors3", "2021-05-11/fix"])
def test_topics_of_any_names_have_types_of_their_own(trial: Simulation, tmp_path: Path, topic: str) -> None:
    boat = parse_profile(BOAT.replace('"/gnss/fix"', f'"{topic}"'), "boat.toml")
    streams, _ = in_vessel_topics(trial.streams, boat)
    write_log(replace(trial, profile=boat, streams=streams), tmp_path / "t.mcap")
    assert set(columns(tmp_path / "t.mcap", boat)) >= {"x", "y", "n_thruster1", "n_thruster2"}


def test_topics_that_are_the_simulators_stay_as_they_are(trial: Simulation) -> None:
    for profile in (FERRY, load_profile("revolt")):
        simulated = (
            trial if profile is FERRY else simulate(replace(load_scenario("revolt-positioning"), duration_s=5.0))
        )
        assert all(not stream.definition for stream in simulated.streams)
        assert "/navigation/odometry" in {stream.topic for stream in simulated.streams}


def test_what_the_vessel_does_not_record_is_left_out(trial: Simulation) -> None:
    streams, _ = in_vessel_topics(trial.streams, parse_profile(BOAT, "boat.toml"))
    assert {stream.topic for stream in streams} == {
        *(
            "/gnss/fix",
            "/gnss/vel",
            "/imu/data",
            "/motors",
            "/servo",
            "/rc",
            "/thruster2/command",
            "/anemometer",
            "/log",
        ),
        *("/control/reference", "/control/tau_d", "/camera/image/compressed"),
    }


def test_a_log_of_a_table_whose_columns_no_message_has_comes_with_a_profile(tmp_path: Path) -> None:
    text = HULL + "".join(
        f'[signals.{name}]\ntopic = "table"\n{fields}\n'
        for name, fields in {
            "position": 'fields = ["north", "east"]\nunit = "m"\nframe = "NED"',
            "heading": 'field = "heading (deg)"\nunit = "deg"\nframe = "NED"',
            '"thruster1.speed"': 'field = "n1"\nunit = "rpm"',
            '"thruster1.angle"': 'field = "a1"\nunit = "rad"',
            '"thruster2.speed"': 'field = "n2"\nunit = "rpm"',
            '"thruster2.angle"': 'field = "a2"\nunit = "rad"',
        }.items()
    )
    (tmp_path / "boat.toml").write_text(text)
    (tmp_path / "trial.toml").write_text(
        'schema = "ferryid.scenario/1"\ntitle = "t"\nvessel = "boat.toml"\nduration_s = 5\n[path]\nkind = "four-corner"\n'
    )
    result = run_scenario(str(tmp_path / "trial.toml"), tmp_path, progress=lambda _: None)
    (warning,) = result["warnings"]
    assert (
        'the profile\'s table: no message has a field "heading (deg)", as a table has. Read it with --vessel' in warning
    )
    beside = load_profile(tmp_path / "trial.vessel.toml")
    assert (beside.name, beside.hull.D, beside.actuators) == ("boat", FERRY.hull.D, FERRY.actuators)
    read = columns(tmp_path / "trial.mcap", beside)
    assert set(read) >= {"x", "psi", "u", "r", "n_thruster1", "alpha_thruster2", "n_cmd_thruster1", "X_d"}
    # Nothing that is there is replaced unasked.
    (tmp_path / "trial.mcap").unlink()
    with pytest.raises(FerryIdError, match=r"trial\.vessel\.toml"):
        run_scenario(str(tmp_path / "trial.toml"), tmp_path, progress=lambda _: None)
    assert not (tmp_path / "trial.mcap").exists()
    run_scenario(str(tmp_path / "trial.toml"), tmp_path, overwrite=True, progress=lambda _: None)
    # Another file is never replaced, such as the vessel's own profile.
    (tmp_path / "boat.vessel.toml").write_text(text)
    (tmp_path / "trial.toml").write_text((tmp_path / "trial.toml").read_text().replace("boat.toml", "boat.vessel.toml"))
    for overwrite in (False, True):
        with pytest.raises(
            FerryIdError, match=r"boat\.vessel\.toml: .* found another file\. Fix: give the log another"
        ):
            run_scenario(
                str(tmp_path / "trial.toml"), tmp_path, log=tmp_path / "boat.mcap", overwrite=overwrite,
                progress=lambda _: None,
            )  # fmt: skip
    assert (tmp_path / "boat.vessel.toml").read_text() == text
    # As columns that are words are no trouble, a table's profile reads the log of a table's vessel.
    plain = parse_profile(text.replace("heading (deg)", "heading"), "boat.toml")
    streams, notes = in_vessel_topics(simulate(replace(load_scenario("four-corner"), duration_s=5.0)).streams, plain)
    assert notes == ()
    assert "/table" in {stream.topic for stream in streams}
