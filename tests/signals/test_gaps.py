"""Gaps of any length in any signal: the rows in them and beside them are left out, counted, and nothing else changes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid.signals.align import align
from ferryid.signals.mirror import course_against_heading, mirrored
from ferryid.signals.prepare import open_track, smoothed
from ferryid.signals.recording import record
from ferryid.signals.smooth import measure, smooth_measured
from ferryid.simulate.trial import Simulation
from ferryid.vessel import load_profile
from tests.damage import (
    NAVIGATION,
    SURGE,
    SWAY,
    THRUSTER,
    YAW_RATE,
    changed,
    moved,
    repeated,
    silent,
    stuck,
    ten_minutes,
    turned,
    turned_by,
    without_heading,
    written,
    zeros,
)

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
START = 200.0
FAULT = 75.0
"""The ferry moves sideways then, at 0.6 m/s and 17 m off its start."""
MEETS = 22
"""Rows that a moving average of a second and the central difference lose on both sides of a gap at 20 Hz."""


def in_navigation(made: Simulation, gap: tuple[float, float]) -> Simulation:
    return silent(made, NAVIGATION, [gap])


def in_one_thruster(made: Simulation, gap: tuple[float, float]) -> Simulation:
    return silent(made, THRUSTER, [gap])


def in_the_heading(made: Simulation, gap: tuple[float, float]) -> Simulation:
    return without_heading(made, [gap])


@pytest.mark.parametrize("where", [in_navigation, in_one_thruster, in_the_heading])
@pytest.mark.parametrize("seconds", [0.3, 1.0, 5.0, 60.0])
def test_rows_in_and_beside_a_gap_are_left_out_and_counted(
    tmp_path: Path, where: Callable[[Simulation, tuple[float, float]], Simulation], seconds: float
) -> None:
    log = written(where(ten_minutes(), (START, seconds)), tmp_path / "gap.mcap")
    opened = open_track(str(log), FERRY, None)
    prepared = smoothed(opened, 1.0)
    lost = np.flatnonzero(~opened.track.valid)
    if seconds < 0.5:
        assert lost.size == 0  # as long as samples that come late, and interpolated like those
        assert prepared.left_out == ()
        assert any(
            "the longest 0.3" in remark or "short ones are int" in remark for remark in prepared.quality["remarks"]
        )
        return
    assert abs(lost.size - seconds * 20.0) <= 2
    assert np.all(np.diff(lost) == 1)
    measured, beside = opened.measured, prepared.motion
    assert np.isfinite(measured.nu[measured.usable]).all()
    assert np.isfinite(beside.nu_dot[beside.valid]).all()
    assert not beside.valid[lost[0] - MEETS // 2 : lost[-1] + MEETS // 2 + 1].any()
    assert [one.rows for one in beside.left_out] == [lost.size, MEETS]
    (said,) = prepared.left_out
    assert said.startswith(f"{lost.size + MEETS} of 11999 rows (")
    assert f"left out: {lost.size} (" in said
    told = prepared.quality["left_out"]
    assert [(one["reason"], one["rows"], one["stretches"]) for one in told] == [
        (one.reason, one.rows, one.stretches) for one in beside.left_out
    ]
    for one in told:
        lengths = [stretch["end_s"] - stretch["start_s"] for stretch in one["intervals"]]
        assert len(lengths) == one["stretches"]
        assert sum(lengths) == pytest.approx(one["seconds"])
    (gap,) = told[0]["intervals"]
    assert gap["start_s"] == pytest.approx(lost[0] / 20.0)
    assert gap["reason"] == "not measured"
    assert set(gap["signals"]) >= ({"n_thruster1"} if where is in_one_thruster else {"psi"})
    assert any("are not used" in remark for remark in prepared.quality["remarks"])


def test_missing_rows_do_not_spoil_the_search_for_mirrored_frames() -> None:
    t = np.arange(0.0, 600.0, 0.05)
    psi = 0.01 * t
    nu = np.column_stack([1.0 + 0.3 * np.sin(0.05 * t), 0.2 * np.cos(0.07 * t)])
    way = np.cumsum((nu[:, 0] + 1j * nu[:, 1]) * np.exp(1j * psi)) / 20.0
    eta = np.column_stack([way.imag, way.real, psi])
    whole = mirrored(eta, nu, np.ones(t.size, dtype=bool), 20.0)
    for column in (eta, nu):
        column[4000:4020] = np.nan
    usable = np.isfinite(nu).all(axis=1)
    assert mirrored(eta, nu, usable, 20.0)[0] == whole[0] == "position"


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (moved(3.0), "The position jumps farther than the vessel can move, and back, once, by up to 3."),
        (moved(15.0), "The position jumps farther than the vessel can move, and back, once, by up to 15."),
        (zeros, "The position is exactly zero while the vessel is elsewhere once"),
        (repeated, "The position repeats its last value while the vessel moves on once"),
        (turned, "The heading is turned by 180° and back once"),
    ],
)
def test_poses_that_cannot_be_true_are_left_out_and_counted(tmp_path: Path, edit: object, said: str) -> None:
    log = written(changed(ten_minutes(), [(FAULT, 4.0)], edit), tmp_path / "fault.mcap")  # type: ignore[arg-type]
    opened = open_track(str(log), FERRY, None)
    lost = np.flatnonzero(~opened.track.valid) / 20.0
    assert abs(lost.min() - (FAULT - 0.5)) < 0.25
    assert abs(lost.max() - (FAULT + 4.5)) < 0.25
    assert np.isnan(opened.track.columns["psi"][~opened.track.valid]).all()
    assert any(repair.startswith(said) for repair in opened.track.repairs)
    assert "because the pose cannot be true" in smoothed(opened, 1.0).left_out[0]


@pytest.mark.parametrize(
    ("names", "value", "signals"),
    [
        ((SURGE,), 0.0, ("u",)),
        ((SWAY,), 0.0, ("v",)),
        ((SURGE, SWAY, YAW_RATE), 0.0, ("u", "v", "r")),
        ((SURGE, SWAY, YAW_RATE), 0.4, ("u", "v", "r")),
    ],
)
def test_velocities_that_stay_while_the_pose_moves_are_left_out_and_counted(
    tmp_path: Path, names: tuple[str, ...], value: float, signals: tuple[str, ...]
) -> None:
    made = changed(ten_minutes(), [(60.0, 200.0)], stuck(names, value))
    opened = open_track(str(written(made, tmp_path / "stuck.mcap")), FERRY, None)
    (left,) = opened.track.left_out
    assert left.rows == pytest.approx(4000, abs=2)
    (stretch,) = left.intervals
    assert (stretch.start_s, stretch.end_s) == (pytest.approx(60.0, abs=0.1), pytest.approx(260.0, abs=0.1))
    assert set(stretch.signals) == set(signals)
    assert f"stays at {value:g} m/s while the position moves" in stretch.reason
    (said, *_) = (one for one in smoothed(opened, 1.0).left_out if "stays at one while the pose moves" in one)
    assert f"{signals[0]} {left.rows}" in said
    assert any(one.startswith(f"{signals[0]}: the ") and "left out" in one for one in opened.track.repairs)


def test_velocities_that_stay_at_zero_for_half_a_minute_are_found_in_a_noisy_log(tmp_path: Path) -> None:
    # The pose moves by 3.6 m, at 0.12 m/s: three times what it and the velocity usually differ by, in six windows.
    made = changed(ten_minutes(), [(200.0, 30.0)], stuck((SURGE, SWAY, YAW_RATE), 0.0))
    opened = open_track(str(written(made, tmp_path / "stuck.mcap")), FERRY, None)
    (left,) = opened.track.left_out
    assert left.rows == pytest.approx(600, abs=2)
    assert "u 599" in left.reason


def test_a_gap_after_the_first_message_of_the_navigation_is_counted(tmp_path: Path) -> None:
    log = written(silent(ten_minutes(), NAVIGATION, [(0.0, 60.0)]), tmp_path / "begins.mcap")
    opened = open_track(str(log), FERRY, None)
    assert opened.track.left_out[0].seconds == pytest.approx(60.0, abs=0.2)
    assert any("1199 of 11999 rows" in one or "1200 of 12000 rows" in one for one in opened.left_out)


def test_a_heading_that_steps_and_stays_is_a_warning(tmp_path: Path) -> None:
    made = changed(ten_minutes(), [(300.0, 1000.0)], turned_by(10.0))
    opened = open_track(str(written(made, tmp_path / "step.mcap")), FERRY, None)
    assert opened.doubts[0].startswith("The heading steps by 10° at 300.0 s and stays there")
    ((stretch,),) = (one.intervals for one in opened.track.left_out)
    assert (stretch.start_s, stretch.end_s) == (pytest.approx(299.5, abs=0.1), pytest.approx(300.6, abs=0.1))
    assert stretch.signals == ("psi",)
    assert stretch.reason == "the heading steps without a turn of the yaw rate and stays (10°)"


def test_nothing_is_left_out_of_a_clean_trial(tmp_path: Path) -> None:
    opened = open_track(str(written(ten_minutes(), tmp_path / "clean.mcap")), FERRY, None)
    assert opened.track.valid.all()
    assert smoothed(opened, 1.0).left_out == ()


def test_a_part_of_a_real_log_that_begins_with_a_gap_is_read(
    shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    lines = shared_data("gunnerus/RVG_ManeuveringTests.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    part = tmp_path / "first.csv"
    part.write_text("".join(lines[: len(lines) // 4]), encoding="utf-8")
    profile = load_profile("gunnerus")
    motion = smooth_measured(measure(align(record(part, profile), profile), profile), 4.0)
    assert motion.valid.mean() > 0.8
    assert [one.rows > 0 for one in motion.left_out] == [True] * len(motion.left_out)
    assert motion.left_out


def test_a_signal_that_ends_early_is_said_with_the_time_that_is_used(tmp_path: Path) -> None:
    log = written(silent(ten_minutes(), THRUSTER, [(400.0, 1000.0)]), tmp_path / "early.mcap")
    (said,) = (one for one in open_track(str(log), FERRY, None).doubts if "share" in one)
    assert said.startswith(("400.0 s are used", "399.9 s are used"))
    assert f"without the last 200.0 s, as {THRUSTER} ends before" in said


def test_rows_without_a_heading_at_the_end_of_a_log_are_counted(tmp_path: Path) -> None:
    log = written(without_heading(ten_minutes(), [(560.0, 1000.0)]), tmp_path / "end.mcap")
    prepared = smoothed(open_track(str(log), FERRY, None), 1.0)
    said = " ".join(prepared.left_out)
    assert "799 of" in said
    assert "(psi 799)" in said


def test_what_could_not_be_read_is_said_with_the_sum_first() -> None:
    log = Path(__file__).resolve().parents[2] / "fixtures" / "truncated.mcap"
    prepared = smoothed(open_track(str(log), FERRY, None), 1.0)
    assert any("may be lost" in said or "could not be read" in said for said in prepared.left_out)


@pytest.mark.parametrize("straight", [False, True])
def test_a_track_that_was_made_from_the_velocities_is_not_mirrored(straight: bool) -> None:
    """A correlation above one by rounding ended in a KeyError; on one heading without sway every hand is exact."""
    for seed in range(20):
        random, rate = np.random.default_rng(seed), 10.0
        n = 6000
        nu = np.column_stack([1.0 + 0.1 * random.standard_normal(n), 0.1 * random.standard_normal(n)])
        psi = np.cumsum(0.01 * random.standard_normal(n))
        if straight:
            nu[:, 1], psi = 0.0, np.full(n, 0.7)
        way = (nu[:, 0] + 1j * nu[:, 1]) * np.exp(1j * psi) / rate
        place = np.concatenate([[0.0], np.cumsum(way)[:-1]])
        eta = np.column_stack([place.real, place.imag, psi])
        assert mirrored(eta, nu, np.ones(n, dtype=bool), rate) == ("", "")


def test_a_straight_track_to_the_north_turns_no_heading_round() -> None:
    n = 6000
    eta = np.column_stack([0.1 * np.arange(n), np.zeros(n), np.zeros(n)])
    found = course_against_heading(eta, np.ones(n, dtype=bool), 10.0)
    assert found is not None
    assert found.says == ""
