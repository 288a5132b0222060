"""Positions that no sensor measured: a draft says so, and takes those of a receiver where it gave enough."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.draft import Answers, Draft, draft_profile, draft_text
from ferryid.draft.mapped import MappedSignal
from ferryid.draft.write import as_json, as_text
from ferryid.signals import artificial
from tests.draft.test_draft import FIXTURES, Columns, sailed

SUMMED = "each step of its positions is the speed of /nav times one length of time to the last digit"


def written(folder: Path, until_s: float, *, away_m: float = 0.0, geodetic: bool = True, rate_hz: int = 2) -> Path:
    """Write a trial whose positions are the sum of its velocities, or `away_m` from it, beside a receiver's.

    The receiver repeats its last position from `until_s` on.
    """
    c = sailed()
    rng = np.random.default_rng(7)
    seen = c["t"][:: 10 // rate_hz]
    at = np.minimum(seen, until_s)
    north, east = (
        np.interp(at, c["t"], c[name]) + 0.02 * np.interp(at, seen, rng.normal(size=seen.size)) for name in ("N", "E")
    )
    tables: dict[str, Columns] = {
        "nav": {name: c[name] + (away_m * rng.normal(size=c["t"].size) if name in "NE" else 0.0) for name in
                ("t", "N", "E", "psi", "u", "v", "r")},
        "motors": {"t": c["t"], "rudder": c["rudder"], "rpm": c["n"]},
    }  # fmt: skip
    if geodetic:
        longitude = 10.4 + np.degrees(east / (6.371e6 * np.cos(np.radians(63.4))))
        tables["gps"] = {"t": seen, "latitude": 63.4 + np.degrees(north / 6.371e6), "longitude": longitude}
    folder = folder / "log"
    folder.mkdir()
    for name, columns in tables.items():
        header = ",".join(columns)
        np.savetxt(
            folder / f"{name}.csv", np.column_stack([*columns.values()]), "%.15g", ",", header=header, comments=""
        )
    return folder


def position(log: Path) -> tuple[Draft, MappedSignal]:
    draft = draft_profile(log)
    return draft, next(one for one in draft.every if one.quantity == "position")


def test_a_receiver_is_taken_in_place_of_reckoned_positions(tmp_path: Path) -> None:
    draft, found = position(written(tmp_path, until_s=240.0))
    assert (found.topic, found.fields, found.frame) == ("/gps", ("latitude", "longitude"), "geodetic")
    assert not found.doubts
    said = f"/nav: N, E is not taken: {SUMMED}"
    assert any(one.startswith(said) for one in found.evidence)
    assert f"# {said[0].upper()}{said[1:]}" in draft_text(draft, Answers("boat"))


def test_measured_positions_stay_beside_a_slower_receiver(tmp_path: Path) -> None:
    _, found = position(written(tmp_path, until_s=240.0, away_m=0.002))
    assert (found.topic, found.fields) == ("/nav", ("N", "E"))
    assert not [one for one in (*found.evidence, *found.doubts) if "measured" in one or "not taken" in one]


@pytest.mark.parametrize(
    ("until_s", "rate_hz", "few"),
    [(8.0, 2, "17 positions in 8 s"), (24.0, 2, "49 positions in 24 s"), (10.0, 10, "101 positions in 10 s")],
)
def test_reckoned_positions_beside_a_receiver_of_few_fixes_are_to_be_checked(
    tmp_path: Path, until_s: float, rate_hz: int, few: str
) -> None:
    draft, found = position(written(tmp_path, until_s, rate_hz=rate_hz))
    assert (found.topic, found.fields) == ("/nav", ("N", "E"))
    assert found.doubts[0].startswith(f"{SUMMED}: they are simulated, or reckoned")
    assert found.doubts[0].endswith(f"/gps: latitude, longitude has {few}, too few to take it instead")
    text = draft_text(draft, Answers("boat"))
    assert f"# CHECK: {found.doubts[0]}." in text
    assert f"check: {found.doubts[0]}\n" in as_text(draft, "vessel.toml", text)
    assert found.doubts[0] in as_json(draft, "vessel.toml", text)["signals"][0]["check"]


def test_reckoned_positions_alone_are_to_be_checked(tmp_path: Path) -> None:
    _, found = position(written(tmp_path, until_s=0.0, geodetic=False))
    assert found.doubts[0].startswith(SUMMED)
    assert found.doubts[0].endswith("the log has no other position")


def test_a_part_of_a_log_in_which_the_receiver_has_no_fix(tmp_path: Path) -> None:
    log = written(tmp_path, until_s=100.0)
    assert position(log)[1].topic == "/gps"
    found = next(one for one in draft_profile(log, ranges=((120.0, 240.0),)).every if one.quantity == "position")
    assert found.topic == "/nav"


@pytest.mark.parametrize("frame", ["NED", "ENU"])
def test_positions_along_the_heading_are_to_be_checked(tmp_path: Path, frame: str) -> None:
    c = sailed()
    step = 0.1 * c["u"]
    first, second = np.cumsum(step * np.cos(c["psi"])), np.cumsum(step * np.sin(c["psi"]))
    if frame == "ENU":
        first, second = second, first
    columns = {"t": c["t"], "x": first, "y": second, "heading": c["psi"], "rpm": c["n"]}
    path = tmp_path / "trial.csv"
    np.savetxt(path, np.column_stack([*columns.values()]), "%.15g", ",", header=",".join(columns), comments="")
    _, found = position(path)
    assert found.doubts[0].startswith("each step of its positions points along the heading to the last digit")


def test_messages_of_a_simulator_are_to_be_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    log = FIXTURES / "short.mcap"
    assert draft_profile(log).remarks == ()
    monkeypatch.setattr(artificial, "SIMULATORS", ("nav_msgs/",))
    (remark,) = draft_profile(log).remarks
    assert remark.startswith(
        "it is no recording of a vessel: its topic /navigation/odometry holds messages of a simulator"
    )
