"""The list of stored models stays readable."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ferryid.report.model_text import render_listing


def listed(logs: list[str], *, current: bool) -> str:
    model: dict[str, Any] = {
        "name": "boat",
        "version": 1,
        "current": current,
        "accepted": current,
        "created": "2024-05-02T10:00:00Z",
        "normalised_mse": 0.5,
        "logs": logs,
    }
    return render_listing({"models": [model]}, Path("out"))


def test_many_logs_are_counted_not_listed() -> None:
    line = listed([f"run{number}" for number in range(9)], current=True).splitlines()[1]
    assert line.endswith("run0, run1 and 7 more")
    assert listed(["run0", "run1"], current=True).splitlines()[1].endswith("run0, run1")
    assert max(map(len, listed(["a" * 300] * 5, current=True).splitlines())) < 180


def test_the_mark_is_explained_only_where_it_is_shown() -> None:
    assert listed(["run0"], current=True).endswith("* current")
    assert "*" not in listed(["run0"], current=False)
