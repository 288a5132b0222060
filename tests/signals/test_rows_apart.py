"""Columns of a table that hold a value in some rows only, as where several sensors were merged into one table by time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest.clocks import ClockReport
from ferryid.signals.align import align
from ferryid.signals.faults import find_faults
from ferryid.signals.sampling import check_sampling
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.time_ranges import cut
from ferryid.types import Flags, Floats
from ferryid.vessel import load_profile

PROFILE = load_profile("milliampere")
ROWS_S = np.arange(0.0, 120.0, 0.1)


def stream(topic: str, time_s: Floats, columns: dict[str, Floats]) -> Stream:
    time_ns = np.round(time_s * 1e9).astype(np.int64)
    clock = ClockReport("column", len(time_ns), float("nan"), float("nan"), float("nan"), 0.0, 0, 0, 0)
    return Stream(topic, time_ns, columns, clock, time_ns)


def recording(*streams: Stream) -> Recording:
    return Recording("trial", (), "", "", "", {one.topic: one for one in streams}, (), (), {}, {}, ())


def thrusters(t: Floats) -> dict[str, Floats]:
    return {
        "n_thruster1": 300.0 + 3.0 * t,
        "alpha_thruster1": 0.01 * t,
        "n_thruster2": 100.0 + t,
        "alpha_thruster2": 0.5 - 0.001 * t,
    }


def heading(t: Floats) -> Floats:
    return 0.3 * np.sin(0.1 * t)


def place(t: Floats) -> dict[str, Floats]:
    return {"x": t + 3.0 * np.sin(0.05 * t), "y": 0.5 * t}


def merged(every: int, skipped: tuple[int, ...] = ()) -> Recording:
    """A table of 10 Hz of which each so many-th row has a position, but those that were skipped."""
    t = ROWS_S
    has = np.isin(np.arange(t.size) % every, 0) & ~np.isin(np.arange(t.size) // every, skipped)
    position = {name: np.where(has, values, np.nan) for name, values in place(t).items()}
    return recording(stream("table", t, {**position, "psi": heading(t), **thrusters(t)}))


def test_a_position_in_every_tenth_row_is_a_source_of_its_own_rate() -> None:
    t = ROWS_S
    apart = recording(stream("/fix", t[::10], place(t[::10])), stream("/boat", t, {"psi": heading(t), **thrusters(t)}))
    one, other = align(merged(10), PROFILE), align(apart, PROFILE)
    assert one.rate_hz == other.rate_hz == 1.0
    for name in ("u", "v", "r", "x", "n_thruster1"):
        np.testing.assert_allclose(one.columns[name], other.columns[name], rtol=0.0, atol=1e-12, err_msg=name)
    assert "table: x, y have a value in 120 of 1200 rows, every 1 s: taken as measured at that rate." in one.repairs
    assert not any("missing (NaN)" in said for said in one.repairs)


def test_sensors_that_were_merged_by_time_are_taken_apart() -> None:
    """Rows of three sensors in turn, each with the values of one: all but a tenth of each column was said to be missing."""
    fix_s, boat_s = np.arange(0.003, 60.0, 0.2), np.arange(0.0, 60.0, 0.11)
    rows_s = np.sort(np.concatenate([fix_s, boat_s, boat_s + 0.004]))

    def at(times: Floats, values: dict[str, Floats]) -> dict[str, Floats]:
        there = np.isin(rows_s, times)
        return {name: np.where(there, np.interp(rows_s, times, one), np.nan) for name, one in values.items()}

    every = at(fix_s, place(fix_s)) | at(boat_s, {"psi": heading(boat_s)}) | at(boat_s + 0.004, thrusters(boat_s))
    # One number of a fix is missing: north and east stay at the same times.
    every["y"][int(np.flatnonzero(np.isfinite(every["y"]))[7])] = np.nan
    faults = find_faults(recording(stream("table", rows_s, every)))
    assert [sorted(one.columns) for one in faults.sources] == [["x", "y"], ["psi"], sorted(thrusters(fix_s))]
    assert [len(one.time_ns) for one in faults.sources] == [len(fix_s), len(boat_s), len(boat_s)]
    assert [said for said in faults.taken_out if "missing" in said] == [
        "y: 1 of 300 samples is missing (NaN); short ones are interpolated."
    ]


def test_fixes_that_fail_are_still_gaps_of_it() -> None:
    track = align(merged(10, skipped=tuple(range(40, 60))), PROFILE)
    assert not track.valid[42:58].any()
    assert track.valid[:36].all()
    assert any("1 gap longer than" in said for said in track.repairs)


def test_rows_that_are_missing_here_and_there_stay_where_they_are() -> None:
    t, log = ROWS_S, merged(1)
    table = log.streams["table"]
    table = replace(
        table, columns={**table.columns, "x": np.where(np.arange(t.size) % 4 == 1, np.nan, table.columns["x"])}
    )
    faults = find_faults(replace(log, streams={"table": table}))
    assert len(faults.sources) == 1
    assert "x: 300 of 1200 samples are missing (NaN); short ones are interpolated." in faults.taken_out


def motion(t: Floats) -> dict[str, Floats]:
    return {"u": 1.0 + 0.1 * np.sin(0.2 * t), "v": 0.1 * np.cos(0.2 * t), "r": 0.03 * np.cos(0.1 * t)}


@pytest.mark.parametrize(
    "kept",
    [
        np.isin(np.arange(ROWS_S.size), [5, 400, 800, 1190]),
        np.random.default_rng(0).random(ROWS_S.size) < 0.4,
        np.random.default_rng(1).random(ROWS_S.size) < 0.28,
    ],
    ids=["4 of 1200", "two fifths", "a quarter"],
)
def test_what_is_left_of_a_sensor_that_fails_is_no_rate_of_its_own(kept: Flags) -> None:
    t = ROWS_S
    feedback = thrusters(t)
    feedback["n_thruster1"] = np.where(kept, feedback["n_thruster1"], np.nan)
    columns = {**motion(t), "psi": heading(t), **feedback}
    faults = find_faults(recording(stream("table", t, columns)))
    assert len(faults.sources) == 1
    assert any(said.startswith("n_thruster1: ") and "missing (NaN)" in said for said in faults.taken_out)
    if kept.sum() < 10:
        assert not align(recording(stream("table", t, columns)), PROFILE).valid[60:340].any()


@pytest.mark.parametrize("first", range(4))
def test_two_sensors_of_one_rate_are_taken_apart_wherever_the_log_begins(first: int) -> None:
    boat_s = np.arange(0.0, 60.0, 0.1)
    rows_s = np.sort(np.concatenate([boat_s, boat_s + 0.004]))[first:]
    of_boat = np.isin(rows_s, boat_s)
    columns = {
        name: np.where(of_boat, one, np.nan) for name, one in (motion(rows_s) | {"psi": heading(rows_s)}).items()
    }
    columns |= {name: np.where(of_boat, np.nan, one) for name, one in thrusters(rows_s).items()}
    faults = find_faults(recording(stream("table", rows_s, columns)))
    assert [sorted(one.columns) for one in faults.sources] == [["psi", "r", "u", "v"], sorted(thrusters(rows_s))]


@pytest.mark.parametrize("missed", [0.1, 0.3, 0.5])
def test_fixes_that_are_missed_at_random_leave_the_others(missed: float) -> None:
    """Half of the fixes of 1 Hz in rows of 10 Hz: the log was said to have no position."""
    kept = np.flatnonzero(np.random.default_rng(2).random(120) < missed)
    found = find_faults(merged(10, skipped=tuple(kept.tolist())))
    assert ["x", "y"] in [sorted(one.columns) for one in found.sources]


def test_sensors_of_which_some_share_neighbouring_rows_are_taken_apart() -> None:
    """A sixth of the fixes of 1 Hz stand in the next row too; rows of 10 and of 8 Hz that were merged by time."""
    again = np.random.default_rng(3).random(ROWS_S.size) < 0.15
    has = np.arange(ROWS_S.size) % 10 == 0
    has |= np.roll(has, 1) & again
    position = {name: np.where(has, values, np.nan) for name, values in place(ROWS_S).items()}
    table = stream("table", ROWS_S, {**position, "psi": heading(ROWS_S), **thrusters(ROWS_S)})
    assert ["x", "y"] in [sorted(one.columns) for one in find_faults(recording(table)).sources]
    fast_s, slow_s = np.arange(0.0, 60.0, 0.1), np.arange(0.003, 60.0, 0.125)
    rows_s = np.sort(np.concatenate([fast_s, slow_s]))
    of_slow = np.isin(rows_s, slow_s)
    columns = {name: np.where(of_slow, np.nan, values) for name, values in place(rows_s).items()}
    columns |= {name: np.where(of_slow, values, np.nan) for name, values in thrusters(rows_s).items()}
    found = find_faults(recording(stream("table", rows_s, columns))).sources
    assert [sorted(one.columns) for one in found] == [["x", "y"], sorted(thrusters(rows_s))]


def test_a_wind_of_two_values_in_minutes_is_missing() -> None:
    t = ROWS_S
    wind = {"wind_speed": 3.0 + 0.01 * t, "wind_from": 0.1 + 0.001 * t}
    rare = {name: np.where(np.isin(np.arange(t.size), [5, 1190]), one, np.nan) for name, one in wind.items()}
    slow = {name: np.where(np.arange(t.size) % 300 == 0, one, np.nan) for name, one in wind.items()}
    every = {**motion(t), "psi": heading(t)}
    # A station notes the wind each half minute.
    assert len(find_faults(recording(stream("table", t, {**every, **slow}))).sources) == 2
    late = t[-1] + np.random.default_rng(0).uniform(0.0, 0.02, t.size) + 10.0 * t
    means = {name: np.where(np.arange(t.size) % 600 == 0, one, np.nan) for name, one in wind.items()}
    # Two means over ten minutes are no rate, three are.
    for values, parts in (({**motion(t), **means}, 1), ({**motion(t), **slow}, 2)):
        assert len(find_faults(recording(stream("table", late, values))).sources) == parts
    faults = find_faults(recording(stream("table", t, {**every, **rare})))
    assert len(faults.sources) == 1
    assert any("wind_speed: 1198 of 1200 samples are missing" in said for said in faults.taken_out)


@pytest.mark.parametrize("coarse", [False, True])
def test_an_order_holds_however_often_it_changes(coarse: bool) -> None:
    """Of changes in neighbouring rows most of the log was lost, of the same order in coarser steps nothing."""
    t = ROWS_S
    order = np.round(200.0 * np.sin(0.3 * t), -1 if coarse else 0)
    told = np.r_[True, np.diff(order) != 0.0]
    assert (np.median(np.diff(np.flatnonzero(told))) >= 2.0) == coarse
    orders = {name: np.where(told, order, np.nan) for name in ("n_cmd_thruster1", "n_cmd_thruster2")}
    angles = {name: values for name, values in thrusters(t).items() if name.startswith("alpha")}
    track = align(recording(stream("table", t, {**place(t), "psi": heading(t), **orders, **angles})), PROFILE)
    assert track.valid[5:-5].all()


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize(
    ("first", "last"), [(400, 700), (800, 1201), (500, 501)], ids=["within", "to the end", "one row"]
)
def test_an_order_that_is_no_longer_recorded_is_not_held(every: int, first: int, last: int) -> None:
    """An order that ended at half of a ship's log was held for 20 minutes, and the fit to it accepted."""
    t, row = ROWS_S, np.arange(ROWS_S.size)
    gone = ((row >= first) & (row < last)) | (row % every > 0)
    order = 200.0 * np.sin(0.3 * t) + np.random.default_rng(0).normal(size=t.size)
    orders = {name: np.where(gone, np.nan, order) for name in ("n_cmd_thruster1", "n_cmd_thruster2")}
    angles = {name: values for name, values in thrusters(t).items() if name.startswith("alpha")}
    log = recording(stream("table", t, {**place(t), "psi": heading(t), **orders, **angles}))
    assert not any(one.on_change for one in find_faults(log).sources)
    track = align(log, PROFILE)
    assert track.valid[10 : first - 10].all()
    if last - first == 1:
        assert track.valid[10:-10].all()
    else:
        assert not track.valid[first + 10 : min(last, t.size) - 10].any()


def test_an_order_that_is_written_when_it_changes_says_for_how_long_it_holds() -> None:
    t = ROWS_S
    told = np.isin(np.arange(t.size), [0, 31, 32, 190, 400, 405, 700])
    orders = {name: np.where(told, np.cumsum(told) * 50.0, np.nan) for name in ("n_cmd_thruster1", "n_cmd_thruster2")}
    (said,) = (
        one for one in find_faults(recording(stream("table", t, {**place(t), **orders}))).remarks if "holds" in one
    )
    assert said == (
        "table: n_cmd_thruster1, n_cmd_thruster2 have a value in 7 of 1200 rows: taken as written when it changes; each value "
        "holds until the next, at most for 49.9 s."
    )


def test_an_order_that_was_written_before_a_range_holds_in_it() -> None:
    t = ROWS_S
    told = np.isin(np.arange(t.size), [0, 31, 800])
    orders = {name: np.where(told, np.cumsum(told) * 50.0, np.nan) for name in ("n_cmd_thruster1", "n_cmd_thruster2")}
    angles = {name: values for name, values in thrusters(t).items() if name.startswith("alpha")}
    log = recording(stream("table", t, {**place(t), "psi": heading(t), **orders, **angles}))
    track = align(cut(log, PROFILE, ((30.0, None),)), PROFILE)
    assert track.valid[5:-5].all()
    np.testing.assert_allclose(track.columns["n_cmd_thruster1"][100], 100.0)


def test_an_order_that_is_written_when_it_changes_holds() -> None:
    t = ROWS_S
    told = np.isin(np.arange(t.size), [0, 31, 32, 190, 400, 405, 800, 1001])
    orders = {name: np.where(told, np.cumsum(told) * 50.0, np.nan) for name in ("n_cmd_thruster1", "n_cmd_thruster2")}
    angles = {name: values for name, values in thrusters(t).items() if name.startswith("alpha")}
    track = align(recording(stream("table", t, {**place(t), "psi": heading(t), **orders, **angles})), PROFILE)
    assert track.valid[5:-5].all()
    np.testing.assert_allclose(track.columns["n_cmd_thruster1"][350], 200.0)


def test_a_rate_that_is_too_slow_for_the_vessel_is_told_of_the_position_and_not_of_the_rows() -> None:
    with pytest.raises(
        FerryIdError, match=r"found x of table every 3 s, where .* Fix: record the navigation at a higher"
    ):
        check_sampling(merged(30), PROFILE)
