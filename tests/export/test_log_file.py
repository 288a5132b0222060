"""A log as MCAP for viewers: read back by other packages, it holds the log's own times, forces, motion and findings."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.export.findings import read_diagnosis, told_by
from ferryid.export.log_file import export_log
from ferryid.models.forces.estimator import model_estimator
from ferryid.models.forces.residual import base_force
from ferryid.signals.inspect import inspect
from ferryid.signals.prepare import Prepared, prepare
from ferryid.vessel import load_profile
from tests.export.models import MODELS

LOG = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"
MODEL = MODELS["decoupled"]
FERRY = load_profile("milliampere")


def finding(effect: str, intervals: list[list[float]], probability: float = 0.98, **where: float) -> dict[str, Any]:
    return {
        "effect": effect,
        "instance": None,
        "probability": probability,
        "parameters": {"north": {"value": -3.0, "low": -3.2, "high": -2.8, "unit": "m/s"}},
        "where": {"axes": {}, "intervals": intervals, "onset": None, "regime": "", **where},
        "improvement": {"surge": 0.4, "sway": None, "yaw": 0.9},
        "held_out": True,
        "rivals": [],
        "unresolved_with": ["current"],
        "separating_manoeuvre": None,
        "says": f"A {effect} was left out.",
    }


def diagnosis(*findings: dict[str, Any], log: str = "short") -> dict[str, Any]:
    return {"schema": "ferryid.diagnosis/1", "log": log, "verdict": "partly_explained", "findings": list(findings)}


def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return the messages of every topic, as the ROS 2 decoder of the mcap project reads them."""
    found = defaultdict(list)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append((message.log_time, decoded))
    return found


def wrench(messages: list[tuple[int, Any]]) -> np.ndarray:
    return np.array([(m.wrench.force.x, m.wrench.force.y, m.wrench.torque.z) for _, m in messages])


def prepared(out: Path) -> Prepared:
    return prepare(str(LOG), FERRY, out, window_s=1.0, keep_track=True)


def export(mcap: Path, log: Path | str = LOG, **options: Any) -> dict[str, Any]:
    options = {"model": MODEL, **options}
    return export_log(str(log), mcap, mcap.parent / "out", progress=lambda stage: None, **options)


@pytest.mark.slow
def test_forces_and_motion_are_those_of_the_log_at_its_times(tmp_path: Path) -> None:
    mcap = tmp_path / "view.mcap"
    result = export(mcap)
    found, log = read(mcap), prepared(tmp_path / "out")
    motion, track = log.motion, log.track
    tau = model_estimator(MODEL).of(motion)
    rows = motion.valid & np.isfinite(tau).all(axis=1)
    assert 0 < rows.sum() < len(rows)
    assert result["rows_left_out"] == len(rows) - rows.sum()
    times = track.t0_ns + np.round(motion.t[rows] * 1e9).astype(np.int64)
    transforms = found.pop("/tf"), found.pop("/tf_static")
    for topic, messages in found.items():
        assert [when for when, _ in messages] == times.tolist(), topic
        stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in messages]
        assert stamps == times.tolist(), topic
    np.testing.assert_array_equal(wrench(found["/ferryid/force/measured"]), motion.tau[rows])
    np.testing.assert_array_equal(wrench(found["/ferryid/force/model"]), tau[rows])
    base = base_force(FERRY, motion, MODEL.scale)
    np.testing.assert_array_equal(wrench(found["/ferryid/force/base"]), base[rows])
    np.testing.assert_array_equal(wrench(found["/ferryid/force/residual"]), (motion.tau - tau)[rows])
    nu = [(m.twist.linear.x, m.twist.linear.y, m.twist.angular.z) for _, m in found["/ferryid/velocity"]]
    np.testing.assert_array_equal(nu, motion.nu[rows])
    poses = [m.pose for _, m in found["/ferryid/pose"]]
    np.testing.assert_array_equal([(p.position.x, p.position.y) for p in poses], motion.eta[rows, :2])
    q = np.array([(p.orientation.w, p.orientation.z) for p in poses])
    turn = 2.0 * np.arctan2(q[:, 1], q[:, 0]) - motion.eta[rows, 2]
    np.testing.assert_allclose(np.cos(turn), 1.0, atol=1e-12)
    assert {m.header.frame_id for _, m in found["/ferryid/pose"]} == {"map_ned"}
    # Viewers of three dimensions place the vessel by the same pose.
    moving, lasting = [[(when, one.transforms[0]) for when, one in each] for each in transforms]
    assert [when for when, _ in moving] == times.tolist()
    for (_, there), pose, when in zip(moving, poses, times.tolist(), strict=True):
        assert (there.header.frame_id, there.child_frame_id) == ("map_ned", "base_link_frd")
        assert there.header.stamp.sec * 10**9 + there.header.stamp.nanosec == when
        assert (there.transform.translation.x, there.transform.translation.y) == (pose.position.x, pose.position.y)
        turned, heading = there.transform.rotation, pose.orientation
        assert (turned.x, turned.y, turned.z, turned.w) == pytest.approx((0.0, 0.0, heading.z, heading.w), abs=1e-12)
    ((_, there),) = lasting
    assert (there.header.frame_id, there.child_frame_id) == ("map", "map_ned")
    turned = there.transform.rotation
    to_map = Rotation.from_quat([turned.x, turned.y, turned.z, turned.w])
    # North is the y of ROS, east its x, and down is against its z.
    np.testing.assert_allclose(to_map.apply(np.eye(3)), [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-12)


@pytest.mark.slow
def test_a_viewer_is_told_what_made_it_of_what(tmp_path: Path) -> None:
    mcap = tmp_path / "view.mcap"
    export(mcap)
    with mcap.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().library == f"ferryid {__version__}"
        (about,) = reader.iter_metadata()
    assert about.name == "ferryid"
    assert about.metadata == {
        "version": __version__, "vessel": "milliampere", "model": MODEL.label, "log": "short",
        "log_sha256": prepared(tmp_path / "out").recording.sha256, "window_s": "1", "smoother": "square",
    }  # fmt: skip


@pytest.mark.slow
def test_without_a_model_the_profile_s_hull_is_the_base(tmp_path: Path) -> None:
    mcap = tmp_path / "view.mcap"
    result = export(mcap, model=None, profile=FERRY)
    found, motion = read(mcap), prepared(tmp_path / "out").motion
    assert "/ferryid/force/model" not in found
    assert result["model"] is None
    left = wrench(found["/ferryid/force/measured"]) - wrench(found["/ferryid/force/base"])
    np.testing.assert_array_equal(wrench(found["/ferryid/force/residual"]), left)
    base = base_force(FERRY, motion, {})
    np.testing.assert_array_equal(wrench(found["/ferryid/force/base"]), base[motion.valid])


@pytest.mark.slow
def test_findings_stand_at_their_times(tmp_path: Path) -> None:
    told = tmp_path / "diagnosis.json"
    findings = (
        finding("wind", [[0.0, 89.5]]),
        finding("payload", [[30.5, 60.25]], onset=30.5, offset=60.25),
        finding("unknown", [[10.0, 20.0], [40.0, 89.0]], probability=0.4),
    )
    told.write_text(json.dumps(diagnosis(*findings)), encoding="utf-8")
    mcap = tmp_path / "view.mcap"
    result = export(mcap, diagnosis=told)
    assert {"topic": "/diagnostics", "type": "diagnostic_msgs/msg/DiagnosticArray", "messages": 6} in result["topics"]
    log = prepared(tmp_path / "out")
    assert log.motion.t[-1] == pytest.approx(89.8)
    messages = read(mcap)["/diagnostics"]
    shown = [((when - log.track.t0_ns) / 1e9, [(s.level, s.name, s.message) for s in m.status]) for when, m in messages]
    hint = "A hint only: A unknown was left out."
    # What lasts until the last second of the log has not ended.
    assert shown == [
        (0.0, [(1, "ferryid: verdict", "partly explained"), (1, "ferryid: Steady wind", "A wind was left out.")]),
        (10.0, [(0, "ferryid: unknown", hint)]),
        (20.0, [(0, "ferryid: unknown", "No longer.")]),
        (30.5, [(1, "ferryid: Payload", "A payload was left out.")]),
        (40.0, [(0, "ferryid: unknown", hint)]),
        (60.25, [(0, "ferryid: Payload", "No longer.")]),
    ]
    values = {one.key: one.value for one in messages[0][1].status[1].values}
    assert values["north"] == "-3 m/s (-3.2 to -2.8)"
    assert values["probability"] == "0.98"
    assert values["held-out error removed, sway"] == "unknown"
    assert values["not separated from"] == "current"
    assert messages[0][1].status[0].hardware_id == "milliampere"


@pytest.mark.slow
def test_findings_can_be_plotted(tmp_path: Path) -> None:
    told = tmp_path / "diagnosis.json"
    some = finding("payload", [[30.5, 60.25]], probability=0.9999, onset=30.5, offset=60.25)
    some["instance"] = "aft deck"
    some["parameters"]["onset"] = {"value": 30.5, "low": 30.0, "high": 31.0, "unit": "s"}
    told.write_text(json.dumps(diagnosis(some)), encoding="utf-8")
    mcap = tmp_path / "view.mcap"
    export(mcap, diagnosis=told)
    found, log = read(mcap), prepared(tmp_path / "out")
    assert [topic for topic in found if topic.startswith("/ferryid/finding/")] == [
        "/ferryid/finding/payload/aft_deck/north"
    ]
    messages = found["/ferryid/finding/payload/aft_deck/north"]
    at = np.array([when - log.track.t0_ns for when, _ in messages]) / 1e9
    np.testing.assert_allclose(at, [*range(90), 89.8])
    acts = (at >= 30.5) & (at <= 60.25)
    np.testing.assert_array_equal([one.data for _, one in messages], np.where(acts, -3.0, np.nan))
    (status,) = found["/diagnostics"][1][1].status
    # As the report says it: a probability of 1 nobody has.
    assert {one.key: one.value for one in status.values}["probability"] == "above 0.99"


@pytest.mark.slow
def test_ferryid_reads_it(tmp_path: Path) -> None:
    mcap = tmp_path / "view.mcap"
    result = export(mcap)
    found = inspect(str(mcap), None)
    counts = {topic["name"]: topic["count"] for topic in found["topics"]}
    assert counts == {one["topic"]: one["messages"] for one in result["topics"]}
    # The same log gives the same bytes.
    again = tmp_path / "again.mcap"
    export(again)
    assert again.read_bytes() == mcap.read_bytes()


@pytest.mark.slow
def test_a_diagnosed_model_is_held_against_the_log(tmp_path: Path) -> None:
    mcap = tmp_path / "view.mcap"
    result = export(mcap, model=MODELS["conditions"])
    assert "/ferryid/force/model" in read(mcap)
    assert any("conditions are those of one log" in told for told in result["warnings"])


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ("[", "not readable as a diagnosis"),
        (json.dumps([]), "schema"),
        (json.dumps({"schema": "ferryid.model/1"}), "its schema is 'ferryid.model/1'"),
        (json.dumps({**diagnosis(), "schema": "ferryid.diagnosis/2"}), "ferryid.diagnosis/2"),
        (json.dumps(diagnosis(log="other")), "found other"),
        (json.dumps({"schema": "ferryid.diagnosis/1", "logs": [diagnosis(), diagnosis()]}), "found short, short"),
        (json.dumps({"schema": "ferryid.diagnosis/1"}), "KeyError"),
        (json.dumps({"schema": "ferryid.diagnosis/1", "logs": 3}), "TypeError"),
    ],
)
def test_what_is_no_diagnosis_of_this_log(tmp_path: Path, data: str, told: str) -> None:
    path = tmp_path / "diagnosis.json"
    path.write_text(data, encoding="utf-8")
    with pytest.raises(FerryIdError, match="Fix:") as caught:
        read_diagnosis(path, "short")
    assert told in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_diagnosis_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"gone.json: no such file, a diagnosis was to be read\. Fix: ") as caught:
        read_diagnosis(tmp_path / "gone.json", "short")
    assert "Errno" not in str(caught.value)


def test_a_damaged_finding_is_told(tmp_path: Path) -> None:
    path = tmp_path / "diagnosis.json"
    with pytest.raises(FerryIdError, match="KeyError: 'says'"):
        told_by(path, diagnosis({key: v for key, v in finding("wind", []).items() if key != "says"}), 100.0)
    several = {"schema": "ferryid.diagnosis/1", "logs": [diagnosis(log="other"), diagnosis(finding("wind", []))]}
    path.write_text(json.dumps(several), encoding="utf-8")
    assert [one.time_s for one in told_by(path, read_diagnosis(path, "short"), 100.0)] == [0.0, 0.0]


@pytest.mark.slow
def test_places_that_will_not_do(tmp_path: Path) -> None:
    (tmp_path / "log.mcap").write_bytes(LOG.read_bytes())
    (tmp_path / "there.mcap").write_bytes(b"\x89MCAP0\r\n")
    folder = tmp_path / "recording"
    folder.mkdir()
    for log, mcap, options, told in (
        (LOG, "view.bag", {}, "end the name in .mcap"),
        (tmp_path / "log.mcap", "log.mcap", {"overwrite": True}, "cannot take the place of what it is made from"),
        (LOG, "there.mcap", {}, "exists already"),
        (folder, "recording/view.mcap", {}, "lies in the log"),
    ):
        with pytest.raises(FerryIdError, match=told):
            export(tmp_path / mcap, log, **options)
    for there in (b"\x89MCAP0\r\n", LOG.read_bytes()):
        (tmp_path / "there.mcap").write_bytes(there)
        with pytest.raises(FerryIdError, match=r"there.mcap: cannot be replaced, found no export. Fix: "):
            export(tmp_path / "there.mcap", overwrite=True)
        assert (tmp_path / "there.mcap").read_bytes() == there
    export(tmp_path / "again.mcap")
    export(tmp_path / "again.mcap", overwrite=True)
    assert not list(tmp_path.glob(".*.part"))
    other = replace(MODEL, profile_text=load_profile("gunnerus").text)
    with pytest.raises(FerryIdError, match="does not apply to milliampere"):
        export(tmp_path / "view.mcap", model=other, profile=FERRY)
    with pytest.raises(FerryIdError, match="Fix: give --model or --vessel"):
        export(tmp_path / "view.mcap", model=None)
