"""Diagnoses: how their time and memory grow with the length of a log and with the number of logs, and where the time goes."""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Mapping
from math import nan
from pathlib import Path

import numpy as np

from ferryid.signals.recording import record
from ferryid.vessel import load_profile
from tests.bench.page import Curve, Row, Section, Timed, duration
from tests.bench.processes import floor, where, whole_process
from tests.bench.trials import VESSEL, written

LENGTHS_S = {720: 5.0, 1440: 8.0, 3600: 45.0, 7200: 90.0}
"""Lengths of a single log [s], and the goal of each [s]; six hours are measured with gaps, in `tests.bench.long`."""
REPEATED_S, REPEATS = 720, 3
"""Logs up to this length [s] are diagnosed so many times, and the median counts."""
LOGS = {2: None, 5: None, 14: 20.0}
"""Logs of seven minutes in a campaign, and the goal of as many [s]."""
LINEAR = 1.1
"""Most power of the length, and of the number of logs, with which the time may grow."""
STAGES = {
    "reading and sensor checks": "/diagnose/:gather",
    "several logs together": "/diagnose/:judge_campaign",
    "selecting effects": "/diagnose/:select",
    "judging": "/diagnose/:judge",
    "of that the interval of an onset or end": "/judging/findings.py:_time",
    "learning what is left": "/diagnose/:learn",
    "page and figures": "/report/diagnosis_report.py:report",
}
PROFILED_S = (720, 1440)
"""Lengths of the logs whose diagnosis is profiled [s]."""


def run(quick: bool) -> Section:
    """Measure diagnoses as whole processes; `quick` on a short log."""
    lengths = {240: None} if quick else LENGTHS_S
    logs = {} if quick else LOGS
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        single = {seconds: [written(folder, 0, seconds)] for seconds in lengths}
        part_s = 200 if quick else 420
        together = {count: [written(folder, 1 + k, part_s) for k in range(count)] for count in logs}
        rows, curves, shortest_s = list[Row | Timed](), list[Curve](), nan
        for title, against, kind, goals in (
            ("diagnose, {:.0f} min", "length [min]", single, lengths),
            (f"campaign of {{:.0f}} logs of {part_s / 60:.2g} min", "number of logs", together, logs),
        ):
            times: dict[float, float] = {}
            for number, paths in kind.items():
                repeats = REPEATS if kind is single and number <= REPEATED_S and not quick else 1
                took, much = _measured(paths, folder, repeats)
                size = number / 60 if kind is single else number
                times[size] = took
                rows.append(_row(title.format(size), took, much, goals[number], next(iter(times.values()))))
            if kind is single:
                shortest_s = times[min(times)]
            if len(times) > 1:
                curves.append(
                    Curve(f"diagnose, {'one log' if kind is single else 'campaign'}", against, list(times.items()))
                )
        notes = [
            "Whole processes, report included, on tables that were ingested before; logs of up to "
            f"{REPEATED_S / 60:.0f} min {REPEATS} times, of which the median counts.",
            *(_growth(curve) for curve in curves),
            floor(
                f"`diagnose` of {min(single) / 60:.0f} min",
                shortest_s,
                *(
                    ("diagnose", str(*single[min(single)]), *VESSEL, "--out", str(folder / out))
                    for out in ("out", "out")
                ),
                ("numpy", "numba", "scipy.optimize", "scipy.signal", "pyarrow.parquet", "matplotlib.figure", "typer"),
            ),
            *_where(folder, {seconds: paths for seconds, paths in single.items() if quick or seconds in PROFILED_S}),
        ]
    return Section("Diagnosis", rows, notes, curves=curves)


def _measured(paths: list[Path], folder: Path, repeats: int) -> tuple[float, int]:
    """Return the median time [s] and the most memory [bytes] of diagnoses; the logs were ingested before."""
    more = (*VESSEL, "--out", str(folder / "out"))
    for path in paths:
        record(path, load_profile("milliampere"), folder / "out")
    command = ("diagnose", *map(str, paths), *more)
    took, much = zip(*(whole_process(command) for _ in range(repeats)), strict=True)
    return statistics.median(took), max(much)


def _row(what: str, took: float, much: int, goal_s: float | None, smallest_s: float) -> Row | Timed:
    memory = f", {much / 1e9:.2f} GB"
    if goal_s is None:
        return Row(what, duration(took) + memory, "the smallest of these", duration(smallest_s), took / smallest_s)
    return Timed(what, took, goal_s, memory)


def _growth(curve: Curve) -> str:
    """Return with which power of the size the time grows, as a sentence."""
    power = float(np.polyfit(*np.log(np.array(curve.points)).T, 1)[0])
    what = curve.against.partition(" [")[0]
    points = ", ".join(duration(took) for _, took in curve.points)
    word = "within" if power <= LINEAR else "**beyond**"
    return f"Time of {curve.what} grows with the {what} to the power of {power:.2f} ({points}), {word} {LINEAR:g}."


def _where(folder: Path, logs: Mapping[int, list[Path]]) -> list[str]:
    """Return where the time of diagnoses goes, of logs by their length [s]."""
    words = {
        f"a log of {seconds / 60:.0f} min": ("diagnose", *map(str, paths), *VESSEL, "--out", str(folder / "profiled"))
        for seconds, paths in logs.items()
    }
    return where(STAGES, next(iter(words.values())), words)
