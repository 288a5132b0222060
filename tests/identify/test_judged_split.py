"""Blocks for ships, whose windows are longer than the usual ones; what is said where there are no such windows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.identify.judged_split import judged_by_force, judged_split
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split, split_rows
from ferryid.signals.track import segments
from ferryid.vessel import load_profile
from ferryid.vessel.dimensions import window_seconds
from tests.identify.test_split import motion

FERRY = load_profile("milliampere")
SHIP = replace(FERRY, hull=replace(FERRY.hull, length_m=320.0))
SETTINGS = FitSettings()


def same(one: Split, other: Split) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one.validation, other.validation, strict=True))


def test_blocks_of_a_ship_hold_windows_to_judge_in() -> None:
    logs = [motion(np.ones(6000, dtype=bool), log=f"log{k}") for k in range(6)]
    length_s = window_seconds(SHIP)
    usual, longer = split_rows(logs, window_s=1.0), judged_split(logs, SHIP, SETTINGS, 1.0)
    assert max(one.stop - one.start for mask in usual.validation for one in segments(mask)) < 10.0 * 2.0 * length_s
    lengths = [0.1 * (one.stop - one.start) for mask in longer.validation for one in segments(mask)]
    assert min(lengths) >= 2.0 * length_s - 0.1
    assert (
        longer.notes[-1] == "Blocks are 128 s or longer, or whole logs, as predictions are judged in windows of 64 s."
    )
    assert same(judged_split(logs, FERRY, SETTINGS, 1.0), usual), "windows of a ferry fit into the usual blocks"


def test_where_longer_blocks_do_not_help_the_usual_ones_stay_and_the_error_is_named() -> None:
    alone = [motion(np.ones(3000, dtype=bool))]
    for logs in (alone, [*alone, motion(np.ones(3000, dtype=bool), log="other")]):
        parts = judged_split(logs, SHIP, SETTINGS, 1.0)
        assert same(parts, split_rows(logs, window_s=1.0))
        told = judged_by_force(parts, logs, SHIP)
        assert "held-out data hold 0 windows of 64 s, and 6 are needed" in told
        assert ("--split logs" in told) == (len(logs) > 1)


def test_logs_too_short_for_three_longer_blocks_are_said_to_be_whole() -> None:
    parts = judged_split([motion(np.ones(1000, dtype=bool), log=f"log{k}") for k in range(12)], SHIP, SETTINGS, 1.0)
    assert parts.notes[0].startswith("log0: 1 block of 100 s;")
    assert "128 s or longer, or whole logs, as" in parts.notes[-1]


def test_the_thesis_and_other_splits_are_left_alone() -> None:
    logs = [motion(np.ones(6000, dtype=bool), log=f"log{k}") for k in range(6)]
    thesis = replace(SETTINGS, estimator="derivative", accept="thesis")
    assert same(judged_split(logs, SHIP, thesis, 1.0), split_rows(logs, window_s=1.0))
    whole = judged_split(logs, SHIP, replace(SETTINGS, split="logs"), 1.0)
    assert same(whole, split_rows(logs, "logs", window_s=1.0))
