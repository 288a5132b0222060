"""Recorded series of wind for a scenario: a small CSV file beside it."""

from __future__ import annotations

import csv
from math import isfinite
from pathlib import Path

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.types import Floats

COLUMNS = (("time", "time_s", "t"), ("north", "north_mps"), ("east", "east_mps"))
"""The columns, by any of these names, in any order."""
FASTEST_MPS = 60.0
"""Largest component of a wind [m/s], as for `ferryid.simulate.sections.Wind`."""


def read_series(path: Path) -> tuple[Floats, Floats, Floats]:
    """Read a series of velocities from a CSV file with a header.

    Parameters
    ----------
    path
        A file with the columns time [s], rising, north and east [m/s]; others are ignored.

    Returns
    -------
    t, north, east
        Shape (n,) each.

    Raises
    ------
    FerryIdError
        When the file cannot be read, lacks a column or holds what is no such number; the message gives the line.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.reader(file))
    except OSError as error:
        raise FerryIdError(f"{path}: the series cannot be read, {error.strerror}. Fix: check the path") from error
    # A name with a zero in it is a ValueError, as is text that is no UTF-8.
    except (ValueError, csv.Error) as error:
        raise FerryIdError(f"{path}: the series is no CSV text, {error}. Fix: save it as CSV in UTF-8") from error
    filled = [(number, row) for number, row in enumerate(rows, start=1) if any(cell.strip() for cell in row)]
    places = _places(path, filled[0][1] if filled else [])
    values: list[tuple[float, float, float]] = []
    for number, row in filled[1:]:
        now = _numbers(path, number, row, places)
        if values and now[0] <= values[-1][0]:
            raise FerryIdError(
                f"{path}:{number}: the time must rise from row to row, found {now[0]:g} after {values[-1][0]:g}. "
                "Fix: sort the rows by time and keep one of each"
            )
        values.append(now)
    if not values:
        raise FerryIdError(f"{path}: the series has no rows, found only its header. Fix: add rows of time, north, east")
    t, north, east = np.asarray(values, dtype=np.float64).T.copy()
    return t, north, east


def _places(path: Path, header: list[str]) -> tuple[int, ...]:
    """Return where the three columns stand."""
    names = [cell.strip().lower() for cell in header]
    places = []
    for options in COLUMNS:
        found = [names.index(name) for name in options if name in names]
        if not found:
            shown = ", ".join(names)[:80] or "an empty file"
            raise FerryIdError(
                f'{path}:1: the series lacks the column "{options[0]}", found {shown}. '
                "Fix: head the file with the line time,north,east"
            )
        places.append(found[0])
    return tuple(places)


def _numbers(path: Path, number: int, row: list[str], places: tuple[int, ...]) -> tuple[float, float, float]:
    values = []
    for place, limit, name in zip(places, (1e9, FASTEST_MPS, FASTEST_MPS), ("time", "north", "east"), strict=True):
        cell = row[place].strip() if place < len(row) else ""
        try:
            value = float(cell)
        except ValueError as error:
            raise FerryIdError(
                f'{path}:{number}: "{name}" must be a number, found "{cell[:40]}". Fix: correct the row'
            ) from error
        if not isfinite(value) or abs(value) > limit:
            raise FerryIdError(
                f'{path}:{number}: "{name}" must be at most {limit:g} large, found {cell[:40]}. Fix: correct the row'
            )
        values.append(value)
    return values[0], values[1], values[2]
