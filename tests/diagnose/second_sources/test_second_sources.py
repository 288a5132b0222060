"""Further columns of a table and further topics: what is recognised, passed over, hidden and named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import MeasuredLog, measure_log
from ferryid.diagnose.second_sources import SecondSources, compare_second_sources, samples, sources
from ferryid.diagnose.second_sources.candidates import Candidate, candidates, words_of
from ferryid.ingest.log import Topic
from ferryid.types import IN_MEMORY, Floats, no_progress
from ferryid.vessel import load_profile
from tests.diagnose.second_sources.test_comparison import at, coloured

PROFILE = """
schema = "ferryid.vessel/1"
name = "boat"
title = "boat"
source = "made for a test"
[hull]
mass_kg = 30.0
inertia_z = 4.0
length_m = 1.5
[[actuator]]
name = "left"
kind = "force"
position_m = [-0.4, -0.2]
[signals.position]
topic = "table"
fields = ["x", "y"]
unit = "m"
frame = "NED"
[signals.heading]
topic = "table"
field = "psi"
unit = "rad"
frame = "NED"
[signals.velocity]
topic = "table"
fields = ["u", "v"]
unit = "m/s"
frame = "FRD"
[signals.yaw_rate]
topic = "table"
field = "r"
unit = "rad/s"
frame = "FRD"
[signals.wind]
topic = "table"
speed = "gust"
direction = "gustdir"
unit = "m/s"
direction_unit = "rad"
reference = "bow"
air = "true"
[signals."left.force"]
topic = "table"
field = "force"
unit = "N"
"""


def recorded(folder: Path, more: Mapping[str, Floats] | None = None, yaw_rate: float = 1.0) -> MeasuredLog:
    """Return a table with mapped columns and some more, as a diagnosis measures it; its yaw rate reads too much by a factor."""
    t = np.arange(0.0, 400.0, 0.2)
    rng = np.random.default_rng(4)
    seen = at(t) + np.column_stack([coloured(rng, len(t), one, 0.2) for one in (0.02, 0.02, 0.002, 0.01, 0.01, 0.001)])
    columns: dict[str, Floats] = {"t": t, **dict(zip(("x", "y", "psi", "u", "v", "r"), seen.T, strict=True))}
    columns["r"] = columns["r"] * yaw_rate
    columns["force"] = 10.0 + np.sin(0.2 * t)
    columns["gust"], columns["gustdir"] = 4.0 + 0.0 * t, 2.0 - seen[:, 2]
    columns.update(more or {})
    (folder / "boat.toml").write_text(PROFILE, encoding="utf-8")
    rows = [",".join(columns), *(",".join(map(repr, row)) for row in np.column_stack(list(columns.values())).tolist())]
    (folder / "log.csv").write_text("\n".join(rows), encoding="utf-8")
    return measure_log(str(folder / "log.csv"), load_profile(str(folder / "boat.toml")), IN_MEMORY)


def gyro(factor: float, seed: int) -> Floats:
    t = np.arange(0.0, 400.0, 0.2)
    return factor * at(t)[:, 5] + coloured(np.random.default_rng(seed), len(t), 0.001, 0.2)


def differences(found: SecondSources) -> dict[str, list[str]]:
    return {one.candidate.label: [each.what for each in one.differences] for one in found.compared}


def test_a_log_without_another_topic_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = recorded(tmp_path)
    monkeypatch.setattr(samples, "open_log", lambda *_: pytest.fail("the log is opened"))
    monkeypatch.setattr(sources, "compare", lambda *_: pytest.fail("something is compared"))
    found = compare_second_sources([log], (), pytest.fail)
    assert not found
    assert not found.compared


def test_what_is_broken_is_passed_over_and_counted(tmp_path: Path) -> None:
    n = 2000
    gaps = gyro(1.0, 5)
    gaps[::3] = np.nan
    log = recorded(tmp_path, {"compass": np.full(n, 1.5), "hdg": np.full(n, np.nan), "gyro_z": gaps})
    found = compare_second_sources([log], (), no_progress)
    assert differences(found) == {"gyro_z": []}
    assert dict(found.passed_over) == {samples.CONSTANT: 1, samples.BROKEN: 1}
    assert found.to_json()["compared"][0]["agrees"] is True


def test_a_velocity_without_sway_is_no_vector(tmp_path: Path) -> None:
    t = np.arange(0.0, 400.0, 0.2)
    found = compare_second_sources([recorded(tmp_path, {"vx": at(t)[:, 3], "vy": 0.0 * t})], (), no_progress)
    assert not found.compared
    assert dict(found.passed_over) == {samples.CONSTANT: 1}


def test_a_log_that_cannot_be_read_again_stops_nothing(tmp_path: Path) -> None:
    log = recorded(tmp_path, {"gyro_z": gyro(1.0, 5)})
    found = compare_second_sources([replace(log, path=str(tmp_path / "gone.csv"))], (), no_progress)
    assert not found.compared
    assert dict(found.passed_over) == {samples.NOT_READ: 1}


def test_the_mapped_sensor_is_named_where_two_others_agree_against_it(tmp_path: Path) -> None:
    found = compare_second_sources([recorded(tmp_path, {"gyro_z": gyro(1.0, 5)}, yaw_rate=1.05)], (), no_progress)
    assert differences(found) == {"gyro_z": ["scale"]}
    (witness,) = found.witnesses
    assert (witness.quantity, witness.what, witness.odd) == ("yaw rate", "scale", "")
    assert set(witness.agreeing) == {"gyro_z", "slope of the mapped heading"}


def test_another_sensor_is_named_where_the_mapped_one_has_a_witness(tmp_path: Path) -> None:
    found = compare_second_sources([recorded(tmp_path, {"gyro_z": gyro(1.05, 5)})], (), no_progress)
    (witness,) = found.witnesses
    assert (witness.what, witness.odd) == ("scale", "gyro_z")


def test_a_coarse_compass_shows_its_steps(tmp_path: Path) -> None:
    t = np.arange(0.0, 400.0, 0.2)
    degrees = np.round(np.degrees(at(t)[:, 2]) / 2.0) * 2.0 % 360.0
    (one,) = compare_second_sources([recorded(tmp_path, {"compass_deg": degrees})], (), no_progress).compared
    step = next(each for each in one.differences if each.what == "steps").parameters["step"]
    assert one.unit == "deg"
    assert step.value == pytest.approx(2.0)


def test_what_moves_with_a_withheld_wind_is_not_looked_at(tmp_path: Path) -> None:
    t = np.arange(0.0, 400.0, 0.2)
    log = recorded(tmp_path, {"vane": 1.0 - at(t)[:, 2]})
    shown = compare_second_sources([log], (), no_progress)
    assert [one.kind for one in shown.compared] == ["heading"]
    assert not compare_second_sources([log], ("wind",), no_progress)


def topic(name: str, fields: str, kind: str = "a/msg/B") -> Topic:
    return Topic(name, kind, "cdr", 1000, 0, 1, dict.fromkeys(fields.split(), "float64"))


@pytest.mark.parametrize(
    ("name", "fields", "kinds"),
    [
        ("/odom", "pose.pose.position.x pose.pose.position.y twist.twist.linear.x twist.twist.linear.y", "position velocity"),
        ("/imu", "orientation.x orientation.y orientation.z orientation.w angular_velocity.z", "heading yaw_rate"),
        ("/imu", "linear_acceleration.x linear_acceleration.y linear_acceleration.z", ""),
        ("/compass", "data", "heading"),
        ("/desired_heading", "data", ""),
        ("table", "HeadingSet SpeedSet", ""),
        ("/ref", "x y theta", ""),
        ("/ins_pose", "x y theta", "position heading"),
        ("/fix", "latitude longitude altitude", "position"),
        ("/gps", "latitude longitude SOG track_angle", "position velocity"),
        ("/wind", "speed angle", ""),
        ("/states", "x y phi theta psi u v p q r", "position heading velocity yaw_rate"),
        ("/tau", "wrench_force_x wrench_force_y wrench_torque_z", ""),
        ("/nav", "twist_linear_x twist_linear_y twist_angular_z quaternion_x quaternion_y quaternion_z quaternion_w",
         "velocity yaw_rate heading"),
    ],
)  # fmt: skip
def test_fields_are_recognised(name: str, fields: str, kinds: str) -> None:
    found = candidates(load_profile("milliampere"), [topic(name, fields, "sensor_msgs/msg/Any")])
    assert sorted(one.kind for one in found) == sorted(kinds.split())


def test_what_is_mapped_is_no_candidate() -> None:
    profile = load_profile("milliampere")
    mapped = {signal.topic: signal.fields for signal in profile.signals if signal.quantity == "velocity"}
    ((name, fields),) = mapped.items()
    assert not candidates(profile, [topic(name, " ".join(fields))])


def test_words_of_names() -> None:
    assert words_of("/psi_error") == ("psi", "error")
    assert words_of("r_angvelo [rad/s]") == ("r", "angvelo")
    assert words_of("linearVelocity.x") == ("linear", "velocity", "x")


def test_a_label_is_short() -> None:
    assert (
        Candidate("/imu", tuple(f"orientation.{axis}" for axis in "xyzw"), "heading", "quaternion").label
        == "/imu orientation"
    )
    assert Candidate("/compass", ("data",), "heading").label == "/compass"
