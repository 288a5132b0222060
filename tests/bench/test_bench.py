"""A run of the benchmarks that was ended goes on with the tables that are missing."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.bench import __main__ as bench
from tests.bench import campaigns, commands, diagnosis, ingest, sampled, trials, yardstick
from tests.bench.page import Curve, Row, Section, Timed, page
from tests.bench.processes import Sampled

ROWS: list[Row | Timed] = [
    Row("12 min", "1 s", "rosbags", "20 s", 20.0, "≥ 35", reached=False),
    Row("growth", "2 s", "1 h", "1 s", 2.0),
    Timed("fit", 3.0, 1.5, ", 1 GB"),
]
CURVES = [Curve("diagnose", "length [min]", [(12.0, 5.0), (24.0, 9.0)])]


@pytest.mark.draws
def test_an_ended_run_goes_on_and_the_next_one_measures_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    ends = {"identify"}

    def module(path: str) -> SimpleNamespace:
        name = path.rpartition(".")[2]

        def run(quick: bool, folder: Path | None = None) -> Section:
            asked.append(name)
            if name in ends:
                raise KeyboardInterrupt
            return Section(name, ROWS, [f"A note on {name}."], curves=CURVES, same={"ikpls, 7.2 million rows": 3.4})

        return SimpleNamespace(run=run)

    page = tmp_path / "page.md"
    monkeypatch.setattr(bench, "DONE", tmp_path / "lines.jsonl")
    monkeypatch.setattr(bench, "importlib", SimpleNamespace(import_module=module))
    monkeypatch.setattr(bench.yardstick, "measured", lambda folder: 2 * bench.yardstick.GOALS_S)
    monkeypatch.setattr(bench.time, "perf_counter", lambda: 0.0)
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
    assert "| fit | 3 s, 1 GB | the yardstick | 2.72 s | 1.1 | ≤ 1.1 (1.5 s) | yes |" in resumed
    assert (tmp_path / "page-growth.svg").exists()


@pytest.mark.parametrize(
    ("took_s", "otherwise", "reached"), [(3.0, True, True), (3.1, True, False), (2.9, False, False)]
)
def test_a_goal_in_seconds_is_one_in_yardsticks(took_s: float, otherwise: bool, reached: bool) -> None:
    row = Timed("fit", took_s, 1.5, otherwise=otherwise).row(2 * yardstick.GOALS_S)
    assert row.ratio == pytest.approx(took_s / (2 * yardstick.GOALS_S))
    assert row.over_goal == pytest.approx(3.0 / took_s, rel=5e-3)
    assert row.reached is reached


def test_the_page_says_how_other_work_compares_with_the_yardstick() -> None:
    times, same = [2 * yardstick.GOALS_S], {"ikpls, 7.2 million rows": 6.8, "bare Python, whole process": 0.0045}
    said = "\n".join(yardstick.text(times, same))
    assert "| ikpls, 7.2 million rows | 1.7 s | 6.8 s | 4 |" in said
    assert "0.5 (bare Python, whole process) to 4 (ikpls, 7.2 million rows)" in said
    assert "easier to reach than it was there for work of the first kind, and harder to reach than it was there" in said


def test_the_page_begins_with_what_is_missed_and_what_limits_it() -> None:
    slow = Row("2 h", "1 s", "rosbags", "20 s", 20.0, "≥ 35", reached=False, limit="Decompressing alone is 63 times.")
    rows = [slow, Timed("fit", 2.9, 1.5, limit="Not shown."), Timed("simulate", 3.1, 1.5, limit="Importing takes 1 s.")]
    said = page([Section("A", rows, yardstick_s=[2 * yardstick.GOALS_S])], quick=False)
    listed = said.partition("## Goals that are missed, and what limits them\n\n")[2].partition("\n\n## A")[0]
    assert listed.splitlines() == [
        "- 2 h (rosbags): 20 where ≥ 35 is asked for. Decompressing alone is 63 times.",
        "- simulate (the yardstick): 1.14 where ≤ 1.1 (1.5 s) is asked for. Importing takes 1 s.",
    ]
    reached = page([Section("A", rows[1:2], yardstick_s=[2 * yardstick.GOALS_S])], quick=False)
    assert "Goals that are missed" not in reached


def test_what_limits_a_reading_is_not_what_the_least_work_has_too() -> None:
    steps = {
        "decompressing": 9.0,
        "clocks": 0.5,
        "writing": 8.0,
        "copying wanted fields": 2.0,
        "the rest": 1.0,
        "x": 0.1,
    }
    said = ingest.largest(steps)
    assert said.endswith("goes into copying wanted fields (2 s), the rest (1 s), clocks (500 ms).")
    assert "copying wanted fields 2 s, the rest 1 s" in ingest.between(steps)
    assert "x 100 ms" not in ingest.between(steps)


@pytest.mark.parametrize(("took_s", "judged"), [(1700.0, "reached"), (1900.0, "**missed**")])
def test_the_time_of_the_page_is_judged_by_the_yardstick_too(took_s: float, judged: str) -> None:
    parts = [
        Section("A", [], took_s=took_s - 100.0, yardstick_s=[2 * yardstick.GOALS_S]),
        Section("B", [], took_s=100.0),
    ]
    said = page(parts, quick=False)
    assert f"The goal is 661 times, 15 minutes on the machine of the goals: {judged}." in said
    assert f"{took_s / 60:.1f} minutes, {took_s / (2 * yardstick.GOALS_S):.0f} times the yardstick." in said


def test_memory_of_a_campaign_has_a_goal_of_its_own() -> None:
    kept, more = (campaigns._memory("season", much, " in all") for much in (1_500_000_000, 2_500_000_000))
    assert (kept.ours, kept.ratio, kept.reached) == ("1.50 GB in all", 0.75, True)
    # A hundred logs, by 0.1 GB for ten.
    assert campaigns.grown(0.4e9, 0.5e9, 20, 30) == pytest.approx(1.2e9)
    assert more.reached is False
    timed = campaigns._timed("18 logs", (20.0, 2_500_000_000), 60.0)
    assert timed.row(yardstick.GOALS_S).reached is False
    assert campaigns._timed("18 logs", (20.0, 1_500_000_000), 60.0).row(yardstick.GOALS_S).reached is True


BUSY = """
import time
from tests.bench import sampled
end = sampled.begin({"outer": ("<string>:outer",), "inner": ("<string>:inner",)}, 0.001)
def busy(seconds):
    until = time.perf_counter() + seconds
    while time.perf_counter() < until:
        pass
def inner(): busy(0.06)
def outer(): busy(0.03); inner()
outer()
busy(0.03)
end()
"""


def test_the_time_of_a_step_is_that_of_the_step_entered_last() -> None:
    run = subprocess.run([sys.executable, "-c", BUSY], check=True, capture_output=True, text=True)
    found = json.loads(run.stderr.partition("sampled ")[2])
    took = found["steps"]
    # A busy machine makes all of them longer.
    assert took["inner"] >= 0.05
    assert min(took["outer"], took[sampled.REST]) >= 0.02
    assert sum(took.values()) == pytest.approx(found["seen_s"], abs=0.02)
    assert found["looks"] >= 10


def test_every_step_is_a_function_that_there_is() -> None:
    root = Path(bench.__file__).parents[2]
    sources = [f"/{path.relative_to(root)}" for path in (root / "ferryid").rglob("*.py")]

    def exists(function: str) -> bool:
        part, name = function.rsplit(":", 1)
        texts = ((root / source[1:]).read_text(encoding="utf-8") for source in sources if part in source)
        return any(f"def {name}(" in text for text in texts)

    steps = (diagnosis.STEPS, commands.FIT_STEPS, commands.SIMULATION_STEPS, commands.BATCH_STEPS, ingest.PROCESS_STEPS)
    named = [function for one in steps for functions in one.values() for function in functions]
    named += [one for functions in sampled.LOADING.values() for one in functions if one.startswith("/ferryid/")]
    assert [one for one in named if not exists(one)] == []


def test_steps_that_take_little_are_of_the_rest() -> None:
    steps = {"reading": 6.0, "writing": 0.05, "judging": 3.0}
    run = Sampled(10.0, 10**9, steps, {"a.py:b": 5.0, "c.py:d": 1.0}, 16.0, 1000, 0.02, 3.0)
    said = run.where("a campaign")
    assert "Where the 10 s of a campaign go, by 1000 looks at the main thread, which took 20 ms: " in said
    assert "reading 6 s, judging 3 s, the rest 1 s. " in said
    assert "Compiled loops alone keep the main thread for 3 s." in said
    assert "Compiled" not in replace(run, loops_s=0.01).where("a campaign")
    assert "`a.py:b` 50%, `c.py:d` 10%" in said


def test_logs_are_simulated_once_in_a_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made: list[Path] = []

    def simulated(path: Path, number: int, seconds: int, *, gaps: bool, after_s: int) -> None:
        made.append(path)
        path.touch()

    monkeypatch.setattr(trials, "_kept", lambda: SimpleNamespace(name=str(tmp_path)))
    monkeypatch.setattr(trials, "_write", simulated)
    assert trials.written(range(3), 720) == [*trials.written([0, 1], 720), *trials.written([2], 720)]
    # Of another length, or another wind, it is another log.
    assert trials.written([0], 420) != trials.written([0], 720) != trials.written([0], 720, after_s=5)
    assert len(made) == len(set(made)) == 5
