"""Two short logs of one truth: another path, another seed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ferryid.simulate import simulate, write_log
from tests.reach.places import FERRY, Place

POINTS = "[[0, 0, 0], [14, 4, 60], [10, -8, 180], [-4, -10, 270], [0, 0, 0]]"
PATHS = (
    Place("first", "Round a square", "milliampere", FERRY + 'path = { kind = "four-corner" }\n'),
    Place("second", "From point to point", "milliampere", FERRY + f'path = {{ kind = "points", points = {POINTS} }}\n'),
)
WIND = {"environment": {"wind": {"north_mps": -5.0, "east_mps": 4.0}}}
WEAK = {"thrusters": {"faults": [{"thruster": "thruster1", "factor": 0.6}]}}


def two_logs(folder: Path, tables: Mapping[str, Any], seed: int = 1) -> tuple[str, str]:
    """Return the paths of a first and a second log of vessels that something is wrong with."""
    logs = []
    for i, place in enumerate(PATHS):
        log = folder / f"{place.name}.mcap"
        write_log(simulate(place.scenario(tables), seed + i), log)
        logs.append(str(log))
    return logs[0], logs[1]
