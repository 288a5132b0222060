"""One Parquet file per topic: times and canonical signals, with units and provenance in its metadata."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError, one_line
from ferryid.ingest.checksum import crc32

TIME_COLUMNS = ("time_ns", "receive_ns", "stamp_ns")
METADATA_KEY = b"ferryid"


def unit_of(column: str) -> str:
    """Return the SI unit of a canonical column (``"n_bow"`` → ``"rpm"``), "" for an unknown one."""
    if column in TIME_COLUMNS:
        return "ns"
    if column in _UNITS:
        return _UNITS[column]
    stem = column.split("_", 1)[0] if "_" in column else ""
    return _ACTUATOR_UNITS.get(stem, "")


_UNITS = {
    **dict.fromkeys(("x", "y", "x_d", "y_d"), "m"),
    **dict.fromkeys(("psi", "phi", "theta", "wind_from", "psi_d"), "rad"),
    **dict.fromkeys(("u", "v", "vel_N", "vel_E"), "m/s"),
    **dict.fromkeys(("wind_speed", "wind_N", "wind_E", "current_N", "current_E"), "m/s"),
    "r": "rad/s",
    "payload_kg": "kg",
    "payload_x": "m",
    "X_d": "N",
    "Y_d": "N",
    "N_d": "N*m",
}
_ACTUATOR_UNITS = {"n": "rpm", "alpha": "rad", "delta": "rad", "F": "N"}


def write_table(path: Path, columns: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> None:
    """Write columns of float64 and int64 to one Parquet file.

    Zstandard at level 1 without dictionaries; floats split by byte, times as differences: measurements are neither few
    nor repeated, and this is both faster and smaller than the defaults.

    Parameters
    ----------
    path
        File to write; its folder exists.
    columns
        Name to values, all of shape (n,).
    metadata
        Provenance, stored as JSON under the key ``ferryid``.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as parquet

    arrays, fields, encodings = [], [], {}
    for name, values in columns.items():
        kind = pa.int64() if values.dtype.kind == "i" else pa.float64()
        raw = np.ascontiguousarray(values, dtype=np.int64 if values.dtype.kind == "i" else np.float64)
        # Built from the buffer: pa.array(ndarray) would import pandas.
        arrays.append(pa.Array.from_buffers(kind, len(raw), [None, pa.py_buffer(raw)]))
        fields.append(pa.field(name, kind, nullable=False, metadata={"unit": unit_of(name)}))
        encodings[name] = "DELTA_BINARY_PACKED" if values.dtype.kind == "i" else "BYTE_STREAM_SPLIT"
    schema = pa.schema(fields, metadata={METADATA_KEY: json.dumps(metadata, sort_keys=True).encode()})
    # Opened here: pyarrow takes no path with bytes that are no characters.
    with path.open("wb") as file:
        parquet.write_table(
            pa.Table.from_arrays(arrays, schema=schema),
            file,
            compression="zstd",
            compression_level=1,
            use_dictionary=False,
            column_encoding=encodings,
            write_statistics=False,
            write_page_checksum=True,
        )


def table_checksum(path: Path) -> int:
    """CRC-32 of a whole file: the checksums of its pages cover neither their headers nor the footer."""
    return crc32(path.read_bytes())


def read_table(path: Path, checksum: int | None = None) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read a file of `write_table`: its columns and its metadata.

    Parameters
    ----------
    path
        File to read. The checksums of its pages are checked.
    checksum
        `table_checksum` of the file when it was written, None where it is not known.

    Raises
    ------
    FerryIdError
        For a file that is missing, damaged or not written by ferryid.
    """
    import pyarrow as pa
    import pyarrow.parquet as parquet

    try:
        data = path.read_bytes()
        if checksum is not None and crc32(data) != checksum:
            raise ValueError("its checksum differs")
        table = parquet.ParquetFile(pa.BufferReader(data), page_checksum_verification=True).read()
        metadata: dict[str, Any] = json.loads(table.schema.metadata[METADATA_KEY])
        columns = {name: _values(table.column(name)) for name in table.column_names}
    except (pa.ArrowException, OSError, LookupError, TypeError, ValueError, MemoryError) as error:
        raise FerryIdError(
            f"{path}: this table of the log cache cannot be read ({one_line(str(error))}). "
            "Fix: delete its folder, the next ingest writes it again"
        ) from error
    return columns, metadata


def _values(column: Any) -> NDArray[Any]:
    kind = {"int64": np.int64, "double": np.float64}.get(str(column.type))
    if kind is None or column.null_count:
        raise ValueError(f"a column of {column.type}, {counted(column.null_count, 'cell')} of it missing")
    dtype = np.dtype(kind)
    parts = [
        np.frombuffer(chunk.buffers()[1], dtype=dtype, count=len(chunk), offset=chunk.offset * dtype.itemsize)
        for chunk in column.chunks
        if len(chunk)
    ]
    return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0, dtype=dtype), *parts])
