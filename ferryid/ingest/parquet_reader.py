"""One Parquet table: one topic named ``table``, only the wanted columns are read, the checksums of their pages checked."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, one_line
from ferryid.ingest.arrow_columns import column_from_arrow
from ferryid.ingest.log import Column, Loss, TableLayout, Topic
from ferryid.ingest.parquet_footer import null_counts
from ferryid.ingest.table_time import TimePlan, guess_time
from ferryid.ingest.tables import (
    Rows,
    TableReader,
    no_time,
    number_doubt,
    plan_time,
    to_ns,
    unique_names,
    with_stated_unit,
)

SUFFIXES = (".parquet", ".pq")
_LARGE_BYTES = 1 << 30
_MOST_TIMES_LARGER = 100
"""Columns of more than `_LARGE_BYTES` in memory that need this many times the size of their file are not read."""


@dataclass(frozen=True)
class ParquetSheet:
    """One Parquet file; members of structs are columns named ``struct.member``.

    `places` maps a column to its name in the file and its place among the columns of that name.
    """

    path: Path
    topic: Topic
    time: TimePlan
    places: Mapping[str, tuple[str, int]]

    def load(self, names: Sequence[str]) -> Rows:
        """Read the named columns and no others; row groups that are damaged are left out and counted."""
        times = {self.time.column, *self.time.stamp}
        columns, losses = _read(self.path, {name: self.places[name] for name in names}, times)
        return Rows(columns, losses)


def _failures() -> tuple[type[Exception], ...]:
    """Exceptions that pyarrow raises for damaged files."""
    import pyarrow as pa

    return (pa.ArrowException, OSError, ValueError, LookupError, TypeError, MemoryError, OverflowError)


def _open_file(path: Path) -> Any:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    # As bytes: pyarrow takes no text with bytes that are no characters.
    name = os.fsencode(path)
    try:
        file = parquet.ParquetFile(pa.OSFile(name), page_checksum_verification=True)
        columns = [file.schema.column(number) for number in range(len(file.schema))]
        texts = [
            column.path for column in columns if column.logical_type.type == "STRING" and column.path == column.name
        ]
        if not texts:
            return file
        # As dictionaries, a text that many rows have is in memory once; pyarrow cannot do so in structs of several groups.
        return parquet.ParquetFile(pa.OSFile(name), page_checksum_verification=True, read_dictionary=texts)
    except _failures() as error:
        raise _damaged(path, error) from error


def _read(
    path: Path, places: Mapping[str, tuple[str, int]], times: set[str]
) -> tuple[dict[str, Column], tuple[Loss, ...]]:
    """Read columns by their places; where the file is damaged, each row group by itself."""
    file = _open_file(path)
    raw = list(dict.fromkeys(name for name, _ in places.values()))
    rows, size = file.metadata.num_rows, path.stat().st_size
    needed = max(8 * rows * len(places), _claimed_bytes(path, file))
    if rows < 0 or needed > max(_LARGE_BYTES, _MOST_TIMES_LARGER * size):
        raise FerryIdError(
            f"{path}: the Parquet file claims {counted(rows, 'row')} that need {needed / 1e6:.0f} MB, found "
            f"{counted(size, 'byte')}, which "
            "cannot hold them. Fix: export or copy the table again"
        )
    try:
        # A dotted name selects the member of a struct; the struct comes back and is flattened.
        table = file.read(columns=raw)
        columns = _columns(table, places, times)
        _check_count(columns, rows)
        if any(column.null_count for column in table.columns):
            _check_missing(table, null_counts(path))
        return columns, ()
    except _failures() as error:
        if file.num_row_groups < 2:
            raise _damaged(path, error) from error
        first = error
    return _read_groups(path, file, raw, places, times, first)


def _claimed_bytes(path: Path, file: Any) -> int:
    """Size in memory of all pages, as the footer claims it."""
    try:
        # Not column by column: pyarrow ends the process where the statistics of a column are damaged.
        return sum(int(file.metadata.row_group(group).total_byte_size) for group in range(file.num_row_groups))
    except _failures() as error:
        raise _damaged(path, error) from error


def _read_groups(
    path: Path, file: Any, raw: list[str], places: Mapping[str, tuple[str, int]], times: set[str], first: Exception
) -> tuple[dict[str, Column], tuple[Loss, ...]]:
    """Read the row groups that can be read; the rows of the others are lost."""
    parts: list[dict[str, Column]] = []
    lost, groups, stated = 0, 0, null_counts(path)
    for group in range(file.num_row_groups):
        count = file.metadata.row_group(group).num_rows
        try:
            table = file.read_row_group(group, columns=raw)
            columns = _columns(table, places, times)
            _check_count(columns, count)
            _check_missing(table, stated[group : group + 1])
            parts.append(columns)
        except _failures():
            lost += max(0, count)
            groups += 1
    if not parts or not groups:
        raise _damaged(path, first) from first
    joined = {name: np.concatenate([part[name] for part in parts]) for name in places}
    # The count of a group may be what is damaged; that of the file is another.
    lost = max(lost, file.metadata.num_rows - sum(len(next(iter(part.values()), ())) for part in parts))
    what = (
        f"{counted(lost, 'row')} in {groups} of {file.num_row_groups} row groups {verb(lost, 'is')} damaged and "
        f"{verb(lost, 'was')} left out ({_reason(first)})"
    )
    return joined, (Loss(str(path), what, "table", messages=lost),)


def _columns(table: Any, places: Mapping[str, tuple[str, int]], times: set[str]) -> dict[str, Column]:
    table = _flat(table)
    table.validate(full=True)
    found: dict[str, list[int]] = {}
    for index, field in enumerate(table.schema):
        found.setdefault(field.name, []).append(index)
    return {
        name: column_from_arrow(table.column(found[raw][place]), is_time=name in times)
        for name, (raw, place) in places.items()
    }


def _check_count(columns: Mapping[str, Column], rows: int) -> None:
    wrong = next((len(values) for values in columns.values() if len(values) != rows), None)
    if wrong is not None:
        raise ValueError(f"{counted(wrong, 'row')} where the file's footer counts {rows}")


def _check_missing(table: Any, stated: Sequence[Mapping[str, int]]) -> None:
    """Refuse columns in which more values are missing than the footer counts in these row groups."""
    for name in dict.fromkeys(table.schema.names):
        if not stated or any(name not in group for group in stated):
            continue
        missing = sum(
            column.null_count for field, column in zip(table.schema.names, table.columns, strict=True) if field == name
        )
        most = sum(group[name] for group in stated)
        if missing > most:
            raise ValueError(f'{counted(missing, "value")} of "{name}" missing where the file\'s footer counts {most}')


def _flat(table: Any) -> Any:
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


def _reason(error: Exception) -> str:
    return one_line(str(error) or type(error).__name__)[:300]


def _damaged(path: Path, error: Exception) -> FerryIdError:
    if "ncrypt" in str(error):
        return FerryIdError(f"{path}: the Parquet file is encrypted. Fix: export the table without encryption")
    return FerryIdError(
        f"{path}: the Parquet file cannot be read ({_reason(error)}). Fix: export or copy the table again"
    )


def open_table(path: Path, layout: TableLayout | None) -> TableReader:
    file = _open_file(path)
    try:
        schema = _flat(file.schema_arrow.empty_table()).schema
        count = file.metadata.num_rows
        kinds = [(field.name, _kind(field.type), str(field.type)) for field in schema]
    except _failures() as error:
        raise _damaged(path, error) from error
    if count == 0:
        raise FerryIdError(f"{path}: the table holds columns and no rows. Fix: record or export the log again")
    names, renamed = unique_names([name for name, _, _ in kinds])
    seen: dict[str, int] = {}
    places: dict[str, tuple[str, int]] = {}
    fields: dict[str, str] = {}
    unread = []
    for name, (raw, kind, full) in zip(names, kinds, strict=True):
        if kind:
            fields[name] = kind
            places[name] = (raw, seen.get(raw, 0))
        else:
            unread.append(f'"{name}" ({full[:40]})')
        seen[raw] = seen.get(raw, 0) + 1
    notes = [renamed]
    if unread:
        more = f" and {len(unread) - 6} more" if len(unread) > 6 else ""
        notes.append(f"columns of these types are not read: {', '.join(unread[:6])}{more}")
    plan = plan_time(str(path), tuple(fields), layout) if layout is not None else None
    guessed = plan is None
    if plan is None:
        plan = with_stated_unit(_guess(path, file, fields, places), layout)
        notes.append(plan.note)
    columns, _ = _read(path, {plan.column: places[plan.column]}, {plan.column})
    if not guessed:
        notes.append(number_doubt(columns[plan.column], plan.unit))
    times, good, _ = to_ns(columns[plan.column], plan.unit)
    topic = Topic(
        name="table",
        type="table",
        encoding="table",
        count=count,
        start_ns=int(times[good].min()) if good.any() else None,
        end_ns=int(times[good].max()) if good.any() else None,
        fields=fields,
        note="; ".join(note for note in notes if note),
    )
    return TableReader([ParquetSheet(path, topic, plan, places)])


def _kind(kind: Any) -> str:
    """Primitive type as fields list it; empty for lists, maps and binary, which no signal can map."""
    import pyarrow as pa

    if pa.types.is_boolean(kind):
        return "bool"
    if pa.types.is_floating(kind) or pa.types.is_integer(kind):
        return {"halffloat": "float16", "float": "float32", "double": "float64"}.get(str(kind), str(kind))
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        return "datetime"
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return "string"
    if pa.types.is_dictionary(kind):
        return _kind(kind.value_type)
    if pa.types.is_decimal(kind) or pa.types.is_null(kind):
        return "float64"
    return ""


def _guess(path: Path, file: Any, fields: Mapping[str, str], places: Mapping[str, tuple[str, int]]) -> TimePlan:
    """The first timestamp column, or the one that a text table would take."""
    for name, kind in fields.items():
        if kind == "datetime":
            return TimePlan(name, "datetime", note=f'time guessed: column "{name}" (timestamps)')
    columns = _first_rows(path, file, places, set(fields))
    plan = guess_time({name: [str(value) for value in columns[name].tolist()] for name in fields})
    if plan is None:
        raise FerryIdError(no_time(str(path), tuple(fields)))
    return plan


def _first_rows(path: Path, file: Any, places: Mapping[str, tuple[str, int]], times: set[str]) -> dict[str, Column]:
    """Up to 200 rows of the first row group that has any and can be read."""
    import pyarrow as pa

    first: Exception = ValueError("no row can be read")
    for group in range(file.num_row_groups):
        try:
            for batch in file.iter_batches(batch_size=200, row_groups=[group]):
                if batch.num_rows:
                    return _columns(pa.Table.from_batches([batch]), places, times)
        except _failures() as error:
            first = error
    raise _damaged(path, first) from first
