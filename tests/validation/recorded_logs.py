"""Small recordings to conceal effects in: a simulated trial of the bundled fixture, and a hand-made zigzag in one table."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ferryid.validation.recorded.log import FOLDER, MESSAGES, RecordedLog, read_log
from ferryid.validation.recorded.writing import write_log
from ferryid.vessel import load_profile

BAG = Path(__file__).resolve().parents[2] / "fixtures" / "short.bag"


@cache
def ferry() -> RecordedLog:
    """Return 45 s of a ferry with two thrusters that turn, whose wind was not measured."""
    log = read_log(str(BAG), load_profile("milliampere"))
    return replace(log, measurements=replace(log.measurements, wind=None))


@cache
def folder() -> RecordedLog:
    """Return the same as a folder of tables."""
    with TemporaryDirectory() as there:
        return written(replace(ferry(), kind=FOLDER), Path(there))


@cache
def tanker() -> RecordedLog:
    """Return a minute of a tanker model with propeller and rudder, in one table."""
    with TemporaryDirectory() as there:
        return read_log(str(zigzag(Path(there) / "zigzag.dat", 60.0)), load_profile("kvlcc2-model"))


def zigzag(path: Path, seconds: float) -> Path:
    """Write a zigzag as the tank's files have it."""
    t = np.arange(0.0, seconds, 0.05)
    psi, u, v = 0.3 * np.sin(0.2 * t), 1.0 + 0.1 * np.cos(0.3 * t), 0.1 * np.sin(0.25 * t)
    r = 0.06 * np.cos(0.2 * t)
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    x, y = np.cumsum(north) * 0.05, np.cumsum(east) * 0.05
    rudder, speed = 10.0 * np.sin(0.3 * t), 9.0 + np.sin(0.1 * t)
    thrust = 40.0 + 5.0 * np.sin(0.4 * t)
    columns = (t, x, y, np.degrees(psi), north, east, np.degrees(r), 0.0 * t, rudder, speed, thrust, 0.0 * t)
    rows = "\n".join(" ".join(f"{value:.9f}" for value in row) for row in np.column_stack(columns))
    path.write_text("a\nb\nc\nd\n" + rows + "\n", encoding="cp1252")
    return path


def written(log: RecordedLog, folder: Path) -> RecordedLog:
    """Return a recording as it reads once it was written."""
    return read_log(str(write_log(log, folder, "again")), log.profile)


KINDS = {MESSAGES: ferry, FOLDER: folder, "table": tanker}
