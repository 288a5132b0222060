"""Drafts from logs of autopilots: what PX4 and ArduPilot call pose, velocity and orders."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.draft import Answers, Draft, draft_profile, draft_text, questions
from ferryid.draft.autopilots import with_frames
from ferryid.draft.fields import navigation_groups
from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Topic
from ferryid.signals.recording import record
from ferryid.vessel import check_profile, load_profile, parse_profile
from tests.draft.test_draft import Columns
from tests.ingest.autopilot_logs import DataFlash, ulog

BOAT = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up for a test"
[hull]
mass_kg = 100.0
inertia_z = 200.0
[[actuator]]
name = "stern"
kind = "propeller"
position_m = [-1.0, 0.0]
thrust = { kind = "quadratic", ahead = 0.01 }
"""


def px4(
    trial: Columns,
    *,
    actuators: bool = True,
    heading: bool = True,
    parameters: dict[str, float] | None = None,
    motors: Columns | None = None,
    servos: Columns | None = None,
) -> bytes:
    """A log of PX4; `motors` and `servos` take the place of one propeller and one rudder, by their number."""
    t = (trial["t"] * 1e6).astype(np.uint64) + 1_000_000
    single = {name: values.astype(np.float32) for name, values in trial.items()}
    zero, psi = 0 * single["u"], (trial["psi"] + np.pi) % (2 * np.pi) - np.pi
    unused = np.full((len(t), 10), np.nan)
    topics: dict[str, dict[str, Any]] = {
        "vehicle_attitude": {
            "timestamp": t,
            "timestamp_sample": t - 200,
            "q": np.column_stack([np.cos(psi / 2), zero, zero, np.sin(psi / 2)]).astype(np.float32),
            "delta_q_reset": np.zeros((len(t), 4), np.float32),
        },
        "vehicle_local_position": {
            "timestamp": t,
            "timestamp_sample": t - 200,
            "x": single["N"],
            "y": single["E"],
            "z": zero,
            "vx": single["vn"],
            "vy": single["ve"],
            "vz": zero,
            **({"heading": psi.astype(np.float32)} if heading else {}),
        },
        "vehicle_angular_velocity": {"timestamp": t, "xyz": np.column_stack([zero, zero, single["r"]])},
        "vehicle_attitude_setpoint": {"timestamp": t, "yaw_body": psi.astype(np.float32)},
    }
    if actuators:
        pushed = np.column_stack([*({"1": trial["n"] / 1000} if motors is None else motors).values(), unused])
        turned = np.column_stack([*({"1": trial["rudder"] / 0.7} if servos is None else servos).values(), unused])
        topics["actuator_motors"] = {"timestamp": t, "control": pushed.astype(np.float32)}
        topics["actuator_servos"] = {"timestamp": t, "control": turned.astype(np.float32)}
        topics["actuator_outputs"] = {"timestamp": t, "output": np.c_[1500 + 400 * pushed].astype(np.float32)}
    return ulog(topics, parameters=parameters)


def ardupilot(
    trial: Columns,
    parameters: dict[str, float] | None = None,
    outputs: dict[int, np.ndarray] | None = None,
    changed: tuple[tuple[float, str, float], ...] = (),
    *,
    channel: str = "C",
    located: bool = True,
) -> bytes:
    """A log of ArduPilot; `outputs` are pulses by channel, `changed` are parameters that change: time [s], name, value.

    `channel` begins the names of outputs; a vessel that is not `located` knows no position.
    """
    if outputs is None:
        outputs = {1: 1500 + 500 * trial["rudder"], 3: 1500 + 0.3 * trial["n"]}
    messages = {"RCOU": range(1, min(max(outputs), 14) + 1), "RCO2": range(15, max(outputs) + 1)}
    log = DataFlash()
    if parameters is not None:
        log.parameters(parameters)
    log.define("ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define("GPS", "QBBIHLLff", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Spd,GCrs")
    log.define("XKF1", "QBCffff", "TimeUS,C,Yaw,VN,VE,PN,PE")
    log.define("IMU", "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ")
    for name, channels in messages.items():
        log.define(name, "Q" + "H" * len(channels), ",".join(["TimeUS", *(f"{channel}{k}" for k in channels)]))
    for name in ("XKF1", "IMU", "GPS"):
        log.units(name, "s#---")
    rows: list[tuple[Any, ...]] = []
    for k, t in enumerate((trial["t"] * 1e6).astype(int).tolist()):
        one = {name: float(values[k]) for name, values in trial.items()}
        yaw = int(np.degrees(one["psi"]) % 360 * 100)
        rows.append(("ATT", t, 0, 0, yaw))
        for name, channels in messages.items():
            if channels:
                rows.append((name, t, *(int(outputs[one][k]) if one in outputs else 0 for one in channels)))
        place = (one["N"], one["E"]) if located else (0.0, 0.0)
        rows += [("XKF1", t, core, yaw, one["vn"], one["ve"], *place) for core in (0, 1)]
        rows.append(("IMU", t, 0, 0.0, 0.0, one["r"]))
        if located and k % 2 == 0:
            degrees = (int(one["lat"] * 1e7), int(one["lon"] * 1e7))
            rows.append(("GPS", t, 0, 3, 345_600_000 + t // 1000, 2300, *degrees, np.hypot(one["vn"], one["ve"]), 0.0))
    rows += [("PARM", int(at * 1e6), name.encode(), value, 0.0) for at, name, value in changed]
    log.table(rows)
    return log.content


def shown(draft: Draft) -> dict[str, tuple[str, tuple[str, ...], str, str]]:
    return {one.quantity: (one.topic, one.fields, one.unit, one.frame) for one in draft.every}


def test_a_draft_from_px4(trial: Columns, tmp_path: Path) -> None:
    (tmp_path / "boat.ulg").write_bytes(px4(trial))
    draft = draft_profile(tmp_path / "boat.ulg")
    local = "/vehicle_local_position"
    assert shown(draft) == {
        "position": (local, ("x", "y"), "m", "NED"),
        "heading": ("/vehicle_attitude", ("q[1]", "q[2]", "q[3]", "q[0]"), "quaternion", "NED"),
        "velocity": (local, ("vx", "vy"), "m/s", "NED"),
        "yaw_rate": ("/vehicle_angular_velocity", ("xyz[2]",), "rad/s", "FRD"),
        "motor1.speed.command": ("/actuator_motors", ("control[0]",), "fraction", ""),
        "motor1.rudder.command": ("/actuator_servos", ("control[0]",), "fraction", ""),
    }
    assert [(one.name, one.kind) for one in draft.actuators] == [("motor1", "propeller_rudder")]
    # The format states its frames.
    assert not [one for one in draft.signals if one.doubts]


def test_the_attitude_of_px4_is_a_heading(trial: Columns, tmp_path: Path) -> None:
    path = tmp_path / "boat.ulg"
    path.write_bytes(px4(trial, heading=False))
    draft = draft_profile(path)
    q = ("/vehicle_attitude", ("q[1]", "q[2]", "q[3]", "q[0]"), "quaternion", "NED")
    assert shown(draft)["heading"] == q
    answers = Answers("boat", {one.key: one.hint for one in questions(draft)})
    streams = record(path, parse_profile(draft_text(draft, answers), "boat.toml")).streams.values()
    columns = {name: values for stream in streams for name, values in stream.columns.items()}
    np.testing.assert_allclose(np.cos(columns["psi"] - trial["psi"]), 1.0, atol=1e-6)
    np.testing.assert_allclose(columns["r"], trial["r"], atol=1e-6)


def test_a_draft_from_ardupilot(trial: Columns, tmp_path: Path) -> None:
    (tmp_path / "boat.bin").write_bytes(ardupilot(trial))
    draft = draft_profile(tmp_path / "boat.bin")
    assert shown(draft) == {
        "position": ("/XKF1", ("PN", "PE"), "m", "NED"),
        "heading": ("/ATT", ("Yaw",), "deg", "NED"),
        "velocity": ("/XKF1", ("VN", "VE"), "m/s", "NED"),
        "yaw_rate": ("/IMU", ("GyrZ",), "rad/s", "FRD"),
        "output1.speed.command": ("/RCOU", ("C1",), "us", ""),
        "output3.speed.command": ("/RCOU", ("C3",), "us", ""),
    }
    assert all(any("drives" in doubt for doubt in one.signals[0].doubts) for one in draft.actuators)


def test_a_velocity_without_a_position_is_over_ground_by_its_names(trial: Columns, tmp_path: Path) -> None:
    (tmp_path / "boat.bin").write_bytes(ardupilot(trial, located=False))
    draft = draft_profile(tmp_path / "boat.bin")
    assert "position" not in shown(draft)
    assert shown(draft)["velocity"] == ("/XKF1", ("VN", "VE"), "m/s", "NED")
    assert next(one.doubts for one in draft.signals if one.quantity == "velocity") == ("its unit is assumed",)


def test_outputs_are_found_by_their_names_of_2014(trial: Columns, tmp_path: Path) -> None:
    (tmp_path / "boat.bin").write_bytes(ardupilot(trial, channel="Ch"))
    fields = {name: one[1] for name, one in shown(draft_profile(tmp_path / "boat.bin")).items() if "output" in name}
    assert fields == {"output1.speed.command": ("Ch1",), "output3.speed.command": ("Ch3",)}


def test_an_output_that_is_off_at_times_is_still_in_pulses(trial: Columns, tmp_path: Path) -> None:
    off = trial["t"] < 10.0
    pulses = {1: np.where(off, 0.0, 1500.0 + 500.0 * trial["rudder"]), 3: 1500.0 + 0.3 * trial["n"]}
    (tmp_path / "boat.bin").write_bytes(ardupilot(trial, outputs=pulses))
    found = {one.quantity: one for one in draft_profile(tmp_path / "boat.bin").every}
    assert found["output1.speed.command"].unit == "us"
    assert any(one.startswith("in us: 99 %") for one in found["output1.speed.command"].evidence)


@pytest.mark.parametrize("name", ["boat.ulg", "boat.bin"])
def test_an_answered_draft_is_a_profile_that_reads_its_log(trial: Columns, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(px4(trial) if name.endswith("ulg") else ardupilot(trial))
    draft = draft_profile(tmp_path / name)
    answers = Answers("boat", {one.key: one.hint for one in questions(draft)})
    (tmp_path / "boat.toml").write_text(draft_text(draft, answers), encoding="utf-8")
    assert not [fault for fault in check_profile(str(tmp_path / "boat.toml")) if not fault.warning]
    recording = record(tmp_path / name, load_profile(str(tmp_path / "boat.toml")))
    columns = {name: values for stream in recording.streams.values() for name, values in stream.columns.items()}
    order = "n_cmd_motor1" if name.endswith("ulg") else "n_cmd_output3"
    # A full speed of 1000 rpm, as answered; the pulses of 1500 to 1900 us order 0.3 of 400 us for 1 rpm of the trial in 1000.
    scale = 1.0 if name.endswith("ulg") else 0.3 / 400.0 * 1000.0
    np.testing.assert_allclose(columns[order], trial["n"] * scale, atol=2.6)
    if name.endswith("ulg"):
        np.testing.assert_allclose(columns["delta_cmd_motor1"], trial["rudder"] / 0.7 * np.radians(35.0), atol=1e-6)


@pytest.mark.parametrize("place", [0, 1])
def test_the_signal_maps_of_the_page_read_every_such_boat(trial: Columns, tmp_path: Path, place: int) -> None:
    page = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    text = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)[place]
    profile = parse_profile(BOAT + text, "boat.toml")
    log = tmp_path / ("boat.ulg", "boat.bin")[place]
    log.write_bytes((px4, ardupilot)[place](trial))
    streams = record(log, profile).streams.values()
    columns = {name: values for stream in streams for name, values in stream.columns.items()}
    # Centidegrees of the heading, and the two orders of a motor: 1 for 1000 rpm, and 300 us beyond 25 of dead band.
    np.testing.assert_allclose(np.cos(columns["psi"] - trial["psi"]), 1.0, atol=2e-7)
    np.testing.assert_allclose(columns["r"], trial["r"], atol=1e-6)
    np.testing.assert_allclose(columns["vel_N"], trial["vn"], atol=1e-6)
    np.testing.assert_allclose(columns["y"], trial["E"], atol=1e-5)
    pushed = trial["n"] / 1000 if place == 0 else (np.floor(1500.0 + 0.3 * trial["n"]) - 1525.0) / 375.0
    np.testing.assert_allclose(columns["n_cmd_stern"], 3000 * np.clip(pushed, -1.0, 1.0), rtol=1e-5)


def test_a_log_of_an_autopilot_without_orders_is_one_line(trial: Columns, tmp_path: Path) -> None:
    (tmp_path / "boat.ulg").write_bytes(px4(trial, actuators=False))
    with pytest.raises(
        FerryIdError, match=r"no field looks like an actuator.*vehicle_local_position.*Fix: record the orders"
    ):
        draft_profile(tmp_path / "boat.ulg")


def drifting(trial: Columns) -> Columns:
    """A trial of a vessel that lies still: its position wanders by centimetres, its velocity is noise that does not agree."""
    rng = np.random.default_rng(4)
    still = {name: 0.0 * values for name, values in trial.items()} | {"t": trial["t"]}
    wandering = {name: 0.01 * np.cumsum(rng.normal(size=len(trial["t"]))) for name in ("N", "E")}
    noise = {name: 0.02 * rng.normal(size=len(trial["t"])) for name in ("vn", "ve")}
    turning = {"psi": 2.0 + 0.002 * np.cumsum(rng.normal(size=len(trial["t"])))}
    return still | wandering | noise | turning | {name: trial[name] for name in ("rudder", "n")}


@pytest.mark.parametrize("name", ["boat.ulg", "boat.bin"])
def test_frames_that_the_format_states_hold_where_nothing_moves(trial: Columns, tmp_path: Path, name: str) -> None:
    still = drifting(trial) | {"lat": trial["lat"], "lon": trial["lon"]}
    (tmp_path / name).write_bytes(px4(still) if name.endswith("ulg") else ardupilot(still))
    draft = draft_profile(tmp_path / name)
    assert {one: shown(draft)[one][3] for one in ("heading", "velocity")} == {"heading": "NED", "velocity": "NED"}
    doubts = next(one.doubts for one in draft.signals if one.quantity == "velocity")
    assert any("do not agree in NED, which its format states" in doubt for doubt in doubts)


@pytest.mark.parametrize("name", ["boat.ulg", "boat.bin"])
def test_no_motion_overrules_the_frame_that_the_format_states(trial: Columns, tmp_path: Path, name: str) -> None:
    # What stands there is along the hull, which the definition of these fields rules out.
    along = trial | {"vn": trial["u"], "ve": trial["v"]}
    (tmp_path / name).write_bytes(px4(along) if name.endswith("ulg") else ardupilot(along))
    draft = draft_profile(tmp_path / name)
    assert shown(draft)["velocity"][3] == "NED"
    assert any("do not agree in NED" in doubt for one in draft.signals for doubt in one.doubts)


@pytest.mark.parametrize("second", ["XKF1", "XKF6"])
def test_a_spare_estimator_is_no_second_velocity(trial: Columns, tmp_path: Path, second: str) -> None:
    # Nothing knows a position, and the second core drifts another way.
    log = DataFlash()
    log.define("ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define("XKF1", "QBCff", "TimeUS,C,Yaw,VN,VE")
    log.define("XKF6", "QCff", "TimeUS,Yaw,VN,VE")
    log.define("RCOU", "QHH", "TimeUS,C1,C3")
    log.units("XKF1", "s#---")
    drift = np.random.default_rng(3).normal(size=(2, len(trial["t"])))
    rows: list[tuple[Any, ...]] = []
    for k, t in enumerate((trial["t"] * 1e6).astype(int).tolist()):
        yaw = int(np.degrees(trial["psi"][k]) % 360 * 100)
        rows += [("ATT", t, 0, 0, yaw), ("XKF1", t, 0, yaw, float(trial["vn"][k]), float(trial["ve"][k]))]
        spare = (yaw, float(drift[0, k]), float(drift[1, k]))
        rows.append(("XKF1", t, 1, *spare) if second == "XKF1" else ("XKF6", t, *spare))
        rows.append(("RCOU", t, int(1500 + 500 * trial["rudder"][k]), int(1500 + 0.3 * trial["n"][k])))
    log.table(rows)
    (tmp_path / "boat.bin").write_bytes(log.content)
    assert shown(draft_profile(tmp_path / "boat.bin"))["velocity"] == ("/XKF1", ("VN", "VE"), "m/s", "NED")


def test_what_a_log_states_in_a_burst_is_no_position(trial: Columns, tmp_path: Path) -> None:
    log = DataFlash()
    log.define("ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    log.define("POS", "QLL", "TimeUS,Lat,Lng")
    log.define("ATT", "QC", "TimeUS,Yaw")
    log.define("AHR2", "QCLL", "TimeUS,Yaw,Lat,Lng")
    log.define("RCOU", "QHH", "TimeUS,C1,C3")
    rows: list[tuple[Any, ...]] = [("ORGN", k, k, 634_000_000 + 1000 * k, 104_000_000, 0) for k in range(2)]
    for k, t in enumerate((trial["t"] * 1e6).astype(int).tolist()):
        place = (int(trial["lat"][k] * 1e7), int(trial["lon"][k] * 1e7))
        yaw = int(np.degrees(trial["psi"][k]) % 360 * 100)
        # The spare attitude is the better one here, but nothing steers by it.
        rows += [("POS", t, *place), ("ATT", t, (yaw + 3000) % 36000), ("AHR2", t, yaw, *place)]
        rows.append(("RCOU", t, int(1500 + 500 * trial["rudder"][k]), int(1500 + 0.3 * trial["n"][k])))
    log.table(rows)
    (tmp_path / "boat.bin").write_bytes(log.content)
    found = shown(draft_profile(tmp_path / "boat.bin"))
    assert (found["position"][0], found["heading"][0]) == ("/POS", "/ATT")


def test_beside_a_velocity_of_known_definition_none_of_a_controller_is_taken(trial: Columns, tmp_path: Path) -> None:
    content = ardupilot(drifting(trial) | {"lat": trial["lat"], "lon": trial["lon"]})
    (tmp_path / "boat.bin").write_bytes(content)
    topics = open_log(tmp_path / "boat.bin").topics
    controller = Topic("/PSC", "PSC", "dataflash", 100, 0, 10**9, {"VX": "float", "VY": "float"})
    groups = with_frames(navigation_groups([*topics, controller]), [*topics, controller])
    assert {one.topic for one in groups if one.kind == "velocity"} == {"/XKF1"}
    alone = with_frames(navigation_groups([controller]), [controller])
    assert [one.topic for one in alone if one.kind == "velocity"] == ["/PSC"]


def test_a_refusal_of_velocities_that_disagree_says_that_no_position_decides(trial: Columns, tmp_path: Path) -> None:
    still = drifting(trial)
    rng = np.random.default_rng(5)
    lines = np.column_stack([trial["t"], still["N"], still["E"], still["psi"], still["vn"], still["ve"],
                             *rng.normal(size=(2, len(trial["t"]))), trial["n"]])  # fmt: skip
    path = tmp_path / "trial.csv"
    np.savetxt(path, lines, delimiter=",", header="t,N,E,psi,u,v,dvl_vx,dvl_vy,rpm", comments="")
    with pytest.raises(FerryIdError, match="no position that agrees with one of them decides which is right"):
        draft_profile(path)


def test_orders_that_never_change_are_named_in_the_refusal(trial: Columns, tmp_path: Path) -> None:
    (tmp_path / "boat.ulg").write_bytes(px4(trial, motors={"1": 0.0 * trial["n"]}, servos={"1": 0.0 * trial["n"]}))
    with pytest.raises(
        FerryIdError, match=r"ever changes, found /actuator_motors: control\[0\].*while the vessel is driven"
    ):
        draft_profile(tmp_path / "boat.ulg")
