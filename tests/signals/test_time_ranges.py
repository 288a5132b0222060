"""Ranges of a log: what they mean, what is cut, and what cannot be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest.clocks import ClockReport
from ferryid.signals.ingest import ingest
from ferryid.signals.recording import record
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.time_ranges import cut, parse_ranges, ranges_of, shares_data
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

LOG = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
"""22:13:20 UTC."""


@pytest.fixture(scope="module")
def profile() -> Profile:
    """Give the profile of the log."""
    return load_profile("milliampere")


@pytest.fixture(scope="module")
def whole(profile: Profile) -> Recording:
    """Give the whole log."""
    return record(LOG, profile)


def recorded(whole: Recording, *, start_ns: int = START, order_s: tuple[float, ...] = (0.0, 7.0, 31.0)) -> Recording:
    """Return a log of 100 s, at 10 Hz but for orders that are published when they change."""

    def stream(topic: str, time_s: np.ndarray, *names: str) -> Stream:
        time_ns = start_ns + np.round(time_s * 1e9).astype(np.int64)
        values = np.arange(float(len(time_s)))
        clock = ClockReport("receive", len(time_s), 10.0, np.nan, np.nan, 0.0, 0, 0, 0)
        return Stream(topic, time_ns, {name: values.copy() for name in names}, clock, time_ns)

    even = np.arange(1001) / 10.0
    streams = {
        "/navigation/odometry": stream("/navigation/odometry", even, "x", "y", "psi", "u", "v", "r"),
        "/thruster1/state": stream("/thruster1/state", even, "n_thruster1", "alpha_thruster1"),
        "/thruster2/state": stream("/thruster2/state", even, "n_thruster2", "alpha_thruster2"),
        "/thruster1/command": stream("/thruster1/command", np.array(order_s), "n_cmd_thruster1", "alpha_cmd_thruster1"),
    }
    found = {name: topic for topic, one in streams.items() for name in one.columns}
    return replace(whole, name="made", streams=streams, found=found, missing={}, notes=())


def test_the_words_of_a_command_line() -> None:
    assert parse_ranges(None, None) == ()
    assert parse_ranges("60", None) == (("60", None),)
    assert parse_ranges(None, "-10") == ((None, "-10"),)
    assert parse_ranges("60, 900", "300,14:30") == (("60", "300"), ("900", "14:30"))


@pytest.mark.parametrize(
    ("first", "last", "told"),
    [
        ("x", None, "--from x: 'x' is no time. Fix: give seconds"),
        ("nan", None, "'nan' is no time"),
        ("1,", "2,3", "'' is no time"),
        ("1,2", "3", "every range needs its start and its end, found 2 and 1"),
        ("1,2", None, "every range needs its start and its end, found 2 and 0"),
    ],
)
def test_words_that_are_no_range(first: str, last: str | None, told: str) -> None:
    with pytest.raises(FerryIdError, match=told):
        parse_ranges(first, last)


@pytest.mark.parametrize(
    ("asked", "kept"),
    [
        (("10", "20"), (10.0, 20.0)),
        ((10, 20.5), (10.0, 20.5)),
        (("90", None), (90.0, 100.0)),
        ((None, "-30"), (0.0, 70.0)),
        (("-30", "-10"), (70.0, 90.0)),
        (("90", "1e6"), (90.0, 100.0)),
        (("22:13:30", "22:14"), (10.0, 40.0)),
        (("2023-11-14T22:13:30", "2023-11-14T23:13:40+01:00"), (10.0, 20.0)),
        (("10", "22:13:50.5"), (10.0, 30.5)),
    ],
)
def test_what_a_range_means(whole: Recording, profile: Profile, asked: tuple, kept: tuple[float, float]) -> None:
    part = cut(recorded(whole), profile, (asked,))
    at = (part.streams["/navigation/odometry"].time_ns - START) * 1e-9
    assert (at[0], at[-1]) == pytest.approx(kept)
    assert ranges_of(part.sha256) == (pytest.approx(kept),)


def test_a_time_of_day_after_midnight_is_of_the_next_day(whole: Recording, profile: Profile) -> None:
    late = START - START % (86400 * SECOND) + (86400 - 50) * SECOND
    part = cut(recorded(whole, start_ns=late), profile, (("23:59:30", "00:00:20"),))
    assert ranges_of(part.sha256) == ((20.0, 70.0),)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (
            ("200", None),
            r"made: the range from 200 to the end is outside the log, which is 100\.0 s long \(2023-11",
        ),
        ((None, "-200"), "is outside the log"),
        (("12:00", None), "is outside the log"),
        (("50", "20"), r"ends before it begins, found 50\.0 s to 20\.0 s"),
        (("50", "50"), r"is empty, found 50\.0 s to 50\.0 s"),
    ],
)
def test_a_range_that_a_log_does_not_have(whole: Recording, profile: Profile, asked: tuple, told: str) -> None:
    with pytest.raises(FerryIdError, match=told):
        cut(recorded(whole), profile, (asked,))


def test_a_clock_time_of_a_log_without_a_clock(whole: Recording, profile: Profile) -> None:
    with pytest.raises(FerryIdError, match="its times are counted from its start"):
        cut(recorded(whole, start_ns=0), profile, (("22:14", None),))


def test_several_ranges_leave_a_gap_and_touching_ones_are_one(whole: Recording, profile: Profile) -> None:
    part = cut(recorded(whole), profile, (("60", "70"), ("10", "20"), ("15", "30")))
    at = (part.streams["/navigation/odometry"].time_ns - START) * 1e-9
    assert ranges_of(part.sha256) == ((10.0, 30.0), (60.0, 70.0))
    assert np.diff(at).max() == pytest.approx(30.0)
    assert len(at) == 201 + 101
    assert part.notes[0].startswith("Used is 10.0 to 30.0 s and 60.0 to 70.0 s of 100.0 s")
    assert part.streams["/navigation/odometry"].clock.count == 302


def test_an_order_holds_into_each_range(whole: Recording, profile: Profile) -> None:
    part = cut(recorded(whole), profile, (("10", "20"), ("50", "60"), ("31", "32")))
    order = part.streams["/thruster1/command"]
    assert ((order.time_ns - START) // SECOND).tolist() == [10, 31, 50]
    assert order.columns["n_cmd_thruster1"].tolist() == [1.0, 2.0, 2.0]


def test_signals_without_a_row_are_missing_or_an_error(whole: Recording, profile: Profile) -> None:
    made = recorded(whole, order_s=(40.0, 41.0))
    part = cut(made, profile, (("0", "30"),))
    assert "n_cmd_thruster1" not in part.found
    assert part.missing["thruster1.speed.command"] == "/thruster1/command holds no row in 0.0 to 30.0 s"
    blind = replace(
        made.streams["/navigation/odometry"], time_ns=made.streams["/navigation/odometry"].time_ns + 30 * SECOND
    )
    streams = {**made.streams, "/navigation/odometry": blind}
    with pytest.raises(FerryIdError, match=r"made: position is needed .* holds no row in 0\.0 to 20\.0 s\. Fix: widen"):
        cut(replace(made, streams=streams), profile, (("0", "20"),))


def test_which_recordings_share_data() -> None:
    assert shares_data("a", "a")
    assert shares_data("a", "a#t=10.000,20.000")
    assert shares_data("a#t=0.000,5.000;18.000,30.000", "a#t=10.000,20.000")
    assert not shares_data("a#t=0.000,10.000", "a#t=10.000,20.000")
    assert not shares_data("a#t=0.000,10.000", "b#t=0.000,10.000")


def test_the_whole_is_kept_and_a_part_is_ingested_beside_it(profile: Profile, tmp_path: Path) -> None:
    part = record(LOG, profile, tmp_path, ranges=((10, 40),))
    assert (part.end_ns - part.start_ns) * 1e-9 == pytest.approx(30.0, abs=0.2)
    again = record(LOG, profile, tmp_path)
    assert (again.end_ns - again.start_ns) * 1e-9 == pytest.approx(89.9, abs=0.2)
    assert len(list((tmp_path / "logs").iterdir())) == 1
    result = ingest([str(LOG)], profile, tmp_path, ranges=((10, 40),), progress=lambda stage: None)
    other = ingest([str(LOG)], profile, tmp_path, ranges=((20, 40),), progress=lambda stage: None)
    folders = {Path(one["logs"][0]["folder"]) for one in (result, other)}
    assert len(folders) == 2
    assert all(folder.is_dir() for folder in folders)
    assert record(LOG, profile, tmp_path).sha256 == again.sha256 == part.sha256.partition("#")[0]
