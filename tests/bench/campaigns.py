"""Campaigns: time of many logs and of many bags diagnosed together, and how memory grows, as whole processes."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tests.bench.diagnosis import STEPS
from tests.bench.page import Row, Section, Timed, duration
from tests.bench.processes import Sampled, sampled_process
from tests.bench.trials import VESSEL, written

LARGEST_GB = 2.0
LOGS, LOG_S, LOGS_GOAL_S = 18, 720, 60.0
"""Logs of a campaign, the length of each [s], and the goal of all [s]."""
BAGS, BAG_S, BAGS_GOAL_S = 60, 20, 30.0
"""Bags of a campaign, the length of each [s], and the goal of all [s]."""
SEASON, MORE = 100, 36
"""Logs of `LOG_S` whose memory has a goal, and the larger of two numbers that are measured: each log adds the same, once there
are so many that the fits to all rows take most; of two logs the search for effects does.
"""
IN_TURN = "import ferryid.diagnose.judging.learning as learning; learning.MOST_ROWS_AT_ONCE = 0"
"""As in a season, whose fits are made one after another: side by side a few logs would take more memory each."""


def run(quick: bool) -> Section:
    """Measure campaigns on logs that were read by nobody before; `quick` a few short ones."""
    logs, log_s, bags, more = (2, 120, 4, 3) if quick else (LOGS, LOG_S, BAGS, MORE)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        long, short = written(range(1, 1 + more), log_s), written(range(200, 200 + bags), BAG_S)
        of = f"{log_s / 60:.2g} min"
        some, parted, every = (
            _diagnosed(paths, folder / out) for paths, out in ((long[:logs], "logs"), (short, "bags"), (long, "more"))
        )
        timed = (
            (f"campaign of {logs} logs of {of}", some, LOGS_GOAL_S),
            (f"campaign of {bags} bags of {BAG_S} s", parted, BAGS_GOAL_S),
        )
        rows: list[Row | Timed] = [
            *(replace(_timed(what, (run.took_s, run.peak), goal_s), limit=run.limit) for what, run, goal_s in timed),
            _memory(
                f"campaign of {SEASON} logs of {of}, memory by {logs} and {more} logs",
                grown(some.peak, every.peak, logs, more),
                f", {every.peak / 1e9:.2f} GB and {duration(every.took_s)} of {more}",
            ),
        ]
    notes = [
        f"`diagnose LOG...` of all together, whole processes, from the recorded logs to the report; {LARGEST_GB:g} GB of "
        "memory are allowed in every row. Every log has a wind of its own and noise of its own.",
        "The fits of the model to all rows are made one after another here, as with a hundred logs, and not side by side.",
        *(run.where(what) for what, run, _ in timed),
    ]
    return Section("Campaigns", rows, notes)


def _diagnosed(paths: Sequence[Path], out: Path) -> Sampled:
    """Return a diagnosis into a folder that is empty, measured."""
    return sampled_process(("diagnose", *map(str, paths), *VESSEL, "--out", str(out)), STEPS, before=IN_TURN)


def _timed(what: str, measured: tuple[float, int], goal_s: float) -> Timed:
    took, much = measured
    return Timed(what, took, goal_s, f", {much / 1e9:.2f} GB", otherwise=much / 1e9 <= LARGEST_GB)


def grown(few_bytes: float, many_bytes: float, few: int, many: int) -> float:
    """Return the peak memory of a season [bytes], by those of campaigns of few and of many logs."""
    return many_bytes + (SEASON - many) * max(many_bytes - few_bytes, 0.0) / (many - few)


def _memory(what: str, much: float, more: str) -> Row:
    """Return the row of a campaign whose memory has a goal."""
    share = much / 1e9 / LARGEST_GB
    return Row(
        what,
        f"{much / 1e9:.2f} GB{more}",
        "memory allowed",
        f"{LARGEST_GB:g} GB",
        share,
        "≤ 1",
        share <= 1.0,
    )
