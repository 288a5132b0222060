"""Alignment: what lies on the grid was measured, and nothing else does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import ferryid
from ferryid.errors import FerryIdError
from ferryid.ingest.clocks import ClockReport
from ferryid.signals.align import align
from ferryid.signals.faults import find_faults
from ferryid.signals.recording import record
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.track import Track, segments
from ferryid.vessel import load_profile

Floats = NDArray[np.float64]

START_NS = 1_700_000_000_123_456_789
PROFILE = load_profile("milliampere")


def stream(topic: str, time_s: Floats, columns: Mapping[str, Floats]) -> Stream:
    time_ns = START_NS + np.round(np.asarray(time_s) * 1e9).astype(np.int64)
    clock = ClockReport("receive", len(time_ns), float("nan"), float("nan"), float("nan"), 0.0, 0, 0, 0)
    return Stream(topic, time_ns, columns, clock, time_ns)


def recording(*streams: Stream) -> Recording:
    return Recording("trial", (), "", "", "", {s.topic: s for s in streams}, (), (), {}, {}, ())


def navigation(time_s: Floats, **columns: Floats) -> Stream:
    t = np.asarray(time_s)
    every = {"psi": 0.01 * t, "u": 0.1 * t, "v": -0.02 * t, "r": 0.01 + 1e-4 * t}
    return stream("/navigation", t, {**every, **columns})


def thrusters(time_s: Floats, **columns: Floats) -> Stream:
    t = np.asarray(time_s)
    every = {
        "n_thruster1": 3.0 * t,
        "alpha_thruster1": 0.01 * t,
        "n_thruster2": 100.0 + t,
        "alpha_thruster2": 0.5 - 0.001 * t,
    }
    return stream("/thrusters", t, {**every, **columns})


def absolute(track: Track) -> Floats:
    """Seconds of the grid since START_NS."""
    return (track.t0_ns - START_NS) * 1e-9 + track.t


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    nav_rate=st.floats(4.0, 18.0),
    act_rate=st.floats(4.0, 30.0),
    grid=st.sampled_from([None, 3.0, 10.0, 20.0]),
)
def test_straight_lines_survive_any_rate_jitter_and_offset(
    seed: int, nav_rate: float, act_rate: float, grid: float | None
) -> None:
    rng = np.random.default_rng(seed)

    def jittered(rate: float) -> Floats:
        steps = rng.uniform(0.6, 1.4, int(20 * rate)) / rate
        return np.cumsum(steps) + rng.uniform(0, 1)

    track = align(recording(navigation(jittered(nav_rate)), thrusters(jittered(act_rate))), PROFILE, grid)
    t = absolute(track)
    assert track.valid.all()
    for name, line in {"u": 0.1 * t, "v": -0.02 * t, "n_thruster1": 3.0 * t, "psi": 0.01 * t}.items():
        # Times are whole nanoseconds, so that lines are kept to about 1e-9 s times their slope.
        np.testing.assert_allclose(track.columns[name], line, rtol=0, atol=2e-8)


def test_samples_of_a_regular_stream_are_kept_bit_for_bit() -> None:
    t = np.arange(200) / 20
    u = np.random.default_rng(0).normal(size=200)
    track = align(recording(navigation(t, u=u), thrusters(t - 0.013)), PROFILE)
    assert track.rate_hz == 20.0
    first = round(absolute(track)[0] * 20)
    np.testing.assert_allclose(track.columns["u"], u[first : first + track.t.size], rtol=0, atol=1e-7)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), gaps=st.lists(st.tuples(st.floats(2, 40), st.floats(0.1, 4)), max_size=3))
@example(seed=0, gaps=[(10.0, 0.25), (20.0, 0.6), (30.0, 1.5)])
def test_no_row_is_valid_inside_a_gap_and_every_other_is(seed: int, gaps: list[tuple[float, float]]) -> None:
    rng = np.random.default_rng(seed)
    kept = {}
    for what in ("navigation", "thrusters"):
        t = np.arange(0, 50, 0.1) + rng.uniform(-0.02, 0.02, 500)
        for start, length in gaps:
            shift = rng.uniform(0, 3)
            t = t[(t < start + shift) | (t > start + shift + length)]
        kept[what] = t
    track = align(recording(navigation(kept["navigation"]), thrusters(kept["thrusters"])), PROFILE, 10.0)
    expected = np.ones(track.t.size, dtype=bool)
    for times in kept.values():
        for i, now in enumerate(absolute(track)):
            before, after = times[times <= now + 1e-6], times[times >= now - 1e-6]
            # Brute force: between neighbours that are further apart than 0.5 s (3 periods are 0.3 s) nothing is known.
            expected[i] &= before.size > 0 and after.size > 0 and after[0] - before[-1] <= 0.5
    np.testing.assert_array_equal(track.valid, expected)
    lost = int((~expected).sum())
    assert any(f"{lost} of {expected.size} rows" in said for said in track.repairs) == (lost > 0)


def test_the_heading_turns_through_north_without_a_jump() -> None:
    t = np.arange(0, 60, 0.1)
    heading = 0.7 * t
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    track = align(recording(navigation(t, psi=wrapped), thrusters(t)), PROFILE, 7.0)
    turns = (track.columns["psi"] - 0.7 * absolute(track)) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-7)


def test_the_wind_is_never_interpolated_through_the_wrap_of_its_direction() -> None:
    t = np.arange(0, 60, 0.1)
    astern = np.where(np.arange(t.size) % 2 == 0, np.pi - 0.01, -np.pi + 0.01)
    wind = stream("/wind", t + 0.05, {"wind_speed": np.full(t.size, 5.0), "wind_from": astern})
    still = navigation(t, psi=0 * t, u=1e-9 * t, v=1e-9 * t)
    track = align(recording(still, thrusters(t), wind), PROFILE, 10.0)
    known = np.isfinite(track.columns["wind_N"])
    # Wind from astern with the bow to the north goes north, at full strength at every row.
    np.testing.assert_allclose(track.columns["wind_N"][known], 5.0, atol=0.01)
    assert known.mean() > 0.98


def test_a_fast_stream_is_averaged_so_that_its_noise_does_not_fold_down() -> None:
    t = np.arange(0, 60, 0.01)
    hum = np.sin(2 * np.pi * 9.9 * t)
    track = align(recording(navigation(t, u=hum), thrusters(t)), PROFILE, 10.0)
    # Sampled at 10 Hz, a hum of 9.9 Hz would be a swell of 0.1 Hz with the same amplitude.
    assert np.abs(track.columns["u"]).max() < 0.15
    assert any("averaged" in said for said in track.repairs)


@pytest.mark.parametrize("rate", [40.0, 60.0, 80.0, 100.0])
def test_averaging_delays_nothing(rate: float) -> None:
    t = np.arange(0, 30, 1 / rate)
    track = align(recording(navigation(t), thrusters(t)), PROFILE, 20.0)
    np.testing.assert_allclose(track.columns["u"], 0.1 * absolute(track), rtol=0, atol=2e-8)


def test_an_order_holds_until_the_next_one() -> None:
    t = np.arange(0, 20, 0.1)
    orders = stream("/orders", np.arange(0, 20, 0.4), {"n_cmd_thruster1": np.arange(50.0)})
    track = align(recording(navigation(t), thrusters(t), orders), PROFILE, 10.0)
    expected = np.floor((absolute(track) + 1e-6) / 0.4)
    np.testing.assert_array_equal(track.columns["n_cmd_thruster1"], expected)


def test_an_order_without_feedback_is_followed_as_the_profile_states_and_not_through_a_gap() -> None:
    """Rows on which what was ordered before is not known, for a delay of 0.5 s after a gap, are left out and counted."""
    signals = [
        replace(one, time_constant_s=0.4, delay_s=0.5) if one.quantity == "thruster1.speed.command" else one
        for one in PROFILE.signals
        if one.quantity != "thruster1.speed"
    ]
    late = replace(PROFILE, signals=tuple(signals))
    t = np.arange(0, 40, 0.1)
    kept = t[(t < 15.0) | (t > 20.0)]
    orders = stream("/orders", kept, {"n_cmd_thruster1": 10.0 * kept})
    track = align(recording(navigation(t), thrusters(t, n_thruster1=0.0 * t), orders), late, 10.0)
    now, state = absolute(track), track.columns["n_cmd_thruster1"]
    settled = (now > 5.0) & (now < 15.0 - 1e-6)
    np.testing.assert_allclose(state[settled], 10.0 * (now[settled] - 0.9), atol=0.01)
    lost = np.flatnonzero(~track.valid)
    assert now[lost[-1]] == pytest.approx(20.0 + 0.5, abs=0.11), "the delay after the gap"
    assert any(f"{lost.size} of" in said and f"n_cmd_thruster1 {lost.size}" in said for said in track.repairs)
    # It stands where the first order after the gap has it, and nowhere on the way from the last one before.
    assert state[lost[-1] + 1] == pytest.approx(10.0 * 20.1, abs=1.1)


def test_actuators_published_on_change_hold_across_any_time_and_it_is_said() -> None:
    t = np.arange(0, 60, 0.1)
    times = np.array([0.0, 0.1, 0.2, 7.0, 7.1, 7.2, 20.0, 20.1, 20.2, 41.0, 41.1, 41.2])
    sparse = {"n_thruster1": np.arange(12.0) * 50}
    steady = {"alpha_thruster1": 0 * t, "n_thruster2": 0 * t, "alpha_thruster2": 0 * t}
    track = align(recording(navigation(t), stream("/changes", times, sparse), stream("/rest", t, steady)), PROFILE)
    now = absolute(track)
    assert track.valid.all()
    assert now[-1] > 59.0
    np.testing.assert_array_equal(
        track.columns["n_thruster1"], sparse["n_thruster1"][np.searchsorted(times, now + 1e-6, "right") - 1]
    )
    assert any("published when it changes" in said and "20.8 s" in said for said in track.repairs)


@pytest.mark.parametrize(
    ("rate", "expected"), [(100.0, 20.0), (20.0, 20.0), (9.03, 9.0), (9.97, 10.0), (2.0, 2.0), (0.9, 0.9)]
)
def test_the_grid_takes_the_rate_of_the_velocity_up_to_20_hz(rate: float, expected: float) -> None:
    t = np.arange(0, 60, 1 / rate)
    track = align(recording(navigation(t), thrusters(np.arange(0, 60, 0.05))), PROFILE)
    assert track.rate_hz == expected


def test_messages_that_come_in_bursts_do_not_raise_the_rate() -> None:
    t = np.repeat(np.arange(0, 60, 0.5), 5) + np.tile(np.arange(5) * 0.001, 120)
    track = align(recording(navigation(t), thrusters(t)), PROFILE)
    assert track.rate_hz == 10.0


def test_a_single_spike_is_taken_out_and_counted_and_the_callers_data_stay() -> None:
    t = np.arange(0, 60, 0.1)
    u = 0.1 * np.sin(t)
    wild = u.copy()
    wild[300] = 25.0
    kept = wild.copy()
    track = align(recording(navigation(t, u=wild), thrusters(t)), PROFILE)
    assert np.abs(track.columns["u"]).max() < 0.11
    assert track.valid.all()
    assert any(said.startswith("u: 1 of 600 samples is a single implausible spike") for said in track.repairs)
    np.testing.assert_array_equal(wild, kept)


def test_a_navigation_that_repeats_itself_while_moving_is_no_measurement() -> None:
    t = np.arange(0, 60, 0.1)
    rng = np.random.default_rng(1)
    columns = {name: rng.normal(1.0, 0.1, t.size) for name in ("u", "v", "r", "psi")}
    for values in columns.values():
        values[200:230] = values[200]
    track = align(recording(stream("/navigation", t, columns), thrusters(t)), PROFILE)
    assert not track.valid[205:228].any()
    assert track.valid[:200].all()
    assert any("29 of 600 messages repeat an old measurement" in said for said in track.repairs)
    (held,) = find_faults(recording(stream("/navigation", t, columns), thrusters(t))).repeats
    assert (held.end_ns - held.start_ns) * 1e-9 == pytest.approx(3.0)


def test_one_velocity_that_is_stuck_is_no_measurement() -> None:
    t = np.arange(0, 60, 0.1)
    u = 0.5 + 0.2 * np.sin(t)
    u[200:250] = u[200]
    track = align(recording(navigation(t, u=u), thrusters(t)), PROFILE)
    assert not track.valid[202:248].any()
    assert any("u: 49 of 600 samples repeat an old one to the last digit" in said for said in track.repairs)


def test_missing_numbers_are_bridged_when_short_and_left_out_when_long() -> None:
    t = np.arange(0, 60, 0.1)
    u = 0.1 * t
    u[100:103] = np.nan
    u[300:320] = np.nan
    track = align(recording(navigation(t, u=u), thrusters(t)), PROFILE)
    assert track.valid[99:104].all()
    np.testing.assert_allclose(track.columns["u"][100:103], 0.1 * t[100:103], atol=1e-8)
    assert not track.valid[300:320].any()
    assert track.valid.sum() == t.size - 20
    assert any("u: 23 of 600 samples are missing" in said for said in track.repairs)


def test_times_of_navigation_and_actuators_must_overlap() -> None:
    t = np.arange(0, 60, 0.1)
    with pytest.raises(FerryIdError, match=r"trial: navigation and actuators do not overlap.*40\.1 s apart. Fix: "):
        align(recording(navigation(t), thrusters(t + 100)), PROFILE)


def test_a_velocity_without_a_number_is_refused() -> None:
    t = np.arange(0, 60, 0.1)
    with pytest.raises(FerryIdError, match=r"trial: v has no value.*NaN throughout.*Fix: "):
        align(recording(navigation(t, v=np.full(t.size, np.nan)), thrusters(t)), PROFILE)


def test_a_log_without_actuators_or_navigation_is_refused() -> None:
    t = np.arange(0, 60, 0.1)
    with pytest.raises(FerryIdError, match=r"trial: no actuator signal.*Fix: "):
        align(recording(navigation(t)), PROFILE)
    with pytest.raises(FerryIdError, match=r"trial: no navigation signal.*Fix: "):
        align(recording(thrusters(t)), PROFILE)


def test_one_row_and_a_time_that_stands_still_are_called_that() -> None:
    one = np.array([3.0])
    with pytest.raises(FerryIdError, match=r"trial: /navigation holds one row only, .* Fix: use a longer log"):
        align(recording(navigation(one), thrusters(one)), PROFILE)
    still = replace(navigation(one), clock=replace(navigation(one).clock, dropped=99, duplicates=99))
    with pytest.raises(
        FerryIdError, match=r"time does not advance, found 100 messages on /navigation with the same time"
    ):
        align(recording(still, thrusters(one)), PROFILE)


def test_only_one_module_says_that_time_does_not_advance() -> None:
    texts = {path.stem: path.read_text(encoding="utf-8") for path in Path(ferryid.__path__[0]).rglob("*.py")}
    assert [name for name, text in texts.items() if "does not advance" in text] == ["sampling"]
    assert all(len(text.splitlines()) < 400 for name, text in texts.items() if name in ("align", "source", "grid"))


def test_alternating_gaps_leave_nothing_and_are_refused() -> None:
    t = np.arange(0, 60, 0.1)
    even = (t // 2) % 2 == 0
    with pytest.raises(FerryIdError, match=r"never measured at the same time, found u .* %.*Fix: "):
        align(recording(navigation(t[even]), thrusters(t[~even])), PROFILE)


def test_segments_are_the_unbroken_stretches() -> None:
    flags = np.array([1, 1, 0, 1, 0, 0, 1, 1, 1], dtype=bool)
    assert segments(flags) == [slice(0, 2), slice(3, 4), slice(6, 9)]
    assert segments(np.zeros(3, dtype=bool)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("log", "vessel", "rate_hz", "share", "said"),
    [
        (
            "gunnerus/RVG_ManeuveringTests.csv",
            "gunnerus",
            2.0,
            0.9,
            "interpolated the wrong way round between 359° and 1°",
        ),
        ("milliampere1", "milliampere-2025", 20.0, 0.98, "gaps longer than 0.50 s"),
        (
            "vtec_usv/48000_2016-02-11-10-52-07.bag",
            "vtec-usv",
            9.0,
            1.0,
            "averaged over the intervals of the 9 Hz grid",
        ),
        ("kvlcc2/HSVA_CPMC_KVLCC2_Z_20_10_P.dat", "kvlcc2-model", 20.0, 1.0, "n_propeller: never changes"),
        (
            "esso_osaka/random/random_03-Aug-2020_11_04_37.csv",
            "esso-osaka",
            10.0,
            1.0,
            "psi: 1296 of 8073 samples repeat",
        ),
    ],
)
def test_real_recordings_align(
    shared_data: Callable[[str], Path], log: str, vessel: str, rate_hz: float, share: float, said: str
) -> None:
    profile = load_profile(vessel)
    track = align(record(shared_data(log), profile), profile)
    assert track.rate_hz == rate_hz
    assert track.valid.mean() >= share
    assert any(said in sentence for sentence in track.repairs)
    for name in ("u", "v", "r"):
        assert np.isfinite(track.columns[name][track.valid]).all()


def test_a_desired_pose_holds_until_the_next_and_is_no_actuator() -> None:
    t = np.arange(0.0, 60.0, 0.05)
    # A new goal every 10 s, the heading once through a full turn.
    goals = np.arange(0.0, 60.0, 10.0)
    wanted = stream("/goal", goals, {"x_d": 5.0 * goals, "psi_d": np.array([3.0, 3.1, -3.1, -3.0, -2.9, -2.8])})
    track = align(recording(navigation(t), thrusters(t), wanted), PROFILE)
    at = absolute(track)
    np.testing.assert_allclose(track.columns["x_d"], 50.0 * np.floor(at / 10.0 + 1e-9))
    turned = track.columns["psi_d"][(at > 25.0) & (at < 29.0)]
    np.testing.assert_allclose(turned, 2 * np.pi - 3.1)
    assert track.valid.all()
    with pytest.raises(FerryIdError, match="no actuator signal to align"):
        align(recording(navigation(t), wanted), PROFILE)
