"""A simulated recording as a table, to be edited before a command reads it."""

from __future__ import annotations

import csv
from functools import cache
from io import StringIO
from pathlib import Path
from runpy import run_path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ferryid.simulate import load_scenario, simulate
from ferryid.vessel import load_profile

Floats = NDArray[np.float64]
Table = dict[str, Floats]

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"

SURGE_ALONE = ('fields = ["u [m/s]", "v [m/s]"]', 'fields = ["u [m/s]"]')
_SCENARIO = """
schema = "ferryid.scenario/1"
title = "corners of 0.6 times the usual size"
vessel = "milliampere"
start = 2021-04-20T10:00:00Z
seed = 91
duration_s = 480

[path]
kind = "twelve-corner"
dwell_s = 7.5
size = 0.6

[controller]
delta = 0.4
sigma = 0.4

[sensors]
navigation_rate_hz = 10
thruster_rate_hz = 10
"""


@cache
def _simulated(extra: str) -> str:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "corners.toml"
        path.write_text(_SCENARIO + extra, encoding="utf-8")
        return str(run_path(str(FIXTURES / "__main__.py"))["export_csv"](simulate(load_scenario(path))))


def corners(extra: str = "") -> Table:
    """Return eight minutes of a ferry that goes round corners, one column an array; `extra` are lines of the scenario."""
    return _parsed(_simulated(extra))


def short() -> Table:
    """Return the bundled table of 90 s."""
    return _parsed((FIXTURES / "short.csv").read_text(encoding="utf-8"))


def write(table: Table, path: Path) -> Path:
    """Write a table and return its path."""
    lines = [",".join(table)]
    lines += [",".join(f"{value:.6f}" for value in row) for row in zip(*table.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def profile(folder: Path, *changes: tuple[str, str]) -> Path:
    """Return a profile that reads such tables, with parts of its text replaced."""
    text = load_profile("milliampere").text
    text = text[: text.index("[signals.")] + _SIGNALS
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "table.toml"
    path.write_text(text, encoding="utf-8")
    return path


_SIGNALS = """
[signals.position]
topic = "table"
fields = ["north [m]", "east [m]"]
unit = "m"
frame = "NED"

[signals.heading]
topic = "table"
field = "heading [deg]"
unit = "deg"
frame = "NED"

[signals.velocity]
topic = "table"
fields = ["u [m/s]", "v [m/s]"]
unit = "m/s"
frame = "FRD"

[signals.yaw_rate]
topic = "table"
field = "r [deg/s]"
unit = "deg/s"
frame = "FRD"
""" + "".join(
    f'\n[signals."thruster{k}.{role}"]\ntopic = "table"\nfield = "thruster{k} {field}"\nunit = "{unit}"\n'
    for k in (1, 2)
    for role, field, unit in (("speed", "speed [rpm]", "rpm"), ("angle", "azimuth [deg]", "deg"))
)

POSITION = _SIGNALS[_SIGNALS.index("[signals.position]") : _SIGNALS.index("[signals.heading]")]


def _parsed(text: str) -> Table:
    head, *rows = csv.reader(StringIO(text))
    values = np.array(rows, dtype=np.float64)
    return {name: values[:, column].copy() for column, name in enumerate(head)}
