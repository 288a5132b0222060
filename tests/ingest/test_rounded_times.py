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
    reader = open_log(path)
    ((found, _, report),) = repair_all(reader.read({topic.name: ("u",) for topic in reader.topics})).values()
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
