"""The yardstick: goals in seconds made comparable between machines, and how this machine compares with that of the goals.

Goals in seconds were set on another machine. There, rosbags deserialised all messages of the 12-minute log in MCAP and zstd in
`GOALS_S`; a goal of so many seconds is a goal of so many times that, and what a run takes is divided by the same, measured
several times in that run.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.bench import logs

GOALS_S = 1.362
"""What the yardstick took on the machine of the goals [s]."""
WORK = """
import sys, time
from pathlib import Path
from rosbags.highlevel import AnyReader
start = time.perf_counter()
with AnyReader([Path(sys.argv[1])]) as reader:
    for connection, _, raw in reader.messages():
        reader.deserialize(raw, connection.msgtype)
print(time.perf_counter() - start)
"""
THERE: Mapping[str, float] = {
    "bare Python, whole process": 0.009,
    "import typer, whole process": 0.107,
    "zstd, 2 h of MCAP decompressed": 0.20,
    "bare X'X, 7.2 million rows": 0.13,
    "ikpls, 7.2 million rows": 1.7,
    "scikit-learn PLS, 7.2 million rows": 38.0,
}
"""What else was measured there [s], by what it is; a part of the page that measures the same says so by this name."""


def measured(folder: Path) -> float:
    """Return what rosbags takes to deserialise every message of the 12-minute log, in a process of its own [s]."""
    log = logs.log(folder, "mcap", "zstd", 12.0)
    run = subprocess.run([sys.executable, "-c", WORK, str(log)], check=True, capture_output=True, text=True)
    return float(run.stdout)


def text(times_s: Sequence[float], same: Mapping[str, float]) -> list[str]:
    """Return what the page says of this machine, as lines of Markdown.

    Parameters
    ----------
    times_s
        The yardstick, as often as it was measured in this run [s].
    same
        What this run took for what is in `THERE` [s].
    """
    middle = statistics.median(times_s)
    factor = middle / GOALS_S
    lines = [
        f"**Yardstick**: rosbags deserialises the 12-minute log (MCAP, zstd, 165,600 messages) in {middle:.3g} s, median of "
        f"{len(times_s)} over this run ({min(times_s):.3g} to {max(times_s):.3g}). On the machine of the goals it took "
        f"{GOALS_S} s: this one is {factor:.2g} times as slow at that. A goal in seconds is shown, and judged, as a multiple "
        "of the yardstick there; what it took is divided by the yardstick here.",
        "",
        "| the same work on both machines | there | here | times as slow |",
        "|---|--:|--:|--:|",
        f"| rosbags, 12 min of MCAP deserialised (the yardstick) | {GOALS_S} s | {middle:.3g} s | {factor:.2g} |",
    ]
    factors = {name: took_s / THERE[name] for name, took_s in same.items()}
    lines += [
        f"| {name} | {THERE[name]:.3g} s | {same[name]:.3g} s | {factors[name]:.2g} |"
        for name in THERE
        if name in factors
    ]
    if factors:
        least, most = min(factors, key=lambda name: factors[name]), max(factors, key=lambda name: factors[name])
        lines += [
            "",
            f"The yardstick is Python code. Others differ from its factor, from {factors[least]:.2g} ({least}) to "
            f"{factors[most]:.2g} ({most}): a goal in seconds is {_compared(factor, factors[least])} for work of the first "
            f"kind, and {_compared(factor, factors[most])} for work of the last. Versions of packages may differ.",
        ]
    return [*lines, ""]


def _compared(yardstick: float, work: float) -> str:
    """Return how a goal by the yardstick is reached by work that is so many times as slow here."""
    if abs(work / yardstick - 1.0) < 0.1:
        return "as hard to reach as it was there"
    return "harder to reach than it was there" if work > yardstick else "easier to reach than it was there"
