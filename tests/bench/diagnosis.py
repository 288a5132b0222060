"""Diagnoses: how their time and memory grow with the length of a log and with the number of logs, and where the time goes."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ferryid.simulate import load_scenario, simulate, write_log
from tests.bench.page import Row, Section, duration
from tests.bench.processes import whole_process

SCENARIO = """schema = "ferryid.scenario/1"
title = "12-corner calibration of milliAmpère, again and again, in a breeze"
vessel = "milliampere"
start = 2021-04-20T{start}Z
seed = {seed}
duration_s = {seconds}

[path]
kind = "twelve-corner"
dwell_s = {dwell_s:g}
rounds = {rounds}

[controller]
delta = 0.4
sigma = 0.4

[environment.wind]
north_mps = {north:.2f}
east_mps = {east:.2f}
gust_std_mps = 0.25
gust_time_s = 8

[sensors]
imu_rate_hz = 0
camera_rate_hz = 0
"""
DIAGNOSE = ("diagnose", "--vessel", "milliampere")
LENGTHS_S = {720: 5.0, 1440: 8.0, 3600: 45.0, 7200: 90.0}
"""Lengths of a single log [s], and the goal of each [s]."""
LOGS = {2: None, 7: None, 14: 20.0}
"""Logs of seven minutes in a campaign, and the goal of as many [s]."""
BAGS, BAGS_GOAL_S = 60, 30.0
"""Bags of twenty seconds, and their goal."""
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
from ferryid.diagnose.parallel import keep_to_one_thread
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
    """Measure diagnoses as whole processes; `quick` on two short logs, two of them together and four bags."""
    lengths = {240: None, 480: None} if quick else LENGTHS_S
    logs = {2: None} if quick else LOGS
    bags = {4: None} if quick else {BAGS: BAGS_GOAL_S}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        single = {seconds: [_written(folder, 0, seconds)] for seconds in lengths}
        part_s = 200 if quick else 420
        together = {count: [_written(folder, 1 + k, part_s) for k in range(count)] for count in logs}
        short = {count: [_written(folder, 100 + k, 20) for k in range(count)] for count in bags}
        rows, taken = [], dict[str, dict[float, float]]()
        for title, kind, goals in (
            ("{:.0f} min", single, lengths),
            (f"campaign of {{:.0f}} logs of {part_s / 60:.2g} min", together, logs),
            ("campaign of {:.0f} bags of 20 s", short, bags),
        ):
            times = taken.setdefault(title, {})
            for size, paths in kind.items():
                took, much = _measured(paths, folder)
                times[float(size)] = took
                what = title.format(size / 60 if kind is single else size)
                rows.append(_row(what, took, much, goals[size], next(iter(times.values()))))
        notes = [
            "Whole processes, report included, on tables that were ingested before. Where there is a goal, it is the rival.",
            *(_growth(title, times) for title, times in taken.items() if len(times) > 1),
            *_where(folder, single[min(single)], f"a log of {min(single) / 60:.0f} min"),
            *_where(folder, together[max(together)], f"a campaign of {max(together)} logs"),
        ]
    return Section("Diagnosis", rows, notes)


def _measured(paths: list[Path], folder: Path) -> tuple[float, int]:
    """Return time [s] and memory [bytes] of a diagnosis; the logs were ingested before."""
    command = (*DIAGNOSE[:1], *map(str, paths), *DIAGNOSE[1:], "--out", str(folder / "out"))
    for path in paths:
        whole_process(("ingest", str(path), *DIAGNOSE[1:], "--out", str(folder / "out")))
    return whole_process(command)


def _row(what: str, took: float, much: int, goal_s: float | None, smallest_s: float) -> Row:
    ours = f"{duration(took)}, {much / 1e9:.2f} GB"
    if goal_s is None:
        return Row(what, ours, "the smallest of these", duration(smallest_s), took / smallest_s)
    return Row(what, ours, "the goal", duration(goal_s), took / goal_s, "≤ 1", took <= goal_s)


def _growth(title: str, times: dict[float, float]) -> str:
    """Return with which power of the size the time grows, as a sentence."""
    power = float(np.polyfit([math.log(size) for size in times], [math.log(took) for took in times.values()], 1)[0])
    what = "the length" if "min" in title and "campaign" not in title else "the number of logs"
    points = ", ".join(f"{duration(took)}" for took in times.values())
    word = "within" if power <= LINEAR else "**beyond**"
    return f"Time grows with {what} to the power of {power:.2f} ({points}), {word} {LINEAR:g}."


def _where(folder: Path, paths: list[Path], what: str) -> list[str]:
    """Return where the time of a diagnosis goes: by stage, and the functions that take most themselves."""
    arguments = (",".join(map(str, paths)), str(folder / "profiled"), ",".join(STAGES.values()))
    made = subprocess.run([sys.executable, "-c", PROFILE, *arguments], capture_output=True, text=True, check=True)
    found = json.loads(made.stdout.splitlines()[-1])
    total = found["total"]
    stages = "; ".join(f"{title} {found['stages'][name] / total:.0%}" for title, name in STAGES.items())
    own = "; ".join(f"`{name}` {took / total:.0%}" for took, name in found["own"][:SHOWN])
    return [f"Where the time of {what} goes, on one thread: {stages}. By function, without what it calls: {own}."]


def _written(folder: Path, number: int, seconds: int) -> Path:
    """Simulate a log of this length, once; those of a campaign begin one after the other, each in a wind of its own."""
    path = folder / f"log{number}-{seconds}.mcap"
    if path.exists():
        return path
    start = 8 * 3600 + number * (seconds + 60)
    clock = f"{start // 3600 % 24:02d}:{start % 3600 // 60:02d}:{start % 60:02d}"
    angle = 2.4 * number
    toml = path.with_suffix(".toml")
    toml.write_text(
        SCENARIO.format(
            start=clock,
            seed=31 + number,
            seconds=seconds,
            dwell_s=60 if seconds >= 720 else max(5.0, seconds / 12),
            rounds=-(-seconds // 720),
            north=0.7 * math.cos(angle),
            east=0.7 * math.sin(angle),
        ),
        encoding="utf-8",
    )
    write_log(simulate(load_scenario(str(toml))), path)
    return path
