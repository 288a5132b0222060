"""How long the whole command takes on recordings, the report included."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.bench.campaigns import LOGS_GOAL_S
from tests.bench.diagnosis import LENGTHS_S
from tests.bench.long import DIAGNOSIS_S, LARGEST_GB
from tests.bench.processes import whole_process
from tests.real.places import DATA

HOUR_S, SIX_HOURS_S = LENGTHS_S[3600], DIAGNOSIS_S
"""Aimed at for a log of an hour and for one of six, as on simulated logs, and in proportion between them."""

HEAD = """
## Time and memory

`ferryid diagnose LOG... --vessel NAME` as a process of its own, the report included, recordings not ingested before.

| logs | together | time | aim | memory [GB] | aim | |
|---|---|---|---|---|---|---|"""


@dataclass(frozen=True)
class Timed:
    """What a diagnosis of these logs took: seconds, the most memory [GB] and how much they last together [s]."""

    title: str
    seconds: float
    memory_gb: float
    lasted_s: float
    aim_s: float

    def row(self) -> str:
        """Return it as a row of the table."""
        reached = self.seconds <= self.aim_s and self.memory_gb <= LARGEST_GB
        return (
            f"| {self.title} | {self.lasted_s / 3600.0:.2f} h | {self.seconds:.0f} s | {self.aim_s:.0f} s "
            f"| {self.memory_gb:.2f} | {LARGEST_GB:g} | {'reached' if reached else '**missed**'} |"
        )


def section() -> str:
    """Return the section on time and memory."""
    rows = [
        timed("Esso Osaka, all 18 runs", "esso_osaka/*/*.csv", "esso-osaka", LOGS_GOAL_S),
        timed("Gunnerus, manoeuvres at sea", "gunnerus/RVG_ManeuveringTests.csv", "gunnerus"),
    ]
    return "\n".join([HEAD, *(row.row() for row in rows)])


def timed(title: str, pattern: str, vessel: str, aim_s: float = 0.0) -> Timed:
    """Run the command on recordings; without an aim it is that of one log as long as they are together."""
    logs = [str(path) for path in sorted(DATA.glob(pattern))]
    with tempfile.TemporaryDirectory() as out:
        found = Path(out) / "found.json"
        seconds, peak = whole_process(["diagnose", *logs, "--vessel", vessel, "--out", out, "--json", str(found)])
        made = json.loads(found.read_text(encoding="utf-8"))
    lasted = sum(float(one["duration_s"]) for one in made.get("logs", [made]))
    return Timed(title, seconds, peak * 1e-9, lasted, aim_s or single_log_s(lasted))


def single_log_s(lasted_s: float) -> float:
    """Return what a diagnosis of one log may take [s]: in proportion up to an hour, and between the aims after it."""
    hours = lasted_s / 3600.0
    return hours * HOUR_S if hours <= 1.0 else HOUR_S + (hours - 1.0) / 5.0 * (SIX_HOURS_S - HOUR_S)
