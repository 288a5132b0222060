"""A run of the benchmarks that was ended goes on with the tables that are missing."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.bench import __main__ as bench
from tests.bench.page import Row, Section

ROWS = [Row("12 min", "1 s", "rosbags", "20 s", 20.0, "≥ 35", reached=False), Row("growth", "2 s", "1 h", "1 s", 2.0)]


@pytest.mark.draws
def test_an_ended_run_goes_on_and_the_next_one_measures_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    ends = {"identify"}

    def module(path: str) -> SimpleNamespace:
        name = path.rpartition(".")[2]

        def run(quick: bool) -> Section:
            asked.append(name)
            if name in ends:
                raise KeyboardInterrupt
            return Section(name, ROWS, [f"A note on {name}."])

        return SimpleNamespace(run=run)

    page = tmp_path / "page.md"
    monkeypatch.setattr(bench, "DONE", tmp_path / "lines.jsonl")
    monkeypatch.setattr(bench, "importlib", SimpleNamespace(import_module=module))
    monkeypatch.setattr(sys, "argv", ["bench", "--out", str(page)])
    with pytest.raises(KeyboardInterrupt):
        bench.main()
    ends.clear()
    bench.main()
    assert asked == ["ingest", "identify", *bench.MODULES[1:]]
    resumed = page.read_text(encoding="utf-8")
    bench.main()
    assert asked[-len(bench.MODULES) :] == list(bench.MODULES)
    assert page.read_text(encoding="utf-8") == resumed
    assert resumed.count("| 12 min | 1 s | rosbags | 20 s | 20 | ≥ 35 | **no** |") == len(bench.MODULES)
