"""The findings of a batch in one line: how many logs have each, and how large what a single log has is."""

from __future__ import annotations

from ferryid.report.batch_findings import found_in
from tests.batch.rows import finding, row


def test_findings_are_counted_and_sized_and_hints_left_out() -> None:
    thruster = finding("thruster_gain", "thruster2", factor=0.6)
    wind = finding("wind", north=3.0, east=4.0)
    rows = [
        row("a", 1, findings=(wind, thruster)),
        row("b", 2, findings=(wind, finding("fouling", surge=1.8, probability=0.3))),
        row("c", 3, findings=(finding("unknown"),)),
    ]
    assert found_in(rows) == "Steady wind in 2 logs, thruster force (thruster2, factor 0.6) in 1 log"
    assert found_in(rows[2:]) == ""


def test_a_vector_is_told_by_its_length() -> None:
    assert found_in([row("a", findings=(finding("wind", north=3.0, east=4.0),))]) == "Steady wind (5.0) in 1 log"
