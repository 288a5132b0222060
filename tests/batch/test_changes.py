"""What changed over the dates of a vessel's logs: which logs are compared, and what is kept of it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from ferryid.batch.changes import MOST, group_tasks, groups_of, kept_change
from ferryid.batch.recipe import Recipe
from ferryid.batch.run import _changes
from ferryid.batch.trend import trends_of
from ferryid.report.batch_page import render
from ferryid.report.batch_rows import Change, SummaryRow
from ferryid.vessel import load_profile
from tests.batch.archive import FIXTURES
from tests.batch.rows import finding, result, row

DATED = [row(f"logs/day{day}", day) for day in range(1, 10)]


def names(rows: list[SummaryRow]) -> list[str]:
    return [one.name for one in rows]


def test_the_first_and_the_last_third_are_compared() -> None:
    first, last, chosen = groups_of(DATED[::-1], ())
    assert (names(first), names(last)) == (["day1", "day2", "day3"], ["day7", "day8", "day9"])
    assert chosen == "the last 3 logs against the first 3"
    season = [row(f"logs/day{day}", day) for day in range(1, 29)]
    first, last, _ = groups_of(season, ())
    assert (names(first), names(last)) == (names(season[:MOST]), names(season[-MOST:]))


def test_logs_next_to_a_step_are_compared() -> None:
    factors = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.6, 0.6, 0.6, 0.6, 0.6]
    rows = [
        row(
            f"logs/day{day}",
            day,
            findings=(finding("thruster_gain", "thruster1", factor=value),) if value < 1.0 else (),
        )
        for day, value in enumerate(factors, 1)
    ]
    trends = trends_of(rows, {"milliampere": load_profile("milliampere")})
    assert [one.kind for one in trends] == ["steps"]
    before, after, chosen = groups_of(rows, trends)
    assert (names(before), names(after)) == (names(rows[1:7]), names(rows[7:]))
    assert chosen == "5 logs after the step of thruster force (thruster1) against 6 before it"


def test_few_logs_copies_and_logs_without_a_date_or_a_diagnosis_are_not_compared() -> None:
    assert groups_of(DATED[:5], ()) == ([], [], "")
    assert groups_of([replace(one, sha256="f" * 64) for one in DATED], ()) == ([], [], "")
    assert groups_of([replace(one, date=None) for one in DATED], ()) == ([], [], "")
    assert groups_of([replace(one, diagnose=None) for one in DATED], ()) == ([], [], "")


@pytest.mark.slow
def test_a_comparison_that_fails_is_reported_kept_and_not_done_again(tmp_path: Path) -> None:
    told: list[str] = []
    profile = load_profile("milliampere")
    # The same file stands in both groups.
    logs = {one.log: str(FIXTURES / f"short.{('mcap', 'bag', 'csv')[k % 3]}") for k, one in enumerate(DATED)}
    once = partial(
        _changes,
        result(*DATED),
        logs,
        {"milliampere": (profile, None)},
        Recipe(),
        tmp_path,
        (),
        4 << 30,
        1,
        None,
        False,
    )
    (change,) = once(lambda stage: None, told.append)
    assert change.verdict is None
    assert "stands on both sides" in change.problem
    assert told == [f"milliampere, the last 3 logs against the first 3: {change.problem}"]
    folder = tmp_path / "batch" / "changes"
    (task,) = group_tasks(DATED, logs, (), {"milliampere": (profile, None)}, folder, tmp_path, (), (), 1)
    assert kept_change(task.folder) == change
    stale = folder / "milliampere-older"
    stale.mkdir()
    assert once(lambda stage: pytest.fail(stage), told.append) == (change,)
    assert not stale.exists()
    assert len(told) == 1


def test_the_page_shows_what_changed() -> None:
    change = Change(
        "milliampere",
        ("a", "b"),
        ("c", "d"),
        "the last 2 logs against the first 2",
        "different",
        "1 difference confirmed between the groups.",
        ("thruster1 gives 0.8 of its force.",),
        "changes/milliampere-01/reports/x y/report.html",
    )
    page = render(result(*DATED, changes=(change,)))
    assert "the last 2 logs against the first 2: 1 difference confirmed between the groups." in page
    assert "<li>thruster1 gives 0.8 of its force.</li>" in page
    assert 'href="changes/milliampere-01/reports/x%20y/report.html"' in page
    assert "What changed" not in render(result(*DATED))
