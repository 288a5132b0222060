"""The section on time and memory, without the recordings."""

from __future__ import annotations

import pytest

from tests.real.times import Timed, single_log_s


@pytest.mark.parametrize(("hours", "aim_s"), [(0.5, 22.5), (1.0, 45.0), (3.5, 142.5), (6.0, 240.0)])
def test_the_aim_of_a_log_lies_between_those_of_an_hour_and_of_six(hours: float, aim_s: float) -> None:
    assert single_log_s(hours * 3600.0) == pytest.approx(aim_s)


@pytest.mark.parametrize(
    ("seconds", "memory_gb", "said"), [(59.0, 1.9, "reached"), (61.0, 1.9, "**missed**"), (59.0, 2.1, "**missed**")]
)
def test_a_row_holds_time_and_memory(seconds: float, memory_gb: float, said: str) -> None:
    row = Timed("Logs", seconds, memory_gb, 5400.0, 60.0).row()
    assert row == f"| Logs | 1.50 h | {seconds:.0f} s | 60 s | {memory_gb:.2f} | 2 | {said} |"
