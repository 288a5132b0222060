"""Diagnoses: how their time and memory grow with the length of a log and with the number of logs, and where the time goes."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from math import nan
from pathlib import Path

import numpy as np

from ferryid.signals.recording import record
from ferryid.vessel import load_profile
from tests.bench.page import Curve, Row, Section, Timed, duration
from tests.bench.processes import floor, whole_process
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
    "reading and sensor checks": "gather",
    "several logs together": "judge_campaign",
    "selecting effects": "select",
    "judging": "judge",
    "learning what is left": "learn",
}
"""Functions whose time, all that they call included, is a stage's."""
SHOWN = 8
"""Functions that are listed by the time that they take themselves."""
PROFILE = """
import cProfile, json, pstats, sys
from ferryid import api
from ferryid.side_by_side import keep_to_one_thread
keep_to_one_thread()
logs, out, stages = sys.argv[1].split(","), sys.argv[2], sys.argv[3].split(",")
api.diagnose(logs, "milliampere", out)
profile = cProfile.Profile()
profile.runcall(api.diagnose, logs, "milliampere", out)
found = pstats.Stats(profile)
by_stage = {one: 0.0 for one in stages}
for (file, _, name), (_, _, own, whole, _) in found.stats.items():
    if name in by_stage and "/diagnose/" in file:
        by_stage[name] = max(by_stage[name], whole)
own = sorted(((value[2], f"{key[0].rpartition('/')[2]}:{key[2]}") for key, value in found.stats.items()), reverse=True)
print(json.dumps({"total": found.total_tt, "stages": by_stage, "own": own[:20]}))
"""


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
            ("{:.0f} min", "length [min]", single, lengths),
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
            *_where(folder, single[min(single)], f"a log of {min(single) / 60:.0f} min"),
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


def _where(folder: Path, paths: list[Path], what: str) -> list[str]:
    """Return where the time of a diagnosis goes: by stage, and the functions that take most themselves."""
    arguments = (",".join(map(str, paths)), str(folder / "profiled"), ",".join(STAGES.values()))
    made = subprocess.run([sys.executable, "-c", PROFILE, *arguments], capture_output=True, text=True, check=True)
    found = json.loads(made.stdout.splitlines()[-1])
    total = found["total"]
    stages = "; ".join(f"{title} {found['stages'][name] / total:.0%}" for title, name in STAGES.items())
    own = "; ".join(f"`{name}` {took / total:.0%}" for took, name in found["own"][:SHOWN])
    return [f"Where the time of {what} goes, on one thread: {stages}. By function, without what it calls: {own}."]
