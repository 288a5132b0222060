"""What of MATLAB's variables are time series: structures and arrays beside a time of as many rows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ferryid.ingest.log import Column, TableLayout
from ferryid.ingest.table_time import TimePlan, guess_time
from ferryid.ingest.tables import with_stated_unit

SAMPLE_ROWS = 200
"""Rows that a time is guessed from."""
MOST_WIDE = 1000
"""Columns of a matrix beyond which it is an image or a matrix of a model, not a signal."""
MOST_STRUCTS = 100
"""Structures of an array that are topics of their own."""
LEAST_SERIES_ROWS = 50
"""Rows from which an array without a time is taken for a signal that is not read, not for a constant or a lookup table."""
_DATENUM_LOW, _DATENUM_HIGH, _DATENUM_STEP = 7.0e5, 7.7e5, 5.8e-5
"""Days since year 0 of 1916 to 2108, and a step of 5 s in days, which no time in seconds of that size has."""
_DATENUM_1970 = 719_529
_DAY_NS = 86_400_000_000_000


@dataclass(frozen=True)
class Leaf:
    """One array of numbers or texts; `load` reads it. `shape` has no axis of length one unless it holds one value."""

    shape: tuple[int, ...]
    kind: str
    """NumPy's letter: ``"f"``, ``"i"``, ``"u"``, ``"b"``, or ``"O"`` for texts."""
    dtype: str
    load: Callable[[], Column]

    @property
    def rows(self) -> int:
        """Length of the longest axis of a vector, 0 for what is none."""
        return self.shape[0] if len(self.shape) == 1 else 0


Node = Leaf | dict[str, Any]


@dataclass(frozen=True)
class MatColumn:
    """One column of a topic: an array, and for a matrix which of its columns, and whether its rows lie along the last axis."""

    leaf: Leaf
    index: int | None = None
    last: bool = False

    def load(self) -> Column:
        """Read the column, shape (n,)."""
        values = self.leaf.load()
        if self.index is None:
            return values
        if self.last:
            values = np.moveaxis(values, -1, 0)
        return np.ascontiguousarray(values.reshape(len(values), -1)[:, self.index])


@dataclass(frozen=True)
class MatTable:
    """One topic: its columns and its time; `dates` where the time is a serial date number."""

    name: str
    columns: Mapping[str, MatColumn]
    time: TimePlan
    dates: bool = False


@dataclass(frozen=True)
class Untimed:
    """Arrays of one structure and one length that have no time beside them, and so belong to no topic."""

    structure: str
    names: tuple[str, ...]
    rows: int


@dataclass
class _Found:
    tables: list[MatTable] = field(default_factory=list)
    layout: TableLayout | None = None

    def add(self, name: str, columns: Mapping[str, MatColumn], time: TimePlan) -> None:
        """Add a topic, numbered where its name is taken."""
        taken = {table.name for table in self.tables}
        number, free = 2, name
        while free in taken:
            free, number = f"{name} ({number})", number + 1
        dates = time.unit == "s" and _are_datenums(columns[time.column])
        if dates:
            note = f'time guessed: column "{time.column}" (serial date numbers of MATLAB)'
            time = TimePlan(time.column, "datetime", time.stamp, note)
        self.tables.append(MatTable(free, columns, time, dates))


def tables_of(variables: Mapping[str, Node], layout: TableLayout | None) -> tuple[list[MatTable], list[Untimed]]:
    """Return the topics of a file: ``table`` of the variables themselves, and one for each structure with a time of its own.

    Beside them, the arrays as long as a signal that belong to none.

    Parameters
    ----------
    variables
        Name to array or structure.
    layout
        The profile's ``[table]``: its `time` is the name of the time in whatever structure has it, its `columns` those of a
        matrix.
    """
    found = _Found(layout=layout)
    left = _untimed(_gather(dict(variables), "", found))
    if not found.tables:
        for name, leaf in _matrices(variables, ""):
            _matrix(f"/{name.replace('.', '/')}", leaf, found)
    tables = found.tables
    if len(tables) == 1 and tables[0].name.startswith("/") and tables[0].name.count("/") == 1:
        tables = [MatTable("table", tables[0].columns, tables[0].time, tables[0].dates)]
    return tables, left


def _untimed(left: Mapping[str, MatColumn]) -> list[Untimed]:
    groups: dict[tuple[str, int], list[str]] = {}
    for name, column in left.items():
        if column.leaf.rows >= LEAST_SERIES_ROWS:
            groups.setdefault((name.rpartition(".")[0], column.leaf.rows), []).append(name)
    return [Untimed(structure, tuple(names), rows) for (structure, rows), names in groups.items()]


def from_datenum(values: Column) -> Column:
    """Convert serial date numbers to timestamps, NaT where there is none."""
    days = np.asarray(values, np.float64)
    good = np.isfinite(days) & (np.abs(days - _DATENUM_1970) < 100_000)
    ns = np.rint((np.where(good, days, _DATENUM_1970) - _DATENUM_1970) * (_DAY_NS / 1e3)).astype(np.int64) * 1000
    stamps = ns.view("datetime64[ns]")
    stamps[~good] = np.datetime64("NaT", "ns")
    return stamps


def _gather(node: Mapping[str, Node], path: str, found: _Found) -> dict[str, MatColumn]:
    """Add the topics of a structure, and return the columns that have no time in it, under their paths in it."""
    series = _simulink(node)
    if series is not None:
        names, time = series
        found.add(_topic(path), names, time)
        return {}
    leaves: dict[str, MatColumn] = {}
    wide: dict[str, Leaf] = {}
    for name, child in node.items():
        if isinstance(child, dict):
            inner = _gather(child, f"{path}.{name}" if path else name, found)
            leaves |= {f"{name}.{one}": column for one, column in inner.items()}
        elif child.rows:
            leaves[name] = MatColumn(child)
        elif len(child.shape) > 1:
            wide[name] = child
    used: set[str] = set()
    lengths = sorted({one.leaf.rows for one in leaves.values() if one.leaf.rows > 1}, reverse=True)
    made: list[tuple[dict[str, MatColumn], TimePlan]] = []
    for length in lengths:
        columns = {name: one for name, one in leaves.items() if one.leaf.rows == length}
        plan = _time(columns, found.layout)
        if plan is None:
            continue
        for name, leaf in wide.items():
            columns |= _spread(name, leaf, length)
        if len(columns) > 1 + len(plan.stamp):
            used |= columns.keys()
            made.append((columns, plan))
    made.sort(key=lambda one: -len(one[0]))
    for place, (columns, time) in enumerate(made):
        name = _topic(path) if place == 0 else f"{_topic(path) if path else ''}/{time.column}"
        found.add(name, columns, time)
    return {name: one for name, one in leaves.items() if name not in used}


def _topic(path: str) -> str:
    return f"/{path.replace('.', '/')}" if path else "table"


def _simulink(node: Mapping[str, Node]) -> tuple[dict[str, MatColumn], TimePlan] | None:
    """Return columns and time of Simulink's "structure with time", None where a structure is none."""
    time, signals = node.get("time"), node.get("signals")
    if not isinstance(time, Leaf) or not isinstance(signals, dict) or time.rows < 2:
        return None
    entries = [signals] if "values" in signals else [one for one in signals.values() if isinstance(one, dict)]
    columns = {"time": MatColumn(time)}
    for place, entry in enumerate(entries):
        values, label = entry.get("values"), _text(entry.get("label"))
        if not isinstance(values, Leaf):
            continue
        name = label or f"signals[{place}]"
        name = name if name not in columns else f"{name} ({place + 1})"
        if values.rows == time.rows:
            columns[name] = MatColumn(values)
        else:
            columns |= _spread(name, values, time.rows)
    plan = TimePlan("time", "s", note='time guessed: column "time" (s, as Simulink writes it)')
    return (columns, plan) if len(columns) > 1 else None


def _text(node: Node | None) -> str:
    if not isinstance(node, Leaf) or node.kind != "O" or node.shape != (1,):
        return ""
    return str(node.load()[0]).strip()


def _spread(name: str, leaf: Leaf, length: int) -> dict[str, MatColumn]:
    """Return the columns of a matrix that has this many rows, along its first or else its last axis; nothing for others."""
    if leaf.kind == "O" or len(leaf.shape) < 2:
        return {}
    first, last = leaf.shape[0] == length, leaf.shape[-1] == length
    width = int(np.prod(leaf.shape)) // max(length, 1)
    if not (first or last) or width > MOST_WIDE:
        return {}
    return {f"{name}[{k}]": MatColumn(leaf, k, last=not first) for k in range(width)}


def _time(columns: Mapping[str, MatColumn], layout: TableLayout | None) -> TimePlan | None:
    """Return the time among vectors of one length, as a profile names it or by its name and its values."""
    if layout is not None and layout.time:
        stamped = tuple(layout.stamp) if set(layout.stamp) <= columns.keys() else ()
        return TimePlan(layout.time, layout.time_unit, stamped) if layout.time in columns else None
    plan = guess_time({name.replace(".", "_"): _sample(column) for name, column in columns.items()})
    if plan is None:
        return None
    names = {name.replace(".", "_"): name for name in columns}
    plan = TimePlan(names[plan.column], plan.unit, tuple(names[one] for one in plan.stamp), plan.note)
    return with_stated_unit(plan, layout)


def _sample(column: MatColumn) -> list[str]:
    return [str(value) for value in column.load()[:SAMPLE_ROWS].tolist()]


def _are_datenums(column: MatColumn) -> bool:
    if column.leaf.kind != "f":
        return False
    values = column.load()[:SAMPLE_ROWS]
    values = values[np.isfinite(values)]
    if len(values) < 2 or values.min() < _DATENUM_LOW or values.max() > _DATENUM_HIGH:
        return False
    return 0.0 < float(np.median(np.diff(values))) < _DATENUM_STEP


def _matrices(node: Mapping[str, Node], path: str) -> Iterable[tuple[str, Leaf]]:
    for name, child in node.items():
        whole = f"{path}.{name}" if path else name
        if isinstance(child, dict):
            yield from _matrices(child, whole)
        elif len(child.shape) == 2 and child.kind != "O":
            yield whole, child


def _matrix(name: str, leaf: Leaf, found: _Found) -> None:
    """Add a matrix without a name for its columns, whose first column may be the time."""
    layout = found.layout
    rows, width = leaf.shape
    if width > min(MOST_WIDE, rows) or width < 2:
        return
    names = list(layout.columns) if layout is not None and len(layout.columns) == width else []
    columns = {names[k] if names else f"column {k + 1}": MatColumn(leaf, k) for k in range(width)}
    time = _time(columns, layout)
    if time is not None:
        note = "" if names else "columns are named by their place: give columns under [table] in the profile"
        found.add(
            name, columns, TimePlan(time.column, time.unit, time.stamp, "; ".join(filter(None, (time.note, note))))
        )
