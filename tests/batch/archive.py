"""A small archive and its recipe."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from ferryid.batch import run as running
from ferryid.batch.run import batch
from ferryid.batch.spread import spread
from ferryid.report.batch_rows import BatchResult

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


def archive(folder: Path, count: int = 3) -> Path:
    """Write a folder of logs: all hold the same, under other names."""
    logs = folder / "season"
    logs.mkdir()
    for number in range(count):
        shutil.copy(FIXTURES / "short.mcap", logs / f"day{number}.mcap")
    return logs


def recipe(folder: Path, text: str = 'steps = ["evaluate"]\n') -> Path:
    """Write a recipe; evaluation is the quickest step."""
    path = folder / "recipe.toml"
    path.write_text(text, encoding="utf-8")
    return path


def run(folder: Path, *asked: Path | str, **options: Any) -> tuple[BatchResult, list[str]]:
    """Carry out a batch below a folder; return its result and the lines that were told."""
    told: list[str] = []
    chosen: dict[str, Any] = {"vessel": "milliampere", "processes": 1, "recipe": folder / "recipe.toml", **options}
    result = batch([str(one) for one in asked], folder / "out", progress=lambda stage: None, tell=told.append, **chosen)
    return result, told


def rows_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Return what shows by the name of the folder that a row was not written again: inode and time of change."""
    return {
        path.parent.name: (path.stat().st_ino, path.stat().st_mtime_ns)
        for path in (folder / "out" / "batch" / "results").glob("*/row.json")
    }


def stay_here(patch: pytest.MonkeyPatch) -> None:
    """Let a batch work in this process, which has loaded everything."""
    patch.setattr(running, "spread", lambda processes, dask, *, apart: spread())


def same(result: BatchResult) -> str:
    """Return what two runs must agree on: all rows but time and memory."""
    rows = [{k: v for k, v in row.items() if k not in ("seconds", "peak_bytes")} for row in result.to_json()["rows"]]
    return json.dumps(rows, indent=1)
