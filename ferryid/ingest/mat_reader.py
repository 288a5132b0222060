"""MAT files of MATLAB and Octave (``.mat``): structures of arrays, and arrays beside a time, each set one topic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.ingest.log import Loss, TableLayout, Topic
from ferryid.ingest.mat_tables import LEAST_SERIES_ROWS, MatTable, Untimed, from_datenum, tables_of
from ferryid.ingest.mat_variables import MatVariables, read_variables
from ferryid.ingest.table_time import TimePlan
from ferryid.ingest.tables import Rows, TableReader, to_ns

_SHOWN_NAMES = 6
_CELL_REMEDY = "save what belongs together as a structure per run, as in run1 = struct('t', ..., 'u', {name}{{1}})"


@dataclass(frozen=True)
class MatSheet:
    """One topic of a file."""

    path: Path
    topic: Topic
    time: TimePlan
    table: MatTable

    def load(self, names: Sequence[str]) -> Rows:
        """Read the named columns and no others."""
        columns = {name: self.table.columns[name].load() for name in names}
        if self.table.dates:
            columns[self.time.column] = from_datenum(columns[self.time.column])
        return Rows(columns)


def open_mat(path: Path, layout: TableLayout | None) -> TableReader:
    variables = read_variables(path)
    tables, untimed = tables_of(variables.found, layout)
    if not tables:
        raise FerryIdError(f"{path}: {_without(variables, layout)}")
    losses = [*variables.losses, *_objects(path, variables), *_cells(path, variables)]
    losses += [_not_read(path, one, layout) for one in untimed]
    return TableReader([_sheet(path, table) for table in tables], losses)


def _objects(path: Path, variables: MatVariables) -> list[Loss]:
    """Return what only MATLAB reads, each with how it is saved for others."""
    return [
        Loss(
            str(path),
            f"{name} is a {kind} object of MATLAB, which only MATLAB reads. Fix: in MATLAB, {_remedy(name, kind)}",
        )
        for name, kind in variables.objects.items()
    ]


def _cells(path: Path, variables: MatVariables) -> list[Loss]:
    """Return cell arrays that hold as many numbers as a signal has."""
    return [
        Loss(str(path), f"{name} is a cell array, which is not read. Fix: in MATLAB, {_CELL_REMEDY.format(name=name)}")
        for name, most in variables.cells.items()
        if most >= LEAST_SERIES_ROWS
    ]


def _not_read(path: Path, untimed: Untimed, layout: TableLayout | None) -> Loss:
    """Return the rows of arrays that have no time beside them."""
    where = f"the structure {untimed.structure}" if untimed.structure else "the file"
    names = ", ".join(untimed.names[:_SHOWN_NAMES]) + (", ..." if len(untimed.names) > _SHOWN_NAMES else "")
    wanted = (
        f'time "{layout.time}", as the profile\'s [table] names it,' if layout is not None and layout.time else "time"
    )
    size = f"{counted(len(untimed.names), 'array')} of {counted(untimed.rows, 'row')}"
    return Loss(
        str(path),
        f"{where} has {size} without a {wanted} of as many rows "
        f"({names}). Fix: save the time beside them, or leave them out of what is saved if they are no signals",
        messages=untimed.rows,
    )


def _sheet(path: Path, table: MatTable) -> MatSheet:
    fields = {name: _kind(table, name) for name in table.columns if name != table.time.column}
    times = table.columns[table.time.column].load()
    ends = from_datenum(times) if table.dates else times
    time_ns, good, _ = to_ns(ends, table.time.unit)
    known = time_ns[good]
    first, last = (int(known[0]), int(known[-1])) if len(known) else (None, None)
    topic = Topic(table.name, "table", "table", len(times), first, last, fields, table.time.note)
    return MatSheet(path, topic, table.time, table)


def _kind(table: MatTable, name: str) -> str:
    return table.columns[name].leaf.dtype


def _without(variables: MatVariables, layout: TableLayout | None) -> str:
    """Say what a file without time series holds instead, and what to do."""
    if variables.figure:
        return (
            "a figure of MATLAB, found no time series in it. Fix: save the data that were drawn: "
            "save('log.mat', 't', 'u', 'v', ...)"
        )
    if variables.objects:
        name, kind = next(iter(variables.objects.items()))
        count = len(variables.objects)
        return (
            f"{counted(count, 'object')} of MATLAB ({name}: {kind}{', ...' if count > 1 else ''}), which only MATLAB reads, "
            f"and no other time series. Fix: in MATLAB, {_remedy(name, kind)}"
        )
    if names := [name for name, most in variables.cells.items() if most >= LEAST_SERIES_ROWS]:
        shown = ", ".join(names[:_SHOWN_NAMES]) + (", ..." if len(names) > _SHOWN_NAMES else "")
        return (
            f"{counted(len(names), 'cell array')} ({shown}), which are not read, and no other time series. Fix: in MATLAB, "
            f"{_CELL_REMEDY.format(name=names[0])}"
        )
    if variables.losses and not variables.found:
        return f"{variables.losses[0].what}. Fix: copy it again, or save it again in MATLAB"
    shown = ", ".join(list(variables.found)[:_SHOWN_NAMES]) or "nothing"
    if layout is not None and layout.time:
        return (
            f'no array "{layout.time}" with others of its length, as the profile\'s [table] wants for the time, found {shown}. '
            "Fix: correct time under [table]"
        )
    return (
        f"no array of this MAT file looks like a time beside others of its length, found {shown}. "
        "Fix: save a vector t [s] with the signals, or name it as time under [table] in the profile"
    )


def _remedy(name: str, kind: str) -> str:
    bare = name.rpartition(".")[2]
    if kind == "timetable":
        return (
            f"s = table2struct(timetable2table({name}), 'ToScalar', true); s.Time = seconds(s.Time - s.Time(1)); "
            "save('log.mat', '-struct', 's')"
        )
    if kind == "table":
        return f"s = table2struct({name}, 'ToScalar', true); save('log.mat', '-struct', 's')"
    return f"s.{bare} = struct('Time', {name}.Time, 'Data', {name}.Data) for each; save('log.mat', '-struct', 's')"
