"""The time left of a validation run: over all stages, so that it does not begin again with each."""

from __future__ import annotations

import re

import pytest

from ferryid.validation import pace as module
from ferryid.validation.pace import COST, Pace

STAGES = ("writing logs", "diagnosing", "oracle")


def test_the_time_left_is_of_all_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    pace, cases, told = Pace(STAGES, 10), 10, []
    whole_s = 1000.0 * cases * sum(COST[stage] for stage in STAGES)
    for number, stage in enumerate(STAGES, 1):
        assert pace.begun(stage, 0) == f"{stage}: 0 of 10, stage {number} of 3"
        pace.begin()
        for done in range(1, cases + 1):
            now += 1000.0 * COST[stage]
            told.append(pace.told(stage, done, done))
            found = re.fullmatch(
                rf"{stage}: {done} of 10, stage {number} of 3, ([\d.]+) (s|min|h) left in all", told[-1]
            )
            assert found, told[-1]
            left_s = float(found[1]) * {"s": 1.0, "min": 60.0, "h": 3600.0}[found[2]]
            assert left_s == pytest.approx(whole_s - now, abs=200.0)
    assert told[-1].endswith("10 of 10, stage 3 of 3, 0 s left in all")


def test_a_stage_alone_has_no_number() -> None:
    assert Pace(("counting",), 3).begun("counting", 1) == "counting: 1 of 3"
