"""Long logs: how time and memory of every command grow from one hour to six, at 20 Hz and with gaps.

The six hours are two recordings of three, joined: as a recorder splits them. Navigation misses 5 s about every ten minutes,
and each thruster 1 s about every twenty.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from ferryid.simulate import load_scenario, simulate, write_log
from tests.bench.page import Row, Section, duration
from tests.bench.processes import whole_process

SCENARIO = """schema = "ferryid.scenario/1"
title = "12-corner calibration of milliAmpère, again and again, with gaps"
vessel = "milliampere"
start = 2021-04-20T{start}Z
seed = {seed}
duration_s = {seconds}

[path]
kind = "twelve-corner"
dwell_s = 60
rounds = {rounds}

[controller]
delta = 0.4
sigma = 0.4

[environment.wind]
north_mps = 0.6
east_mps = -0.4
gust_std_mps = 0.25
gust_time_s = 8

[sensors]
imu_rate_hz = 0
camera_rate_hz = 0
dropouts_per_min = 0.05
dropout_s = 1.0

[sensors.navigation]
dropouts_per_min = 0.1
dropout_s = 5.0
"""
VESSEL = ("--vessel", "milliampere")
SCALE = ("--delta", "0.4", "--sigma", "0.4")
GOAL = 6.6
"""Six times the log may take a tenth more than six times the time."""
LARGEST_GB = 2.0


def run(quick: bool) -> Section:
    """Measure every command on a log of one hour and on one of six; `quick` on 12 minutes and on 24."""
    one_s, parts_s = (720, (720, 720)) if quick else (3600, (10_800, 10_800))
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts = [_written(folder, f"part{number}", seconds, number) for number, seconds in enumerate(parts_s)]
        whole = "+".join(map(str, parts))
        one = str(_written(folder, "one", one_s, 7))
        commands = _commands(folder)
        if quick:
            commands = {title: commands[title] for title in ("inspect", "ingest", "fit", "evaluate", "fit --archive")}
        for title, command in commands.items():
            (base, little), (took, much) = (
                whole_process([part.format(log=log, out=folder / out) for part in command])
                for log, out in ((one, "short"), (whole, "long"))
            )
            ratio = took / base
            values = (
                f"{duration(took)}, {much / 1e9:.2f} GB",
                "the shorter log",
                f"{duration(base)}, {little / 1e9:.2f} GB",
            )
            rows.append(Row(title, *values, ratio, f"≤ {GOAL:g}", ratio <= GOAL and much / 1e9 <= LARGEST_GB))
    length = "24 min against 12" if quick else "6 h against 1 h"
    notes = [
        f"Whole processes, {length}; the goal holds the growth of time, and {LARGEST_GB:g} GB of memory. "
        "Ingestion comes first, so that the commands after it read the kept tables.",
    ]
    return Section("Long logs with gaps", rows, notes)


def _commands(folder: Path) -> dict[str, tuple[str, ...]]:
    """Return every command that reads logs, in an order in which each finds what it needs."""
    out = ("--out", "{out}")
    recipe = folder / "recipe.toml"
    recipe.write_text('steps = ["fit"]\n', encoding="utf-8")
    return {
        "inspect": ("inspect", "{log}", *VESSEL),
        "ingest": ("ingest", "{log}", *VESSEL, *out),
        "fit": ("fit", "{log}", *VESSEL, *SCALE, *out),
        "fit --window auto": ("fit", "{log}", *VESSEL, *SCALE, *out, "--window", "auto"),
        "evaluate": ("evaluate", "milliampere@1", "{log}", *out),
        "compare": ("compare", "milliampere@1", "milliampere@2", "--on", "{log}", *out),
        "sweep both": ("sweep", "both", "{log}", *VESSEL, *SCALE, *out),
        "sweep basis": ("sweep", "basis", "{log}", *VESSEL, *SCALE, *out),
        "fit --archive": ("fit", "--archive", *VESSEL, *SCALE, *out),
        "export to MCAP": ("export", "{log}", "--mcap", "{out}/log.mcap", "--model", "milliampere@1", *VESSEL, *out),
        "batch with fits": ("batch", "{log}", *VESSEL, "--recipe", str(recipe), *out),
        "diagnose": ("diagnose", "{log}", *VESSEL, *out),
    }


def _written(folder: Path, name: str, seconds: int, number: int) -> Path:
    """Simulate a log of this length; each begins five seconds after the one with the number before has ended."""
    toml, path = folder / f"{name}.toml", folder / f"{name}.mcap"
    start = 10 * 3600 + number * (seconds + 5)
    clock = f"{start // 3600:02d}:{start % 3600 // 60:02d}:{start % 60:02d}"
    rounds = -(-seconds // 720)
    toml.write_text(SCENARIO.format(start=clock, seed=12 + number, seconds=seconds, rounds=rounds), encoding="utf-8")
    write_log(simulate(load_scenario(str(toml))), path)
    return path
