"""Times of tables with too few digits: what lies evenly is put back, and nothing else is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.ingest import open_log
from ferryid.ingest.clocks import ClockReport, repair_all
from ferryid.ingest.rounded_times import unrounded
from ferryid.types import Floats, Nanoseconds

SECOND = 1_000_000_000


def read(folder: Path, times: list[str]) -> tuple[Nanoseconds, ClockReport]:
    path = folder / "log.csv"
    path.write_text("\n".join(["t,u", *(f"{one},{k}" for k, one in enumerate(times))]) + "\n", encoding="utf-8")
    return read_columns(path, "u")


def read_columns(path: Path, *columns: str) -> tuple[Nanoseconds, ClockReport]:
    reader = open_log(path)
    ((found, _, report),) = repair_all(reader.read({topic.name: columns for topic in reader.topics})).values()
    return found, report


def nanoseconds(seconds: Floats) -> Nanoseconds:
    return np.rint(seconds * SECOND).astype(np.int64)


@pytest.mark.parametrize("last_s", [600.0, 2000.0])
def test_even_rows_with_times_of_three_digits_are_put_back(tmp_path: Path, last_s: float) -> None:
    true = np.arange(0.0, last_s, 0.1353)
    found, report = read(tmp_path, [f"{one:.2E}" for one in true])
    assert report.count == len(true)
    assert (report.duplicates, report.dropped) == (0, 0)
    assert report.rate_hz == pytest.approx(1.0 / 0.1353, rel=1e-4)
    assert np.abs(found / SECOND - true).max() < 0.1
    (said,) = (one for one in report.notes if "rounded" in one)
    assert "as times that are rounded to 1" in said
    assert "all rows are put evenly 0.1353 s apart (7.39 Hz), at most" in said


def test_rows_that_do_not_lie_evenly_are_left_out_and_the_cause_is_said(tmp_path: Path) -> None:
    true = np.cumsum(np.random.default_rng(1).uniform(0.02, 0.4, 3000))
    true[1500:] += 20.0
    _, report = read(tmp_path, [f"{one:.0f}" for one in true])
    assert report.duplicates > 1000
    (said,) = (one for one in report.notes if "rounded" in one)
    assert said.endswith("are left out: the rows do not lie evenly. Fix: write the times with more digits")


def test_rows_that_may_have_been_written_twice_stay_left_out() -> None:
    twice = nanoseconds(np.repeat(0.1 * np.arange(200), 2))
    times, said = unrounded(twice)
    assert times is twice
    assert "400 rows repeat the time of another" in said
    assert "they may lie evenly 0.05 s apart (20 Hz), or have been written twice. Fix:" in said


def test_times_that_are_not_coarse_are_left_alone() -> None:
    rng = np.random.default_rng(2)
    jittered = np.sort(nanoseconds(0.1 * np.arange(1000) + 0.03 * rng.random(1000)))
    some = np.sort(np.concatenate([jittered, jittered[::4]]))
    back = nanoseconds(np.concatenate([np.repeat(np.arange(50.0), 5), np.repeat(np.arange(50.0), 5)]))
    few = nanoseconds(np.repeat(np.arange(5.0), 7))
    for times in (jittered, some, back, few, jittered[:1], jittered[:0]):
        assert unrounded(times)[1] == ""
        assert unrounded(times)[0] is times


def test_rows_that_hold_the_same_as_another_of_their_time_were_written_twice(tmp_path: Path) -> None:
    true = 0.1 * np.arange(600)
    path = tmp_path / "log.csv"
    rows = [f"{one:.1f},{k}\n" * (2 if k % 5 == 0 else 1) for k, one in enumerate(true)]
    path.write_text("t,u\n" + "".join(rows), encoding="utf-8")
    found, report = read_columns(path, "u")
    assert (report.count, report.duplicates) == (600, 120)
    np.testing.assert_allclose(found / SECOND, true, atol=1e-6)
    assert not any("rounded" in one for one in report.notes)


def test_rows_of_one_time_that_fill_other_columns_are_of_several_sensors(tmp_path: Path) -> None:
    true = 0.1 * np.arange(600)
    path = tmp_path / "log.csv"
    rows = [f"{one:.1f},{k},\n" + (f"{one:.1f},,{k}\n" if k % 5 == 0 else "") for k, one in enumerate(true)]
    path.write_text("t,u,wind\n" + "".join(rows), encoding="utf-8")
    found, report = read_columns(path, "u", "wind")
    np.testing.assert_allclose(found / SECOND, true, atol=1e-6)
    (said,) = (one for one in report.notes if "repeat" in one)
    assert "120 of 720 rows repeat the time of another and are left out: they fill other columns" in said


def test_values_that_are_held_between_samples_do_not_hinder(tmp_path: Path) -> None:
    true = np.arange(0.0, 600.0, 0.1353)
    path = tmp_path / "log.csv"
    path.write_text("t,u\n" + "".join(f"{one:.0f},{int(one / 1.9)}\n" for one in true), encoding="utf-8")
    _, report = read_columns(path, "u")
    assert report.count == len(true)
