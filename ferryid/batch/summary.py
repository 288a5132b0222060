"""The summary of a batch: one row a log, and all of them as a Parquet table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ferryid import __version__
from ferryid.batch.log_result import LogResult
from ferryid.batch.logs import Entry
from ferryid.files import replacing
from ferryid.report.batch_rows import Key, SummaryRow
from ferryid.types import AXES

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
CLOCK_SINCE = datetime(1990, 1, 1, tzinfo=UTC)
"""A log whose clock is earlier counts from its own start, and does not say when it was recorded."""


def summary_row(entry: Entry, vessel: str, result: LogResult, folder: str) -> SummaryRow:
    """Return the row of one log.

    Parameters
    ----------
    entry
        What was asked for.
    vessel
        Name of its profile.
    result
        What came of it.
    folder
        Name of the folder of its results.
    """
    date, source = _date(entry, result.start_ns)
    return SummaryRow(
        # Bytes of a name that are no characters cannot stand in a table.
        log=entry.log.encode("utf-8", "backslashreplace").decode(),
        name=result.name,
        status=result.status,
        reason=result.reason,
        sha256=result.sha256,
        bytes=sum(file.size_bytes for file in result.files),
        date=date,
        date_from=source,
        duration_s=result.duration_s,
        lost=result.lost,
        vessel=vessel,
        note=entry.note,
        folder=f"results/{folder}",
        fit=result.fit,
        evaluate=result.evaluate,
        diagnose=result.diagnose,
        seconds=result.seconds,
        peak_bytes=result.peak_bytes,
    )


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


def table_of(rows: Sequence[SummaryRow]) -> pa.Table:
    """Return rows as a table: paths relative to the folder of the summary, one column a named parameter of a finding.

    A parameter's columns are ``<effect>.<parameter>``, of one of several thrusters ``<effect>(<thruster>).<parameter>``, each
    with ``.low``, ``.high`` and the finding's ``.probability``; null where it was not found.
    """
    text, number, whole = pa.string(), pa.float64(), pa.int64()
    columns: dict[str, tuple[pa.DataType, list[Any]]] = {}

    def put(name: str, kind: pa.DataType, values: Iterable[Any]) -> None:
        columns[name] = kind, list(values)

    lost, fits = [row.lost for row in rows], [row.fit for row in rows]
    evaluations, diagnoses = [row.evaluate for row in rows], [row.diagnose for row in rows]
    for name in ("log", "name", "sha256", "vessel", "status", "reason", "note", "folder"):
        put(name, text, (getattr(row, name) for row in rows))
    put("bytes", whole, (row.bytes for row in rows))
    put("date", pa.timestamp("us", "UTC"), (row.date and datetime.fromisoformat(row.date) for row in rows))
    put("date_from", text, (row.date_from for row in rows))
    put("duration_s", number, (row.duration_s for row in rows))
    put("lost_messages", whole, (one and one.messages for one in lost))
    put("lost_s", number, (one and one.seconds for one in lost))
    put("left_out_s", number, (one and one.seconds_left_out for one in lost))
    put("fit_model", text, (row.fit and _below(row, row.fit.model) for row in rows))
    put("fit_report", text, (row.fit and _below(row, row.fit.report) for row in rows))
    put("diagnose_model", text, (row.diagnose and _below(row, row.diagnose.model) for row in rows))
    put("diagnose_report", text, (row.diagnose and _below(row, row.diagnose.report) for row in rows))
    put("evaluation", text, (row.evaluate and _below(row, row.evaluate.file) for row in rows))
    put("accepted", pa.bool_(), (fit and fit.accepted for fit in fits))
    put("warnings", whole, (fit and len(fit.warnings) for fit in fits))
    put("normalised_mse", number, (fit and fit.normalised_mse for fit in fits))
    put("evaluated_normalised_mse", number, (one and one.normalised_mse for one in evaluations))
    for axis in AXES:
        put(f"mse_base.{axis}", number, (fit and fit.mse.base.get(axis) for fit in fits))
        put(f"mse_fit.{axis}", number, (fit and fit.mse.model.get(axis) for fit in fits))
        put(f"mse_evaluated.{axis}", number, (one and one.mse.get(axis) for one in evaluations))
        put(f"mse_diagnosed_before.{axis}", number, (one and one.before.get(axis) for one in diagnoses))
        put(f"mse_diagnosed_after.{axis}", number, (one and one.after.get(axis) for one in diagnoses))
    put("verdict", text, (one and one.verdict for one in diagnoses))
    put("findings", text, (one and json.dumps([each.to_json() for each in one.findings]) for one in diagnoses))
    for name, (key, parameter) in parameters_of(rows).items():
        findings = [row.finding(key) for row in rows]
        estimates = [one and one.parameters.get(parameter) for one in findings]
        put(name, number, (one and one.value for one in estimates))
        put(f"{name}.low", number, (one and one.low for one in estimates))
        put(f"{name}.high", number, (one and one.high for one in estimates))
        put(f"{name}.probability", number, (one and one.probability for one in findings))
    put("seconds", number, (row.work_s for row in rows))
    put("peak_bytes", whole, (row.peak_bytes for row in rows))
    schema = pa.schema([(name, kind) for name, (kind, _) in columns.items()], metadata={"ferryid_version": __version__})
    return pa.table([pa.array(values, kind) for kind, values in columns.values()], schema=schema)


def parameters_of(rows: Sequence[SummaryRow]) -> dict[str, tuple[Key, str]]:
    """Return effect with instance, and parameter, by the name of the column, of all that was found; sorted."""
    names = {}
    for row in rows:
        for one in row.findings:
            which = one.effect if one.instance is None else f"{one.effect}({one.instance})"
            for parameter in one.parameters:
                names[f"{which}.{parameter}"] = one.key, parameter
    return dict(sorted(names.items()))


def _below(row: SummaryRow, path: str | None) -> str | None:
    return None if path is None else f"{row.folder}/{path}"


def write_table(path: Path, table: pa.Table) -> None:
    """Write a Parquet file, whole or not at all."""
    # Opened here: pyarrow takes no path with bytes that are no characters.
    with replacing(path) as temporary, temporary.open("wb") as file:
        pq.write_table(table, file, compression="zstd")
