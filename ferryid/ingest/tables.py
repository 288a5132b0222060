"""What every table format shares: the reader, times of the rows, and losses counted in one way."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.arrow_columns import MISSING_TIME
from ferryid.ingest.log import Column, Loss, Series, TableLayout, Topic
from ferryid.ingest.table_time import (
    UNIT_NS,
    TimePlan,
    datetimes_to_ns,
    has_time_word,
    numbers_to_ns,
    stamps_to_ns,
    unit_doubt,
)
from ferryid.types import Flags

FARTHEST_NS = 1 << 62
"""Times further from 1970 (146 years) count as unreadable: the difference of two of them would not fit into 64 bits."""
_WHOLE = re.compile(r"\s*([+-]?[0-9]{1,18}|[+-]?[0-8][0-9]{18})\s*$")


@dataclass(frozen=True)
class Rows:
    """Columns of one table as they were parsed, with what was lost and repaired on the way."""

    columns: Mapping[str, Column]
    losses: tuple[Loss, ...] = ()
    notes: tuple[str, ...] = ()


class Sheet(Protocol):
    """One table of one file: what it holds is known, its rows are parsed by `load` only."""

    @property
    def path(self) -> Path: ...

    @property
    def topic(self) -> Topic: ...

    @property
    def time(self) -> TimePlan: ...

    def load(self, names: Sequence[str]) -> Rows:
        """Parse the named columns and no others, every row that can be parsed."""
        ...


class TableReader:
    """Reader of one or several tables, each a topic (see `ferryid.ingest.log.Reader`)."""

    def __init__(self, sheets: Sequence[Sheet], losses: Sequence[Loss] = ()) -> None:
        self._sheets = {sheet.topic.name: sheet for sheet in sheets}
        # A file may hold several.
        self.paths = tuple(dict.fromkeys(sheet.path for sheet in sheets))
        self.topics = tuple(sheet.topic for sheet in sheets)
        self.losses = tuple(losses)

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Parse the wanted columns of the wanted tables; see `ferryid.ingest.log.Reader.read`.

        Every row of a text file is parsed anyway and Parquet checks its pages, so that `verify` adds nothing.
        """
        series: dict[str, Series] = {}
        losses: list[Loss] = []
        notes: dict[str, str] = {}
        for name, fields in wanted.items():
            if name not in self._sheets:
                raise FerryIdError(
                    f'{self.paths[0]}: there is no topic "{name}" in this table.{did_you_mean(name, self._sheets)} '
                    f"Fix: use one of {_listed(self._sheets)}"
                )
            sheet = self._sheets[name]
            for field in fields:
                if field not in sheet.topic.fields:
                    raise FerryIdError(
                        f'{sheet.path}: there is no column "{field}".{did_you_mean(field, sheet.topic.fields)} '
                        f"Fix: use one of {_listed(sheet.topic.fields)}"
                    )
            one, lost, repaired = _series(sheet, tuple(fields))
            series[name] = one
            losses += lost
            notes[name] = "; ".join(part for part in (sheet.topic.note, *repaired) if part)
        known = {(loss.file, loss.what, loss.topic) for loss in self.losses}
        self.losses += tuple(loss for loss in losses if (loss.file, loss.what, loss.topic) not in known)
        self.topics = tuple(
            replace(topic, note=notes[topic.name], count=len(series[topic.name].receive_ns))
            if topic.name in notes
            else topic
            for topic in self.topics
        )
        return series


def _series(sheet: Sheet, fields: tuple[str, ...]) -> tuple[Series, list[Loss], tuple[str, ...]]:
    plan, topic = sheet.time, sheet.topic.name
    names = tuple(dict.fromkeys((plan.column, *plan.stamp, *fields)))
    rows = sheet.load(names)
    losses, notes = list(rows.losses), list(rows.notes)
    time_ns, good, note = to_ns(rows.columns[plan.column], plan.unit)
    if note:
        notes.append(note)
    if not good.any():
        found = rows.columns[plan.column]
        shown = _first_cell(found) if len(found) else "no row"
        doubt = number_doubt(found, plan.unit)
        raise FerryIdError(
            f'{sheet.path}: no row has a readable time in column "{plan.column}" ({plan.unit}), found {shown}. '
            + (
                f"Fix: {doubt}"
                if doubt
                else "Fix: name the time column and its time_unit under [table] in the profile; "
            )
            + ("" if doubt else "dates are read year first")
        )
    stamp_ns = None
    if plan.stamp:
        if len(plan.stamp) == 2:
            stamp_ns, stamped = stamps_to_ns(rows.columns[plan.stamp[0]], rows.columns[plan.stamp[1]])
        else:
            stamp_ns, stamped, note = to_ns(rows.columns[plan.stamp[0]], plan.unit)
            if note:
                notes.append(note)
        if (unreadable := int(np.sum(~stamped))) > 0:
            notes.append(f"{counted(unreadable, 'stamp')} {verb(unreadable, 'is')} not readable and count as zero")
    columns = {field: rows.columns[field] for field in fields}
    if not good.all():
        losses.append(_untimed(sheet, topic, time_ns, good))
        time_ns = time_ns[good]
        stamp_ns = None if stamp_ns is None else stamp_ns[good]
        columns = {field: values[good] for field, values in columns.items()}
    return Series(topic, time_ns, stamp_ns, columns, plan.column), losses, tuple(notes)


def to_ns(values: Column, unit: str) -> tuple[NDArray[np.int64], Flags, str]:
    """Convert a time column of numbers or of text to nanoseconds: times, readable mask, sentence on a repair."""
    times, good, note = _any_to_ns(values, unit)
    good &= np.abs(np.where(good, times, 0)) <= FARTHEST_NS
    return np.where(good, times, 0), good, note


def _any_to_ns(values: Column, unit: str) -> tuple[NDArray[np.int64], Flags, str]:
    if values.dtype.kind == "M":
        good = ~np.isnat(values)
        return values.astype("datetime64[ns]").astype(np.int64), good, ""
    if unit == "datetime":
        if values.dtype.kind != "O":
            return np.zeros(len(values), dtype=np.int64), np.zeros(len(values), dtype=bool), ""
        return datetimes_to_ns(values.tolist())
    if values.dtype.kind not in "iuf":
        return np.zeros(len(values), dtype=np.int64), np.zeros(len(values), dtype=bool), ""
    return *numbers_to_ns(values, unit), ""


def _first_cell(values: Column) -> str:
    """The first cell of a column in quotes, or that it is empty."""
    first = values[0]
    empty = first in ("", MISSING_TIME) or first != first
    return "an empty cell" if empty else f'"{str(first)[:60]}"'


def number_doubt(values: Column, unit: str) -> str:
    """Return what speaks against the stated unit of a time column, see `unit_doubt`; "" where it holds no numbers."""
    if unit not in UNIT_NS or values.dtype.kind not in "iuf":
        return ""
    numbers = values[:1000].astype(np.float64)
    return unit_doubt(numbers[np.isfinite(numbers) & (numbers != float(MISSING_TIME))], unit)


def _untimed(sheet: Sheet, topic: str, time_ns: NDArray[np.int64], good: Flags) -> Loss:
    """Rows without a readable time, with the readable times around them."""
    bad = np.flatnonzero(~good)
    before, after = np.flatnonzero(good[: bad[0]]), np.flatnonzero(good[bad[-1] :])
    return Loss(
        file=str(sheet.path),
        what=(
            f'{counted(len(bad), "row")} without a readable time in column "{sheet.time.column}" '
            f"{verb(len(bad), 'was')} left out"
        ),
        topic=topic,
        messages=len(bad),
        start_ns=int(time_ns[before[-1]]) if len(before) else None,
        end_ns=int(time_ns[bad[-1] + after[0]]) if len(after) else None,
    )


def plan_time(where: str, names: Sequence[str], layout: TableLayout, *, typed: bool = False) -> TimePlan | None:
    """Take the time columns that a layout names, None where it leaves the time to be guessed.

    Parameters
    ----------
    where
        File name for the message.
    names
        Columns of the table.
    layout
        The profile's ``[table]``.
    typed
        True for a table whose time column may carry its own type (Parquet), so that the unit is only a default.

    Raises
    ------
    FerryIdError
        For a time or stamp column that the table does not have.
    """
    if not layout.time:
        return None
    for name in (layout.time, *layout.stamp):
        if name not in names:
            if other := _separator_of(name, names):
                raise FerryIdError(
                    f'{where}: the profile\'s [table] wants the column "{name}" for the time, and its separator, '
                    f'"{layout.separator}", finds all columns in one. Fix: add separator = "{other}" under [table]'
                )
            raise FerryIdError(
                f'{where}: the profile\'s [table] wants the column "{name}" for the time, found {_listed(names)}.'
                f"{did_you_mean(name, names)} Fix: correct time, stamp, columns, separator or skip_rows under [table]"
            )
    return TimePlan(layout.time, layout.time_unit, layout.stamp)


def _separator_of(name: str, names: Sequence[str]) -> str:
    """Return the separator of a table that was read as one column, by a name of one of its columns; or an empty string."""
    if len(names) != 1:
        return ""
    parts = {**{one: names[0].split(one) for one in (",", ";", "\t", "|")}, "whitespace": names[0].split()}
    found = next(
        (one for one, cells in parts.items() if len(cells) > 1 and name in (cell.strip() for cell in cells)), ""
    )
    return {"\t": r"\t"}.get(found, found)


def with_stated_unit(plan: TimePlan, layout: TableLayout | None) -> TimePlan:
    """Return a guessed plan with the unit that a layout states beside its default, where it names no time column."""
    if layout is None or layout.time_unit == "s" or plan.unit == "datetime" or layout.time_unit == "datetime":
        return plan
    note = f'time guessed: column "{plan.column}" ({layout.time_unit} as the profile states)'
    return replace(plan, unit=layout.time_unit, note=note)


def no_time(where: str, names: Sequence[str], sample: Mapping[str, Column] | None = None) -> str:
    """Return the message for a table in which no column looks like a time; of numbers of its first rows, which always rise."""
    likely = [name for name in names if has_time_word(name)]
    found = (
        f"{_listed(likely)} of {counted(len(names), 'column')}, whose values do not rise" if likely else _listed(names)
    )
    rising = [f"{name} (by {step:.4g})" for name, step in _rising(sample or {})]
    shown = f"; by the values it may be {' or '.join(rising[:3])}, which rises from row to row" if rising else ""
    return (
        f"{where}: no column of this table looks like a time, found {found}{shown}. "
        "Fix: name the time column as time under [table] in the profile, and its time_unit; without a profile, rename it in "
        'the file to "time [s]"'
    )


def _rising(sample: Mapping[str, Column]) -> list[tuple[str, float]]:
    """Return the columns whose numbers rise with every row, with their median step."""
    found = []
    for name, values in sample.items():
        if values.dtype.kind in "iuf" and len(values) > 2 and np.all(np.diff(values) > 0):
            found.append((name, float(np.median(np.diff(values)))))
    return found


def unique_names(names: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """Name nameless columns after their place, and number repeated names; the sentence tells which, or is empty."""
    taken: set[str] = set()
    result: list[str] = []
    renamed: list[str] = []
    for place, raw in enumerate(names, start=1):
        name = raw.strip() or f"column {place}"
        if name in taken:
            number = 2
            while f"{name} ({number})" in taken:
                number += 1
            renamed.append(f'"{name} ({number})"')
            name = f"{name} ({number})"
        taken.add(name)
        result.append(name)
    note = f"repeated column names are numbered: {', '.join(renamed)}" if renamed else ""
    return tuple(result), note


def columns_named(topic: Topic, name: str) -> int:
    """Return how many columns of a table had a name in its file: those behind the first are numbered, as its note lists."""
    numbered = (f"{name} ({number})" for number in itertools.count(2))
    again = itertools.takewhile(lambda one: one in topic.fields and f'"{one}"' in topic.note, numbered)
    return (name in topic.fields) + sum(1 for _ in again)


def numbers_from_text(texts: Column, decimal: str, *, is_time: bool = False) -> tuple[Column, int]:
    """Turn a text column into numbers where most of it is numbers, and count the cells that are not.

    Returns
    -------
    tuple
        The numbers with NaN for unreadable cells, and their count; or the texts unchanged and 0 where fewer than half
        are numbers. A time column of whole numbers stays one, with `MISSING_TIME`.
    """
    numbers = np.full(len(texts), np.nan)
    unreadable = empty = 0
    for row, text in enumerate(texts):
        bare = text.strip()
        if decimal == ",":
            bare = bare.replace(",", ".")
        if not bare:
            empty += 1
            continue
        try:
            numbers[row] = float(bare)
        except ValueError:
            unreadable += 1
            continue
        if "_" in bare or not bare.isascii():  # Python takes these, no other reader does
            numbers[row] = np.nan
            unreadable += 1
    filled = len(texts) - empty
    if filled == 0 or unreadable * 2 > filled:
        return texts, 0
    if is_time:
        matches = [_WHOLE.match(text) for text in texts]
        if all(match or not finite for match, finite in zip(matches, np.isfinite(numbers), strict=True)):
            return np.array(
                [MISSING_TIME if match is None else int(match[1]) for match in matches], np.int64
            ), unreadable
    return numbers, unreadable


def _listed(names: Sequence[str] | Mapping[str, object]) -> str:
    """The first names of a list in quotes, and how many more there are."""
    shown = [f'"{name}"' for name in list(names)[:12]]
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")
