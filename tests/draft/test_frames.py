"""In which frame a position in metres is: as another position, the messages or their type say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from ferryid.draft import draft as drafting
from ferryid.draft import draft_profile
from ferryid.draft.draft import _stated_frame
from ferryid.ingest.log import Topic
from ferryid.vessel import load_profile
from tests.draft.test_draft import FIXTURES, sailed


def odometry_and_receiver(folder: Path, *, mirrored: bool) -> Path:
    """Write a folder of an odometry, in ENU and FLU or in NED and FRD, a receiver of half its rate, and an order."""
    c = sailed()
    # Measured: positions that are the velocities' sum to the last digit would be reckoned.
    c["N"], c["E"] = 1e-3 * np.random.default_rng(5).standard_normal((2, c["t"].size)) + [c["N"], c["E"]]
    latitude, longitude = 63.4 + c["N"] / 111_400.0, 10.4 + c["E"] / (111_400.0 * np.cos(np.radians(63.4)))
    pose = (
        (c["E"], c["N"], 0.5 * np.pi - c["psi"], c["u"], -c["v"])
        if mirrored
        else [c[k] for k in ("N", "E", "psi", "u", "v")]
    )
    for name, header, columns in (
        ("odom", "t,x,y,yaw,u,v", (c["t"], *pose)),
        ("fix", "t,latitude,longitude", (c["t"][::2], latitude[::2], longitude[::2])),
        ("thruster", "t,rpm", (c["t"], c["n"])),
    ):
        np.savetxt(folder / f"{name}.csv", np.column_stack(columns), "%.10g", ",", header=header, comments="")
    return folder


@pytest.mark.parametrize("mirrored", [True, False])
def test_a_geodetic_position_tells_a_chart_from_its_mirror_image(tmp_path: Path, mirrored: bool) -> None:
    draft = draft_profile(odometry_and_receiver(tmp_path, mirrored=mirrored))
    found = {signal.quantity: signal for signal in draft.every}
    assert found["position"].topic == "/odom"
    frames = ("ENU", "ENU", "FLU") if mirrored else ("NED", "NED", "FRD")
    assert tuple(found[name].frame for name in ("position", "heading", "velocity")) == frames
    assert any("/fix: latitude, longitude" in one for one in found["position"].evidence)
    assert not any("mirror image" in one for one in (*found["position"].doubts, *found["heading"].doubts))


@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize("zero_deg", [0.0, 100.0, 180.0])
def test_the_course_shows_how_a_heading_counts_and_where_its_zero_is(
    tmp_path: Path, zero_deg: float, mirrored: bool
) -> None:
    c = sailed()
    latitude, longitude = 63.4 + c["N"] / 111_400.0, 10.4 + c["E"] / (111_400.0 * np.cos(np.radians(63.4)))
    yaw = np.degrees(0.5 * np.pi - c["psi"] if mirrored else c["psi"]) + zero_deg
    rows = np.column_stack([c["t"], latitude, longitude, np.mod(yaw, 360.0), c["n"]])
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, "%.9g", ",", header="t,latitude,longitude,yaw,rpm", comments="")
    found = {signal.quantity: signal for signal in draft_profile(path).every}
    heading = found["heading"]
    assert heading.frame == ("ENU" if mirrored else "NED")
    if zero_deg == 0.0:
        assert any("moves along it" in one for one in heading.evidence)
        assert not any("offset" in one for one in heading.doubts)
        return
    (doubt,) = (one for one in heading.doubts if "offset" in one)
    added = float(doubt.rpartition("= ")[2])
    assert np.cos(np.radians(added + zero_deg)) > np.cos(np.radians(10.0))
    assert any("does not move along its heading as it is read" in one for one in found["position"].evidence)


@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize("zero_deg", [0.0, 90.0])
def test_a_vessel_that_goes_astern_as_much_as_ahead_shows_how_its_heading_counts(
    tmp_path: Path, zero_deg: float, mirrored: bool
) -> None:
    t = np.arange(0.0, 300.0, 0.2)
    psi, u = 0.15 * t + 0.5 * np.sin(t / 9.0), np.sign(np.sin(t / 7.0))
    north, east = (np.cumsum(u * one) * 0.2 for one in (np.cos(psi), np.sin(psi)))
    latitude, longitude = 63.4 + north / 111_400.0, 10.4 + east / (111_400.0 * np.cos(np.radians(63.4)))
    yaw = 0.5 * (0.5 * np.pi - psi if mirrored else psi) + 0.5 * np.radians(zero_deg)
    # A quaternion, by the short names of its parts.
    columns = (t, latitude, longitude, 0.0 * t, 0.0 * t, np.sin(yaw), np.cos(yaw), 100.0 * u)
    path = tmp_path / "log.csv"
    header = "t,latitude,longitude,qx,qy,qz,qw,rpm"
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=header, comments="")
    found = {signal.quantity: signal for signal in draft_profile(path).every}
    heading, position = found["heading"], found["position"]
    assert heading.fields == ("qx", "qy", "qz", "qw")
    assert heading.frame == ("ENU" if mirrored else "NED")
    if zero_deg == 0.0:
        assert any("moves along it, ahead and astern" in one for one in heading.evidence)
        assert any("moves along its heading, ahead and astern" in one for one in position.evidence)
        assert any(f"add offset_deg = {'-' if mirrored else ''}180 if" in one for one in heading.doubts)
        return
    (doubt,) = (one for one in heading.doubts if "offset_deg" in one)
    added = [float(one.split(",")[0].split()[0]) for one in doubt.split("offset_deg = ")[1:]]
    assert sorted(abs(one) for one in added) == pytest.approx([90.0, 90.0], abs=5.0)
    assert sum(added) == pytest.approx(0.0, abs=5.0)


def test_the_messages_may_say_in_which_frame_they_are() -> None:
    """Simulated logs are in NED and FRD, as their headers say."""
    found = {signal.quantity: signal for signal in draft_profile(FIXTURES / "short.mcap").every}
    assert [found[name].frame for name in ("position", "heading", "velocity")] == ["NED", "NED", "FRD"]
    assert any("mirror image" in one and "header.frame_id" in one for one in found["heading"].doubts)


@pytest.mark.parametrize(
    ("names", "frame"),
    [(["local_enu"], "ENU"), (["map"], None), (["ned", "enu"], None), (["ned", "map"], "NED"), ([], None)],
)
def test_a_frame_is_stated_by_one_name(names: list[str], frame: str | None) -> None:
    topic = Topic("/odom", "nav_msgs/msg/Odometry", "cdr", 9, None, None, {"header.frame_id": "string"})
    series = SimpleNamespace(columns={"header.frame_id": np.array(names, dtype=object)})
    reader = cast(Any, SimpleNamespace(read=lambda wanted: dict.fromkeys(wanted, series)))
    stated = _stated_frame(reader, topic)
    assert (None if stated is None else stated[0]) == frame
    assert _stated_frame(reader, replace(topic, fields={"header.frame_id": "float64"})) is None


def test_an_odometry_that_nothing_tells_from_its_mirror_image_is_in_the_frames_of_its_message(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(drafting, "_stated_frame", lambda reader, topic: None)
    found = {signal.quantity: signal for signal in draft_profile(FIXTURES / "short.mcap").every}
    frames = [found[name].frame for name in ("position", "heading", "velocity", "yaw_rate")]
    assert frames == ["ENU", "ENU", "FLU", "FLU"]
    for name in ("position", "heading"):
        assert any("mirror image" in one and "REP 103" in one for one in found[name].doubts)
    found = {
        signal.quantity: signal for signal in draft_profile(FIXTURES / "short.mcap", load_profile("milliampere")).every
    }
    assert [found[name].frame for name in ("position", "heading", "velocity")] == ["NED", "NED", "FRD"]
    assert any("mirror image" in one and "milliampere" in one for one in found["heading"].doubts)
