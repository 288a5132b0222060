"""Clocks with a known offset, drift, jitter or reset: what was put in is what is reported, and repaired where it is safe."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ferryid.ingest.clocks import ClockReport, repair_all
from ferryid.ingest.log import Series

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
Times = NDArray[np.int64]


def sender(count: int, rate_hz: float = 20.0) -> Times:
    return START + np.rint(np.arange(count) * (SECOND / rate_hz)).astype(np.int64)


def received(stamps: Times, latency_s: float = 0.005, jitter_s: float = 0.0, seed: int = 0) -> Times:
    noise = np.random.default_rng(seed).normal(0.0, jitter_s, len(stamps)) if jitter_s else np.zeros(len(stamps))
    return stamps + np.rint((latency_s + noise) * SECOND).astype(np.int64)


def series(topic: str, receive: Times, stamp: Times | None) -> Series:
    return Series(topic, receive, stamp, {})


def repair(receive: Times, stamp: Times | None) -> tuple[Times, NDArray[np.int64], ClockReport]:
    return repair_all({"/one": series("/one", receive, stamp)})["/one"]


def test_healthy_stamps_are_used_as_they_are() -> None:
    stamps = sender(2000)
    times, rows, report = repair(received(stamps, 0.012, 0.002), stamps)
    np.testing.assert_array_equal(times, stamps)
    np.testing.assert_array_equal(rows, np.arange(2000))
    assert report.source == "stamp"
    assert report.rate_hz == pytest.approx(20.0)
    assert report.offset_s == pytest.approx(0.012, abs=2e-4)
    assert report.jitter_s == pytest.approx(0.002, rel=0.1)
    assert abs(report.drift_ppm) < 5
    assert (report.resets, report.out_of_order, report.duplicates, report.dropped, report.gaps) == (0, 0, 0, 0, ())
    assert report.notes == ()


def test_topic_without_header_says_so() -> None:
    receive = sender(100)
    times, _, report = repair(receive, None)
    np.testing.assert_array_equal(times, receive)
    assert report.source == "receive"
    assert np.isnan(report.offset_s)
    assert np.isnan(report.drift_ppm)
    assert any("no header" in note for note in report.notes)


@pytest.mark.parametrize("drift_ppm", [-80.0, 0.0, 35.0])
def test_drift_is_measured_under_one_sided_latency(drift_ppm: float) -> None:
    stamps = sender(72_000)  # one hour
    rng = np.random.default_rng(1)
    latency = 0.002 + rng.exponential(0.004, len(stamps))
    late = np.rint((stamps - START) * drift_ppm * 1e-6 + latency * SECOND).astype(np.int64)
    times, _, report = repair(stamps + late, stamps)
    assert report.drift_ppm == pytest.approx(drift_ppm, abs=0.5)
    # More than 50 ms in all is taken out: the times then keep pace with the recorder's clock, not with the sender's.
    paced = np.rint(stamps + (stamps - START) * drift_ppm * 1e-6).astype(np.int64)
    assert np.abs(times - paced).max() < 2_000_000
    assert any("drift" in note for note in report.notes) == (drift_ppm != 0.0)


def test_simulated_time_at_another_speed_is_told_and_kept() -> None:
    stamps = sender(2000)
    receive = START + 2 * (stamps - START)
    times, _, report = repair(receive, stamps)
    np.testing.assert_array_equal(np.diff(times), np.diff(stamps))
    assert any("0.5 times as fast" in note for note in report.notes)


@pytest.mark.parametrize("offset_s", [-86_400.0 * 3000 - 17.25, -40.0, 1.5, 7200.004, 10.0**8])
def test_constant_offset_is_shifted_to_the_recorder(offset_s: float) -> None:
    stamps = sender(500)
    receive = received(stamps, offset_s, 0.001)
    times, _, report = repair(receive, stamps)
    assert report.source == "stamp"
    assert report.offset_s == pytest.approx(offset_s, abs=2e-4)
    np.testing.assert_array_equal(np.diff(times), np.diff(stamps))
    assert abs(float(np.median(receive - times))) < 5e6
    assert report.shift_s == pytest.approx(offset_s, abs=5e-3)
    assert any("shifted" in note for note in report.notes)


def test_a_time_zone_is_shifted_by_whole_quarter_hours() -> None:
    stamps = sender(500)
    times, _, report = repair(received(stamps, 7200.030), stamps)
    assert report.shift_s == 7200.0
    np.testing.assert_array_equal(times, stamps + 7200 * SECOND)


def test_topics_of_one_sender_keep_their_distance() -> None:
    stamps = sender(400)
    fast, slow = received(stamps, 3600.5 + 0.010), received(stamps, 3600.5 + 0.250)
    lone = received(stamps, 0.02)
    repaired = repair_all(
        {
            "/nav": series("/nav", slow, stamps),
            "/rpm": series("/rpm", fast, stamps),
            "/bare": series("/bare", lone, None),
            "/gps": series("/gps", lone, stamps),
        }
    )
    np.testing.assert_array_equal(repaired["/nav"][0], repaired["/rpm"][0])
    assert repaired["/rpm"][2].shift_s == pytest.approx(3600.510)
    assert repaired["/gps"][2].shift_s == 0.0
    np.testing.assert_array_equal(repaired["/bare"][0], lone)


@pytest.mark.parametrize(
    ("stamps", "why"),
    [
        (np.zeros(300, dtype=np.int64), "zero"),
        (np.full(300, START), "the same"),
        (sender(300) // SECOND * SECOND, "repeat"),
        (np.random.default_rng(3).integers(1, START, 300), "make no sense"),
    ],
)
def test_stamps_that_are_no_clock_are_refused(stamps: Times, why: str) -> None:
    receive = received(sender(300))
    times, _, report = repair(receive, stamps)
    assert report.source == "receive"
    np.testing.assert_array_equal(times, receive)
    assert why in report.notes[0]


@pytest.mark.parametrize("step_s", [-500.0, -2.0, 2.0, 86_400.0])
def test_a_senders_clock_set_during_the_recording(step_s: float) -> None:
    true = sender(1000)
    stamps = true.copy()
    stamps[400:] += int(step_s * SECOND)
    receive = received(true, 0.01, 0.001)
    times, _, report = repair(receive, stamps)
    assert report.source == "receive"
    assert report.resets == 1
    np.testing.assert_array_equal(times, receive)
    assert "row 400 of 1000" in report.notes[0]


def test_a_recorders_clock_set_during_the_recording_leaves_stamps_in_use() -> None:
    stamps = sender(1000)
    receive = received(stamps, 0.01)
    receive[600:] -= 90 * SECOND
    times, _, report = repair(receive, stamps)
    assert report.source == "stamp"
    assert report.resets == 1
    np.testing.assert_array_equal(np.diff(times), np.diff(stamps))


def test_a_burst_of_held_up_messages_is_no_reset() -> None:
    stamps = sender(1000)
    receive = received(stamps, 0.01)
    receive[500:560] = np.maximum(receive[500:560], receive[560] + np.arange(60) * 1000)
    times, _, report = repair(receive, stamps)
    assert (report.source, report.resets) == ("stamp", 0)
    np.testing.assert_array_equal(times, stamps)


def test_a_single_late_message_is_no_reset() -> None:
    stamps = sender(1000)
    receive = received(stamps, 0.01)
    receive[400] += 5 * SECOND
    times, _, report = repair(receive, stamps)
    assert (report.source, report.resets, report.replaced) == ("stamp", 0, 0)
    np.testing.assert_array_equal(times, stamps)


def test_single_senseless_stamps_are_replaced_and_counted() -> None:
    stamps = sender(1000)
    receive = received(stamps, 0.01)
    broken = stamps.copy()
    broken[100] += 10**6 * SECOND
    broken[700] = 0
    times, _, report = repair(receive, broken)
    assert (report.source, report.replaced, report.resets) == ("stamp", 2, 0)
    np.testing.assert_array_equal(times, stamps)


WILD = {
    "far future": START + 10**9 * SECOND,
    "far past": -START,
    "zero": 0,
    "negative": -7,
    "near": START + 40 * SECOND,
}


@pytest.mark.parametrize("place", [0, 1, 560, 998, 999])
@pytest.mark.parametrize("wild", ["far future", "far past", "zero", "negative"])
def test_a_stray_receive_time_costs_its_own_row(wild: str, place: int) -> None:
    receive = sender(1000)
    receive[place] = WILD[wild]
    times, rows, report = repair(receive, None)
    np.testing.assert_array_equal(times, np.delete(sender(1000), place))
    np.testing.assert_array_equal(rows, np.delete(np.arange(1000), place))
    assert (report.strays, report.dropped, report.resets, report.out_of_order, report.gaps) == (1, 1, 0, 0, ())
    assert any(f"1 of 1000 rows left out, first row {place + 1}" in note for note in report.notes)


def test_a_stray_inside_the_log_is_no_late_row() -> None:
    receive = sender(1000)
    receive[300] = WILD["near"] + 3
    times, _, report = repair(receive, None)
    np.testing.assert_array_equal(times, np.delete(sender(1000), 300))
    assert (report.strays, report.dropped, report.out_of_order) == (1, 1, 0)


def test_a_row_written_late_fits_the_gap_that_it_left() -> None:
    order = np.concatenate([np.delete(np.arange(400), 100), [100], np.arange(400, 1000)])
    times, rows, report = repair(sender(1000)[order], None)
    np.testing.assert_array_equal(times, sender(1000))
    assert (report.strays, report.dropped, report.out_of_order) == (0, 0, 1)
    assert rows[100] == 399


def test_several_strays_cost_their_own_rows() -> None:
    receive = sender(2000)
    places = [3, 400, 401, 402, 900, 1500, 1501]
    receive[places] = [0, START * 2, 5, -9, START - 10**6 * SECOND, START * 3, START * 3 + 10]
    times, _, report = repair(receive, None)
    np.testing.assert_array_equal(times, np.delete(sender(2000), places))
    assert (report.strays, report.dropped, report.resets) == (7, 7, 0)


def test_a_stray_beside_a_clock_that_was_set_changes_nothing_about_it() -> None:
    receive = sender(1000)
    receive[600:] -= 90 * SECOND
    receive[200] += 10**8 * SECOND
    times, _, report = repair(receive, None)
    np.testing.assert_array_equal(times, np.delete(sender(600), 200))
    assert (report.strays, report.dropped, report.resets) == (1, 401, 1)


def strayed(count: int, strays: int, wild: str, seed: int) -> tuple[Times, Times]:
    """Receive times at 20 Hz with strays at random rows, and the rows that are right."""
    rng = np.random.default_rng(seed)
    receive, places = sender(count), rng.choice(count, strays, replace=False)
    later = {"2 s later": 2 * SECOND, "10 s earlier": -10 * SECOND}
    if wild in later:
        receive[places] += later[wild]
    else:
        receive[places] = 0 if wild == "zero" else rng.integers(0, 2**62, strays)
    return receive, np.setdiff1d(np.arange(count), places)


@pytest.mark.parametrize("wild", ["2 s later", "10 s earlier", "zero", "random"])
@pytest.mark.parametrize("strays", [10, 40, 100, 200, 960])
def test_strays_at_random_rows_cost_their_own_rows(wild: str, strays: int) -> None:
    receive, right = strayed(24_000, strays, wild, seed=strays)
    times, rows, report = repair(receive, None)
    assert np.isin(right, rows).sum() >= 0.999 * len(right)
    # Of strays near by, one that fits the gap which another left cannot be told from a row written late.
    assert len(np.setdiff1d(rows, right)) <= (0.002 * 24_000 if wild == "10 s earlier" else 0)
    assert bool((np.diff(times) > 0).all())
    assert (report.strays, report.resets) == (24_000 - report.count, 0)


@pytest.mark.parametrize("wild", [0, START + 9999 * SECOND, START * 2])
@pytest.mark.parametrize(("count", "run"), [(24_000, 241), (24_000, 480), (1000, 60)])
def test_a_run_of_strays_costs_its_own_rows(count: int, run: int, wild: int) -> None:
    receive = sender(count)
    receive[count // 2 : count // 2 + run] = wild
    _, rows, report = repair(receive, None)
    np.testing.assert_array_equal(rows, np.delete(np.arange(count), np.s_[count // 2 : count // 2 + run]))
    assert (report.strays, report.dropped, report.resets) == (run, run, 0)


@pytest.mark.parametrize("place", [slice(0, 480), slice(-480, None)])
@pytest.mark.parametrize("wild", [0, START * 2])
def test_a_run_of_one_far_time_at_either_end_costs_its_own_rows(place: slice, wild: int) -> None:
    receive = sender(24_000)
    receive[place] = wild
    _, rows, report = repair(receive, None)
    np.testing.assert_array_equal(rows, np.delete(np.arange(24_000), place))
    assert (report.strays, report.resets, report.gaps) == (480, 0, ())


def test_strays_in_two_runs_of_a_clock_leave_the_longer_run() -> None:
    (first, _), (second, right) = (strayed(count, count // 100, "2 s later", count) for count in (9000, 12_000))
    _, rows, report = repair(np.concatenate([first, second]), None)
    np.testing.assert_array_equal(rows, 9000 + right)
    assert (report.strays, report.resets, report.dropped) == (210, 1, 9120)


def test_blocks_of_rows_that_changed_places_are_sorted() -> None:
    order = np.r_[0:400, 500:540, 400:500, 540:2000]
    times, _, report = repair(sender(2000)[order], None)
    np.testing.assert_array_equal(times, sender(2000))
    assert (report.strays, report.dropped) == (0, 0)


@pytest.mark.parametrize("wild", ["far future", "far past", "negative"])
@pytest.mark.parametrize("places", [[400], [400, 401, 402], [0], [999]])
def test_stray_stamps_are_replaced_and_counted(wild: str, places: list[int]) -> None:
    stamps = sender(1000)
    broken = stamps.copy()
    broken[places] = WILD[wild]
    times, rows, report = repair(received(stamps, 0.01), broken)
    assert (report.source, report.replaced, report.resets) == ("stamp", len(places), 0)
    assert len(rows) == 1000
    assert np.abs(times - stamps).max() <= 10_000_000


def test_a_log_with_gaps_and_a_period_of_seconds_has_no_strays() -> None:
    slow = START + np.arange(50) * 30 * SECOND
    slow[25:] += 7200 * SECOND
    _, _, report = repair(slow, None)
    assert (report.strays, report.dropped, report.count) == (0, 0, 50)


def test_out_of_order_and_duplicate_rows() -> None:
    receive = sender(200)
    order = np.arange(200)
    order[[50, 51]] = [51, 50]
    order[120] = 119
    times, rows, report = repair(receive[order], None)
    assert (report.out_of_order, report.duplicates, report.dropped, report.count) == (1, 1, 1, 199)
    np.testing.assert_array_equal(times, np.delete(receive, 120))
    np.testing.assert_array_equal(receive[order][rows], times)


def test_gaps_are_found_with_their_ends() -> None:
    receive = np.delete(sender(2000), np.r_[100:140, 1500:1900])
    _, _, report = repair(receive, None)
    full = sender(2000)
    assert report.gaps == ((full[99], full[140]), (full[1499], full[1900]))
    assert report.rate_hz == pytest.approx(20.0)


def test_gaps_move_with_the_shift() -> None:
    stamps = np.delete(sender(1000), np.arange(300, 500))
    times, _, report = repair(received(stamps, 50.0), stamps)
    ((start, end),) = report.gaps
    assert start in times
    assert end in times


def test_several_runs_in_one_table_leave_the_longest() -> None:
    receive = np.concatenate([sender(100), sender(300), sender(50)])
    times, rows, report = repair(receive, None)
    np.testing.assert_array_equal(times, sender(300))
    np.testing.assert_array_equal(rows, np.arange(100, 400))
    assert (report.resets, report.dropped) == (2, 150)
    assert any("longest" in note for note in report.notes)


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_rows(count: int) -> None:
    stamps = sender(count)
    for stamp in (None, stamps):
        times, rows, report = repair(received(stamps), stamp)
        assert len(times) == len(rows) == report.count == count
        assert report.source == ("receive" if stamp is None else "stamp")


def test_report_survives_json() -> None:
    stamps = np.delete(sender(1000), np.arange(300, 500))
    for stamp in (None, stamps):
        _, _, report = repair(received(stamps, 50.0, 0.001), stamp)
        text = json.dumps(report.to_dict(), allow_nan=False)
        assert ClockReport.from_dict(json.loads(text)).to_dict() == report.to_dict()


def test_inputs_are_not_written_to() -> None:
    stamps = sender(300)
    stamps[100] = 0
    receive = received(sender(300))[::-1].copy()
    for array in (stamps, receive):
        array.flags.writeable = False
    repair(receive, stamps)
    repair(receive, None)


times_lists = st.lists(st.integers(-(10**12), 10**12), max_size=60)


@pytest.mark.slow
@settings(deadline=None)
@given(st.data(), times_lists)
def test_any_times_give_rising_times_and_account_for_every_row(data: st.DataObject, values: list[int]) -> None:
    receive = START + np.array(values, dtype=np.int64)
    stamp = None
    if data.draw(st.booleans()):
        stamp = np.array(data.draw(st.lists(st.integers(0, 2 * START), min_size=len(values), max_size=len(values))))
        stamp = stamp.astype(np.int64)
    times, rows, report = repair(receive, stamp)
    assert bool((np.diff(times) > 0).all())
    assert len(times) == len(rows) == report.count
    assert report.count + report.dropped == len(values)
    assert len(set(rows.tolist())) == len(rows)
    assert report.duplicates <= report.dropped
    if report.source == "receive":
        np.testing.assert_array_equal(times, receive[rows])


@pytest.mark.slow
@settings(deadline=None, max_examples=50)
@given(st.permutations(list(range(30))))
def test_shuffled_rows_come_back_in_order(order: list[int]) -> None:
    true = sender(30, rate_hz=100.0)
    times, rows, report = repair(true[order], None)
    np.testing.assert_array_equal(times, true)
    np.testing.assert_array_equal(np.array(order)[rows], np.arange(30))
    assert report.out_of_order == sum(order[k] < max(order[:k], default=-1) for k in range(30))
