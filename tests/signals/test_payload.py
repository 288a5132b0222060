"""A payload on the grid: held as it was measured, not smoothed, and never invented."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest.clocks import ClockReport
from ferryid.signals.align import align
from ferryid.signals.data_quality import data_quality
from ferryid.signals.parquet import unit_of
from ferryid.signals.smooth import SMOOTHERS, measure, smooth_measured
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.track import Motion, Track
from ferryid.vessel import load_profile

PROFILE = load_profile("milliampere")
START_NS = 1_700_000_000_123_456_789
EVERY = np.arange(0.0, 60.0, 0.1)


def stream(topic: str, time_s: np.ndarray, **columns: np.ndarray) -> Stream:
    time_ns = START_NS + np.round(time_s * 1e9).astype(np.int64)
    clock = ClockReport("receive", len(time_ns), float("nan"), float("nan"), float("nan"), 0.0, 0, 0, 0)
    return Stream(topic, time_ns, columns, clock, time_ns)


def recording(load: Stream) -> Recording:
    t = EVERY
    navigation = stream("/navigation", t, psi=0.01 * t, u=0.1 * t, v=-0.02 * t, r=0.01 + 1e-4 * t)
    thrusters = stream(
        "/thrusters",
        t,
        n_thruster1=3 * t,
        alpha_thruster1=0.01 * t,
        n_thruster2=100 + t,
        alpha_thruster2=0.5 - 0.001 * t,
    )
    every = {one.topic: one for one in (navigation, thrusters, load)}
    return Recording("trial", (), "", "", "", every, (), (), {}, {}, ())


def absolute(track: Track) -> np.ndarray:
    """Seconds of the grid since START_NS."""
    return (track.t0_ns - START_NS) * 1e-9 + track.t


def trial(**columns: np.ndarray) -> Track:
    """Two minutes at 20 Hz."""
    t = np.arange(2400) / 20.0
    every = {
        "x": t,
        "y": 0.5 * t,
        "psi": 0.1 * t,
        "u": 0.5 + 0.2 * np.sin(0.3 * t),
        "v": 0.1 * np.cos(0.2 * t),
        "r": 0.1 * np.sin(0.15 * t),
        "n_thruster1": 400 + 100 * np.sin(0.1 * t),
        "alpha_thruster1": 0.3 * np.sin(0.2 * t),
        "n_thruster2": 300 + 0 * t,
        "alpha_thruster2": 0.2 + 0 * t,
        **columns,
    }
    return Track("trial", t, 0, 20.0, every, np.ones(2400, dtype=bool), ())


def aligned(time_s: np.ndarray, mass: np.ndarray, x: np.ndarray | None = None) -> Track:
    place = np.full(len(mass), 0.5) if x is None else x
    load = stream("/payload/waterline", time_s, payload_kg=mass, payload_x=place)
    return align(recording(load), PROFILE, 10.0)


def motion(**columns: np.ndarray) -> Motion:
    return smooth_measured(measure(trial(**columns), PROFILE), 1.0)


def test_holds_between_samples_however_far_apart() -> None:
    track = aligned(np.array([-3.0, 20.05, 50.0]), np.array([0.0, 400.0, 320.0]), np.array([0.0, 1.0, 0.5]))
    t = absolute(track)
    np.testing.assert_array_equal(track.columns["payload_kg"], np.select([t < 20.05, t < 49.999], [0.0, 400.0], 320.0))
    np.testing.assert_array_equal(track.columns["payload_x"], np.select([t < 20.05, t < 49.999], [0.0, 1.0], 0.5))
    assert track.valid.all()
    assert "/payload/waterline: each value holds until the next, at most for 29.9 s." in track.repairs
    assert not any("gaps" in said or "implausible" in said for said in track.repairs)


def test_weighed_once_is_enough() -> None:
    track = aligned(np.array([-100.0]), np.array([150.0]))
    assert (track.columns["payload_kg"] == 150.0).all()


def test_nothing_is_known_before_the_first_sample() -> None:
    track = aligned(np.array([5.0, 6.0]), np.array([100.0, 100.0]))
    known = np.isfinite(track.columns["payload_kg"])
    np.testing.assert_array_equal(known, absolute(track) > 4.999)


def test_a_fast_scale_is_not_averaged_over_a_step() -> None:
    fast = np.arange(0.0, 60.0, 0.01)
    track = aligned(fast, np.where(fast < 30.0, 0.0, 400.0))
    assert set(track.columns["payload_kg"].tolist()) == {0.0, 400.0}
    assert not any("averaged" in said for said in track.repairs)


def test_holds_in_a_table_with_everything_else_too() -> None:
    fast = np.arange(0.0, 60.0, 0.01)
    weighed = np.where(fast < 30.0, 0.0, 400.0)
    weighed[np.arange(len(fast)) % 300 != 0] = np.nan
    motion = {"psi": 0.01 * fast, "u": 0.1 * fast, "v": -0.02 * fast, "r": 0.01 + 1e-4 * fast}
    table = stream("/navigation", fast, **motion, payload_kg=weighed, payload_x=np.full(len(fast), 0.2))
    track = align(recording(table), PROFILE, 10.0)
    assert set(track.columns["payload_kg"].tolist()) == {0.0, 400.0}
    assert any(
        s == "payload_kg: 5980 of 6000 samples are missing (NaN); the value before holds." for s in track.repairs
    )


def test_boarding_is_no_implausible_step_but_a_wild_sample_is() -> None:
    t = np.arange(0.0, 60.0, 1.0)
    rng = np.random.default_rng(0)
    mass = np.where(t < 30.0, 0.0, 400.0) + rng.normal(0.0, 5.0, len(t))
    wild = mass.copy()
    wild[40] = -5000.0
    track = aligned(t, wild)
    at = np.searchsorted(absolute(track), 40.5)
    assert track.columns["payload_kg"][at] == mass[39]
    assert any(
        s == "payload_kg: 1 of 60 samples is a single implausible spike; removed and held over." for s in track.repairs
    )
    assert not any("steps were found" in said for said in aligned(t, mass).repairs)


@pytest.mark.parametrize("smoother", SMOOTHERS)
def test_a_boarding_step_is_not_smoothed(smoother: str) -> None:
    steps = np.where(np.arange(2400) < 1200, 0.0, 400.0)
    moved = smooth_measured(measure(trial(payload_kg=steps, payload_x=np.full(2400, 0.5)), PROFILE), 1.0, smoother)
    assert moved.payload is not None
    np.testing.assert_array_equal(moved.payload, np.column_stack([steps, np.full(2400, 0.5)]))
    bare = smooth_measured(measure(trial(), PROFILE), 1.0, smoother)
    np.testing.assert_array_equal(moved.nu_dot, bare.nu_dot)
    assert bare.payload is None


def test_range_and_place_are_told_with_units() -> None:
    steps = np.where(np.arange(2400) < 1200, 20.0, 412.0)
    told = motion(payload_kg=steps, payload_x=np.linspace(-0.5, 0.5, 2400)).repairs
    assert "Payload: 20 to 412 kg at x = -0.50 to 0.50 m, which the model knows as mass." in told
    track = aligned(np.array([0.0, 20.0]), np.array([0.0, 400.0]))
    load = stream("/payload/waterline", np.array([0.0, 20.0]), payload_kg=np.array([0.0, 400.0]))
    found = data_quality(recording(load), track)["streams"]["/payload/waterline"]["signals"]
    assert (found["payload_kg"]["minimum"], found["payload_kg"]["maximum"]) == (0.0, 400.0)
    assert (found["payload_kg"]["unit"], unit_of("payload_x")) == ("kg", "m")


def test_rows_without_it_are_left_out_and_counted() -> None:
    late = np.full(2400, 100.0)
    late[:200] = np.nan
    found = motion(payload_kg=late, payload_x=np.zeros(2400))
    assert not found.valid[:200].any()
    assert found.valid[220:2300].all()
    assert "200 rows (10.0 s) are not used: the payload was not measured." in found.repairs
    late[:1200] = np.nan
    seldom = motion(payload_kg=late, payload_x=np.zeros(2400))
    assert seldom.payload is None
    assert "The payload was measured on 50 % of the rows only and is left out." in seldom.repairs


def test_no_load_needs_no_place() -> None:
    mass = np.where(np.arange(2400) < 1200, 0.0, 300.0)
    place = np.where(mass > 0.0, 0.8, np.nan)
    found = motion(payload_kg=mass, payload_x=place)
    assert found.valid[100:2300].all()
    assert found.payload is not None
    np.testing.assert_array_equal(found.payload[[0, -1], 1], [0.0, 0.8])
    assert np.isnan(place[0]), "the caller's array is left alone"


@pytest.mark.parametrize("mass", [-900.0, 400_000.0])
def test_what_no_vessel_carries_is_refused(mass: float) -> None:
    with pytest.raises(FerryIdError, match=r"trial: the payload cannot be right.*vessel of 1670 kg. Fix: correct unit"):
        motion(payload_kg=np.full(2400, mass), payload_x=np.zeros(2400))
