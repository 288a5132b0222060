"""Notes on several logs: one line where they differ in numbers only."""

from __future__ import annotations

from ferryid.report.alike_notes import said_once


def test_notes_that_differ_in_numbers_only_are_one_line_with_their_range() -> None:
    notes = [
        ("exp37", "Only 24 windows of 4 s are without a gap, as /thruster2 begins at 3.7 s."),
        ("exp38", "Steady wind was not tested."),
        ("exp50", "Only 38 windows of 4 s are without a gap, as /thruster2 begins at 3.65 s."),
        ("exp51", "Only 9 windows of 4 s are without a gap, as /thruster2 begins at -10.0 s."),
    ]
    assert said_once(notes) == [
        "3 logs, exp37, exp50 and exp51, each: Only 9 to 38 windows of 4 s are without a gap, "
        "as /thruster2 begins at -10.0 to 3.7 s.",
        "exp38: Steady wind was not tested.",
    ]


def test_names_and_dates_are_no_numbers() -> None:
    notes = [
        ("a", "thruster1 began on 2026-11-29."),
        ("b", "thruster2 began on 2026-11-29."),
        ("c", "It is 12:30 in v1.2."),
    ]
    assert said_once(notes) == [f"{log}: {note}" for log, note in notes]


def test_a_log_with_two_such_notes_keeps_both() -> None:
    notes = [("a", "3 rows are left out."), ("a", "5 rows are left out."), ("b", "4 rows are left out.")]
    assert said_once(notes) == [f"{log}: {note}" for log, note in notes]


def test_many_logs_are_not_all_named() -> None:
    (line,) = said_once([(f"log{k:02d}", f"{k} rows are left out.") for k in range(60)])
    assert line.startswith("60 logs, log00, log01, log02, log03, log04, log05, log06 and 53 more, each: 0 to 59 rows")
