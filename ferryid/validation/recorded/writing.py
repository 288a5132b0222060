"""A recording written as a log that the same profile maps: a Parquet table, a folder of CSV files, or an MCAP file."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.files import replacing
from ferryid.ingest.log import Series, TableLayout
from ferryid.simulate.recorders import write_json_mcap
from ferryid.validation.recorded.log import FOLDER, TABLE, RecordedLog

NS_PER_S = 1_000_000_000
UNIT_NS = {"s": NS_PER_S, "ms": 1_000_000, "us": 1_000, "ns": 1}
TIME = "time"


def write_log(log: RecordedLog, folder: Path, name: str) -> Path:
    """Write the mapped fields of a recording, whole or not at all, with the times that they have; return the path.

    Parameters
    ----------
    log
        As read, or with values changed.
    folder, name
        Where, and the name of the log without a suffix.
    """
    layout = log.profile.table
    if log.kind == TABLE:
        path = folder / f"{name}.parquet"
        with replacing(path, new=False) as temporary:
            _write_table(log.series["table"], layout, temporary)
        return path
    if log.kind == FOLDER:
        path = folder / name
        with replacing(path, new=False) as temporary:
            for topic, series in log.series.items():
                file = temporary / f"{topic.strip('/')}.csv"
                file.parent.mkdir(parents=True, exist_ok=True)
                _write_csv(series, layout, file)
        return path
    path = folder / f"{name}.mcap"
    with replacing(path, new=False) as temporary:
        write_json_mcap(list(log.series.values()), temporary)
    return path


def _write_table(series: Series, layout: TableLayout | None, path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    columns = {series.time_column or TIME: pa.array(series.receive_ns.astype("datetime64[ns]"))}
    if layout is not None and series.stamp_ns is not None:
        columns |= dict(zip(layout.stamp, _stamps(series.stamp_ns, layout), strict=True))
    columns |= {path_: pa.array(values) for path_, values in series.columns.items() if path_ not in columns}
    # Opened here: pyarrow takes no path with bytes that are no characters.
    with path.open("wb") as file:
        parquet.write_table(pa.table(columns), file)


def _stamps(stamp_ns: Any, layout: TableLayout) -> list[Any]:
    import pyarrow as pa

    if len(layout.stamp) == 2:
        return [pa.array(stamp_ns // NS_PER_S), pa.array(stamp_ns % NS_PER_S)]
    return [pa.array(stamp_ns.astype("datetime64[ns]"))]


def _write_csv(series: Series, layout: TableLayout | None, path: Path) -> None:
    unit = "datetime" if layout is None else layout.time_unit
    stamp = () if layout is None or series.stamp_ns is None else layout.stamp
    fields = [name for name in series.columns if name != series.time_column and name not in stamp]
    columns: list[Any] = [_texts(series.receive_ns, unit)]
    if stamp and series.stamp_ns is not None:
        two = len(stamp) == 2
        columns += (
            [(series.stamp_ns // NS_PER_S).tolist(), (series.stamp_ns % NS_PER_S).tolist()]
            if two
            else [_texts(series.stamp_ns, unit)]
        )
    columns += [map(repr, series.columns[name].tolist()) for name in fields]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([series.time_column or TIME, *stamp, *fields])
        writer.writerows(zip(*columns, strict=True))


def _texts(time_ns: Any, unit: str) -> Iterator[str]:
    """Yield times as text, exact to the nanosecond."""
    if unit == "datetime":
        return iter(np.datetime_as_string(time_ns.astype("datetime64[ns]"), unit="ns").tolist())
    one = UNIT_NS[unit]
    digits = len(str(one)) - 1
    return (f"{ns // one}.{ns % one:0{digits}d}" if digits else str(ns) for ns in time_ns.tolist())
