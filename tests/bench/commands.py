"""Commands as a person runs them, start-up included: whole processes, with goals in seconds."""

from __future__ import annotations

import os
import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ferryid.batch.kept import key_of, read_row, write_row
from ferryid.batch.log_result import LogFile
from ferryid.simulate import load_scenario, simulate, write_log
from tests.bench.page import Row, Section, Timed, faster_row
from tests.bench.processes import SHORT_INTERVAL_S, imports, sampled_process, whole_process
from tests.bench.trials import SCALE, VESSEL

TABLES = ("numpy", "pyarrow", "pyarrow.parquet", "typer")
"""Packages that any program needs which has a command line and writes Parquet."""
STATISTICS = ("scipy.linalg", "scipy.special")
"""What a fit needs besides: banded equations, and quantiles of its intervals."""
COMPILED = ("numpy", "numba", "typer")
"""What a simulation needs."""
FIT_STEPS = {
    "reading and putting on one grid": ("/identify/inputs.py:usable_logs",),
    "smoothing and residuals": ("/identify/motion_data.py:prepared_data",),
    "forces that act the wrong way": ("/identify/force_signs.py:refuse_reversed_forces",),
    "length of the windows": ("/identify/window_length.py:with_best_length",),
    "wind and gusts of each log": ("/identify/weak_data.py:conditions",),
    "components, and which estimator": ("/identify/pipeline.py:_choose_data",),
    "estimates and bootstrap": ("/identify/estimation.py:estimate_correction",),
    "runs of the model without the measured motion": (
        "/identify/motion_data.py:free_runs",
        "/windowed_data.py:free_runs",
    ),
    "judging": ("/identify/pipeline.py:accept_estimate",),
    "storing the model": ("/models/store/versions.py:save",),
    "page and figures": ("/report/fit_report.py:_write_page",),
}
SIMULATION_STEPS = {
    "simulating": ("/simulate/trial.py:simulate",),
    "writing the log": ("/simulate/logs.py:write_log",),
}
BATCH_STEPS = {
    "finding the logs": ("/batch/logs.py:entries_of",),
    "comparing with what is kept": ("/batch/kept.py:__init__", "/batch/kept.py:of", "/batch/run.py:_task"),
    "summing up": ("/batch/run.py:_summed_up", "/batch/run.py:_changes"),
    "page and figures": ("/report/batch_page.py:render", "/report/batch_page.py:timelines"),
}
"""Functions of the steps of a fit, a simulation and a batch."""
ROUND = """
schema = "ferryid.scenario/1"
title = "One round of the 12-corner path"
vessel = "milliampere"
duration_s = 720

[path]
kind = "twelve-corner"
"""
SHORT = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"


def run(quick: bool) -> Section:
    """Measure; `quick` fewer times, and a batch of a hundred logs."""
    repeats, logs = (1, 100) if quick else (3, 1000)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trial, scenario = folder / "trial.mcap", folder / "round.toml"
        write_log(simulate(load_scenario("twelve-corner"), 12), trial)
        scenario.write_text(ROUND, encoding="utf-8")
        log = ("--log", str(folder / "round.mcap"), "--overwrite")
        simulation, resume = ("simulate", str(scenario), *log), _resumable(folder / "batch", logs)
        fit = ("fit", str(trial), *VESSEL, *SCALE)
        rows, where = list[Row | Timed](), list[str]()
        for what, title, took, goal_s, words, steps, packages in (
            (
                "ferryid fit, 24 min, with its report",
                "`fit` of 24 min",
                _fits(folder, trial, (), repeats),
                1.5,
                (*fit, "--out", str(folder / "page")),
                FIT_STEPS,
                (*TABLES, *STATISTICS, "matplotlib.figure"),
            ),
            (
                "ferryid fit --no-report, 24 min",
                "`fit --no-report`",
                _fits(folder, trial, ("--no-report",), repeats),
                0.8,
                (*fit, "--no-report", "--out", str(folder / "bare")),
                FIT_STEPS,
                (*TABLES, *STATISTICS),
            ),
            (
                "ferryid simulate, 12 min",
                "`simulate` of 12 min",
                _times([simulation] * (repeats + 1))[1:],
                1.0,
                simulation,
                SIMULATION_STEPS,
                COMPILED,
            ),
            (
                f"ferryid batch, {logs} logs and nothing to do",
                f"`batch` of {logs} logs and nothing to do",
                _times([resume] * repeats),
                5.0,
                resume,
                BATCH_STEPS,
                ("numpy", "typer"),
            ),
        ):
            run, alone = sampled_process(words, steps, interval_s=SHORT_INTERVAL_S), imports(packages)
            limit = alone.limit(run, goal_s)
            rows.append(Timed(f"{what}, whole process", statistics.median(took), goal_s, limit=limit))
            where.append(alone.floor(title, run))
        rows += [] if quick else _compiled(folder, scenario)
    notes = (
        *where,
        "The log of a fit is read each time; what numba compiles is kept from the first run. The logs of the batch are links "
        "to one file, whose result is kept for each of them under its own name and hash.",
    )
    return Section("Commands", rows, notes, ("numba", "matplotlib", "typer"))


def _compiled(folder: Path, scenario: Path) -> list[Row]:
    """Return how long a first simulation and a first diagnosis take, for which everything is compiled, beside the next."""
    log, cache = str(folder / "first.mcap"), {"NUMBA_CACHE_DIR": str(folder / "compiled")}
    diagnosis = ("diagnose", log, *VESSEL, "--out", str(folder / "first"))
    rows = []
    for what, words in (
        ("ferryid simulate, 12 min", ("simulate", str(scenario), "--log", log, "--overwrite")),
        ("ferryid diagnose, 12 min", diagnosis),
    ):
        first, again = (whole_process(words, cache)[0] for _ in range(2))
        rows.append(faster_row(f"{what}, whole process", [again], "the first time, when it is compiled", [first], None))
    return rows


def _fits(folder: Path, trial: Path, more: Sequence[str], repeats: int) -> list[float]:
    outs = [("--out", str(folder / f"fit{number}{len(more)}")) for number in range(repeats)]
    return _times([("fit", str(trial), *VESSEL, *SCALE, *more, *out) for out in outs])


def _resumable(folder: Path, logs: int) -> tuple[str, ...]:
    """Return the words of a batch all of whose logs are done."""
    folder.mkdir()
    recipe, out = folder / "recipe.toml", folder / "out"
    recipe.write_text('steps = ["fit"]\n[fit]\naccept = "thesis"\n', encoding="utf-8")
    paths = [folder / f"log{number:04d}.mcap" for number in range(logs)]
    os.link(SHORT, paths[0]) if os.stat(SHORT).st_dev == os.stat(folder).st_dev else paths[0].write_bytes(
        SHORT.read_bytes()
    )
    words = ("batch", str(folder / "*.mcap"), *VESSEL, "--recipe", str(recipe), "--out", str(out))
    whole_process(words)
    (first,) = (out / "batch" / "results").iterdir()
    row = read_row(first)
    assert row is not None
    for number, path in enumerate(paths[1:], start=1):
        os.link(paths[0], path)
        state = path.stat()
        files = (LogFile(str(path), state.st_size, state.st_mtime_ns),)
        place = first.with_name(f"{path.stem}-{key_of([path], row.stamp)}")
        place.mkdir()
        write_row(place, replace(row, name=path.stem, files=files, sha256=f"{number:064x}"))
    return words


def _times(commands: Sequence[Sequence[str]]) -> list[float]:
    return [whole_process(words)[0] for words in commands]
