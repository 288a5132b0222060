"""One Parquet table: one topic named ``table``, only the wanted columns are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.ingest.arrow_columns import column_from_arrow
from ferryid.ingest.log import Format, TableLayout, Topic
from ferryid.ingest.table_time import TimePlan, guess_time
from ferryid.ingest.tables import Rows, TableReader, plan_time, to_ns


@dataclass(frozen=True)
class ParquetSheet:
    """One Parquet file; members of structs are columns named ``struct.member``."""

    path: Path
    topic: Topic
    time: TimePlan

    def load(self, names: Sequence[str]) -> Rows:
        """Read the named columns and no others."""
        table = _read(self.path, names)
        return Rows({name: column_from_arrow(table.column(name)) for name in names})


def _read(path: Path, names: Sequence[str]) -> Any:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    try:
        # A dotted name selects the member of a struct; the struct comes back and is flattened.
        table = parquet.ParquetFile(path).read(columns=list(names))
    except (pa.ArrowInvalid, OSError) as error:
        raise _damaged(path, error) from error
    return _flat(table)


def _flat(table: Any) -> Any:
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


def _damaged(path: Path, error: Exception) -> FerryIdError:
    return FerryIdError(
        f"{path}: the Parquet file cannot be read ({str(error).splitlines()[0]}). Fix: export or copy the table again"
    )


def _matches(path: Path, head: bytes) -> bool:
    return path.is_file() and (head[:4] == b"PAR1" or path.suffix.lower() in (".parquet", ".pq"))


def _open(path: Path, layout: TableLayout | None) -> TableReader:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    try:
        file = parquet.ParquetFile(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise _damaged(path, error) from error
    schema = _flat(file.schema_arrow.empty_table()).schema
    fields = {field.name: kind for field in schema if (kind := _kind(field.type))}
    count = file.metadata.num_rows
    if count == 0:
        raise FerryIdError(f"{path}: the table holds columns and no rows. Fix: record or export the log again")
    notes = []
    plan = plan_time(str(path), tuple(fields), layout) if layout is not None else None
    if plan is None:
        plan = _guess(path, file, fields)
        notes.append(plan.note)
    times, good, _ = to_ns(column_from_arrow(_read(path, [plan.column]).column(plan.column)), plan.unit)
    topic = Topic(
        name="table",
        type="table",
        encoding="table",
        count=count,
        start_ns=int(times[good].min()) if good.any() else None,
        end_ns=int(times[good].max()) if good.any() else None,
        fields=fields,
        note="; ".join(notes),
    )
    return TableReader([ParquetSheet(path, topic, plan)])


def _kind(kind: Any) -> str:
    """Primitive type as fields list it; empty for lists, maps and binary, which no signal can map."""
    import pyarrow as pa

    if pa.types.is_boolean(kind):
        return "bool"
    if pa.types.is_floating(kind) or pa.types.is_integer(kind):
        return {"halffloat": "float16", "float": "float32", "double": "float64"}.get(str(kind), str(kind))
    if pa.types.is_timestamp(kind):
        return "datetime"
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_dictionary(kind):
        return "string"
    return ""


def _guess(path: Path, file: Any, fields: dict[str, str]) -> TimePlan:
    """The first timestamp column, or the one that a text table would take."""
    import pyarrow as pa

    for name, kind in fields.items():
        if kind == "datetime":
            return TimePlan(name, "datetime", note=f'time guessed: column "{name}" (timestamps)')
    rows = _flat(pa.Table.from_batches([next(file.iter_batches(batch_size=200))]))
    plan = guess_time({name: [str(value) for value in rows.column(name).to_pylist()] for name in fields})
    if plan is None:
        raise FerryIdError(
            f"{path}: no column of this table looks like a time, found {', '.join(list(fields)[:12])}. "
            "Fix: name the time column as time under [table] in the profile"
        )
    return plan


FORMAT = Format(name="Parquet table", matches=_matches, open=_open, order=20)
