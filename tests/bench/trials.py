"""Simulated trials to measure on: the 12-corner path of milliAmpère, of any length, again and again."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from ferryid.simulate import load_scenario, simulate, write_log
from tests.bench.preparing import preparing

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
GAPS = """dropouts_per_min = 0.05
dropout_s = 1.0

[sensors.navigation]
dropouts_per_min = 0.1
dropout_s = 5.0
"""
ROUND_S = 720
VESSEL = ("--vessel", "milliampere")
SCALE = ("--delta", "0.4", "--sigma", "0.4")


@cache
def _kept() -> tempfile.TemporaryDirectory[str]:
    """Return the folder of the logs of this run, which is gone when it ends: another run may have another simulator."""
    return tempfile.TemporaryDirectory(prefix="ferryid-bench-trials-")


def written(numbers: Iterable[int], seconds: int, *, gaps: bool = False, after_s: int = 60) -> list[Path]:
    """Return logs of this length as MCAP; those that no part of this run has asked for before are simulated.

    Parameters
    ----------
    numbers
        Each begins `after_s` after the one with the number before has ended, and, without gaps, has a wind of its own.
    seconds
        Length [s].
    gaps
        Navigation misses 5 s about every ten minutes, and each thruster 1 s about every twenty.
    after_s
        Time between the logs [s].
    """
    folder = Path(_kept().name)
    paths = {n: folder / f"{'gaps' if gaps else 'log'}{n:03d}-{seconds}-{after_s}.mcap" for n in numbers}
    with preparing():
        for number, path in paths.items():
            if not path.exists():
                _write(path, number, seconds, gaps=gaps, after_s=after_s)
    return list(paths.values())


def _write(path: Path, number: int, seconds: int, *, gaps: bool, after_s: int) -> None:
    start = 8 * 3600 + number * (seconds + after_s)
    clock = f"{start // 3600 % 24:02d}:{start % 3600 // 60:02d}:{start % 60:02d}"
    # Parts of one recording are in one wind.
    angle = 0.0 if gaps else 2.4 * number
    text = SCENARIO.format(
        start=clock,
        seed=31 + number,
        seconds=seconds,
        dwell_s=60 if seconds >= ROUND_S else max(5.0, seconds / 12),
        rounds=-(-seconds // ROUND_S),
        north=0.7 * math.cos(angle),
        east=0.7 * math.sin(angle),
    )
    toml = path.with_suffix(".toml")
    toml.write_text(text + (GAPS if gaps else ""), encoding="utf-8")
    write_log(simulate(load_scenario(str(toml))), path)
