"""The summary of a batch: one row a log, as plain data and as a Parquet table."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ferryid import __version__
from ferryid.batch.kept import Row
from ferryid.batch.logs import Entry
from ferryid.files import replacing
from ferryid.types import AXES

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
CLOCK_SINCE = datetime(1990, 1, 1, tzinfo=UTC)
"""A log whose clock is earlier counts from its own start, and does not say when it was recorded."""
STEPS: tuple[str, ...] = ("fit", "evaluate", "diagnose")


def lines_of(entry: Entry, vessel: str, row: Row, folder: str) -> dict[str, Any]:
    """Return what is told of one log.

    Parameters
    ----------
    entry
        What was asked for.
    vessel
        Name of its profile.
    row
        What came of it.
    folder
        Name of the folder of its results.
    """
    date, source = _date(entry, row["start_ns"])
    return {
        # Bytes of a name that are no characters cannot stand in a table.
        "log": entry.log.encode("utf-8", "backslashreplace").decode(),
        **{name: row[name] for name in ("name", "status", "reason", "sha256")},
        "bytes": sum(file[1] for file in row["files"]),
        "date": date,
        "date_from": source,
        "duration_s": row["duration_s"],
        "lost": row.get("lost"),
        "vessel": vessel,
        "note": entry.note,
        "folder": f"results/{folder}",
        **{step: row.get(step) for step in STEPS},
        "seconds": row["seconds"],
        "peak_bytes": row["peak_bytes"],
    }


def _date(entry: Entry, start_ns: int | None) -> tuple[str | None, str | None]:
    if entry.date is not None:
        return entry.date, "manifest"
    if start_ns is None:
        return None, None
    try:
        date = EPOCH + timedelta(microseconds=start_ns // 1000)
    except OverflowError:
        return None, None
    return (date.isoformat(timespec="seconds"), "log") if date >= CLOCK_SINCE else (None, None)


def table_of(rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Return rows as a table: paths relative to the folder of the summary, one column a named parameter of a finding.

    A parameter's columns are ``<effect>.<parameter>``, of one of several thrusters ``<effect>(<thruster>).<parameter>``, each
    with ``.low``, ``.high`` and the finding's ``.probability``; null where it was not found.
    """
    text, number, whole = pa.string(), pa.float64(), pa.int64()
    columns: dict[str, tuple[pa.DataType, list[Any]]] = {}

    def put(name: str, kind: pa.DataType, values: list[Any]) -> None:
        columns[name] = kind, values

    for name in ("log", "name", "sha256", "vessel", "status", "reason", "note", "folder"):
        put(name, text, [row[name] for row in rows])
    put("bytes", whole, [row["bytes"] for row in rows])
    put("date", pa.timestamp("us", "UTC"), [row["date"] and datetime.fromisoformat(row["date"]) for row in rows])
    put("date_from", text, [row["date_from"] for row in rows])
    put("duration_s", number, [row["duration_s"] for row in rows])
    put("lost_messages", whole, [_of(row, "lost", "messages") for row in rows])
    put("lost_s", number, [_of(row, "lost", "seconds") for row in rows])
    put("left_out_s", number, [_of(row, "lost", "seconds_left_out") for row in rows])
    for step, path in (("fit", "model"), ("fit", "report"), ("diagnose", "model"), ("diagnose", "report")):
        put(f"{step}_{path}", text, [_below(row, step, path) for row in rows])
    put("evaluation", text, [_below(row, "evaluate", "result") for row in rows])
    put("accepted", pa.bool_(), [_of(row, "fit", "accepted") for row in rows])
    put("warnings", whole, [len(row["fit"]["warnings"]) if row["fit"] else None for row in rows])
    put("normalised_mse", number, [_of(row, "fit", "normalised_mse") for row in rows])
    put("evaluated_normalised_mse", number, [_of(row, "evaluate", "normalised_mse") for row in rows])
    for axis in AXES:
        put(f"mse_base.{axis}", number, [_of(row, "fit", "mse", "base", axis) for row in rows])
        put(f"mse_fit.{axis}", number, [_of(row, "fit", "mse", "model", axis) for row in rows])
        put(f"mse_evaluated.{axis}", number, [_of(row, "evaluate", "mse", axis) for row in rows])
        put(f"mse_diagnosed_before.{axis}", number, [_of(row, "diagnose", "before", axis) for row in rows])
        put(f"mse_diagnosed_after.{axis}", number, [_of(row, "diagnose", "after", axis) for row in rows])
    put("verdict", text, [_of(row, "diagnose", "verdict") for row in rows])
    put("findings", text, [json.dumps(row["diagnose"]["findings"]) if row["diagnose"] else None for row in rows])
    for name, (found, parameter) in parameters_of(rows).items():
        several = [found_in(row, found) for row in rows]
        for key, end in (("value", ""), ("low", ".low"), ("high", ".high")):
            put(f"{name}{end}", number, [one and one["parameters"].get(parameter, {}).get(key) for one in several])
        put(f"{name}.probability", number, [one and one["probability"] for one in several])
    put("seconds", number, [sum(row["seconds"].values()) for row in rows])
    put("peak_bytes", whole, [row["peak_bytes"] for row in rows])
    schema = pa.schema([(name, kind) for name, (kind, _) in columns.items()], metadata={"ferryid_version": __version__})
    return pa.table([pa.array(values, kind) for kind, values in columns.values()], schema=schema)


def parameters_of(
    rows: Sequence[Mapping[str, Any]],
) -> dict[str, tuple[tuple[str, str | None], str]]:
    """Return effect with instance, and parameter, by the name of the column, of all that was found; sorted."""
    names = {}
    for row in rows:
        for one in row["diagnose"]["findings"] if row["diagnose"] else ():
            which = one["effect"] if one["instance"] is None else f"{one['effect']}({one['instance']})"
            for parameter in one["parameters"]:
                names[f"{which}.{parameter}"] = (one["effect"], one["instance"]), parameter
    return dict(sorted(names.items()))


def found_in(row: Mapping[str, Any], key: tuple[str, str | None]) -> Any:
    """Return the first finding of an effect in a log, None where there is none."""
    findings = row["diagnose"]["findings"] if row["diagnose"] else ()
    return next((one for one in findings if (one["effect"], one["instance"]) == key), None)


def _of(row: Mapping[str, Any], *path: str) -> Any:
    value: Any = row
    for name in path:
        value = None if value is None else value.get(name)
    return value


def _below(row: Mapping[str, Any], step: str, name: str) -> str | None:
    path = _of(row, step, name)
    return None if path is None else f"{row['folder']}/{path}"


def write_table(path: Path, table: pa.Table) -> None:
    """Write a Parquet file, whole or not at all."""
    with replacing(path) as temporary:
        pq.write_table(table, temporary, compression="zstd")
