"""The findings of a batch in one line: how many logs have each, and how large what a single log has is."""

from __future__ import annotations

from ferryid.report.batch_findings import copies_in, found_in, losses_in
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


def test_logs_that_are_not_whole_are_named_though_they_are_done() -> None:
    lost = {"messages": 12, "seconds": 3.2, "unknown": False, "rows_left_out": 0, "seconds_left_out": 0.0, "says": []}
    whole = {**lost, "messages": 0, "rows_left_out": 9}
    rows = [row("trials/a.mcap", lost=lost), row("b.mcap", 2, lost=whole), row("c.mcap", 3)]
    assert losses_in(rows) == "1 log damaged, of which some is lost: a.mcap"
    many = [row(f"{k}.mcap", lost={**whole, "unknown": True}) for k in range(7)]
    assert losses_in(many) == "7 logs damaged, of which some is lost: 0.mcap, 1.mcap, 2.mcap, 3.mcap, 4.mcap and 2 more"
    assert losses_in(rows[1:]) == ""


def test_a_recording_under_two_names_is_told() -> None:
    rows = [row("trials/a.mcap"), row("b.mcap", 2), row("copy/twin.mcap"), row("third.mcap")]
    assert copies_in(rows) == "Identical logs, each of which counts: a.mcap = twin.mcap = third.mcap"
    assert copies_in(rows[:2]) == ""
    # One log under two vessels is no copy; logs of one name have their folders.
    twice = [row("trials/a.mcap"), row("trials/a.mcap"), row("copy/a.mcap")]
    assert copies_in(twice[:2]) == ""
    assert copies_in(twice) == "Identical logs, each of which counts: trials/a.mcap = copy/a.mcap"
    assert copies_in([row(f"{k}.mcap") for k in range(300)]).endswith(" = 3.mcap = 4.mcap = 295 more")
