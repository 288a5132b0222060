"""Columns of pyarrow as NumPy arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from ferryid.ingest.log import Column

MISSING_TIME = np.iinfo(np.int64).min
"""A missing cell in a time column of whole numbers, which floats would round to 256 ns; no time at all."""


def column_from_arrow(chunked: Any, *, is_time: bool = False) -> Column:
    """Copy a pyarrow column to NumPy without importing pandas, which pyarrow's own ``to_numpy`` does.

    Integers and booleans with missing cells become floats with NaN; text and anything else becomes objects, "" where
    missing. Timestamps beyond what nanoseconds hold become NaT. A time column of integers stays one, with `MISSING_TIME`.
    """
    import pyarrow as pa

    if pa.types.is_dictionary(chunked.type):
        if pa.types.is_string(chunked.type.value_type) or pa.types.is_large_string(chunked.type.value_type):
            return _texts_of_dictionaries(chunked)
        chunked = chunked.cast(chunked.type.value_type)
    kind = chunked.type
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        return _timestamps(chunked)
    if pa.types.is_decimal(kind):
        chunked, kind = chunked.cast(pa.float64(), safe=False), pa.float64()
    if pa.types.is_floating(kind):
        numbers = _buffer_values(chunked.cast(pa.float64()), np.dtype(np.float64))
        return _with_missing(chunked, numbers, np.nan)
    if pa.types.is_integer(kind):
        if chunked.null_count and is_time:
            whole = _buffer_values(chunked.cast(pa.int64(), safe=False), np.dtype(np.int64))
            return _with_missing(chunked, whole, MISSING_TIME)
        if chunked.null_count:
            return _with_missing(
                chunked, _buffer_values(chunked.cast(pa.float64(), safe=False), np.dtype("f8")), np.nan
            )
        return _buffer_values(chunked, np.dtype(str(kind)))
    if pa.types.is_null(kind):
        return np.full(len(chunked), np.nan)
    if pa.types.is_boolean(kind):
        if chunked.null_count == 0:
            return np.array(chunked.to_pylist(), dtype=bool)
        return np.array([np.nan if value is None else float(value) for value in chunked.to_pylist()], dtype=np.float64)
    texts = np.empty(len(chunked), dtype=object)
    texts[:] = ["" if value is None else str(value) for value in chunked.to_pylist()]
    return texts


def _texts_of_dictionaries(chunked: Any) -> Column:
    """Texts with "" where missing; each text of a dictionary is held once, however many rows have it."""
    parts = []
    for chunk in chunked.chunks:
        # One text more than the dictionary has, for the missing cells.
        values = np.array([*(value or "" for value in chunk.dictionary.to_pylist()), ""], dtype=object)
        rows = chunk.indices.cast("int64").fill_null(len(values) - 1) if chunk.indices.null_count else chunk.indices
        parts.append(values[rows.to_numpy(zero_copy_only=False)])
    return np.concatenate(parts) if parts else np.empty(0, dtype=object)


def _timestamps(chunked: Any) -> Column:
    """Timestamps and dates as nanoseconds since 1970, NaT where missing or out of range."""
    import pyarrow as pa

    if pa.types.is_date(chunked.type):
        chunked = chunked.cast(pa.timestamp("ms"))
    per_unit = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}[chunked.type.unit]
    counts = _buffer_values(chunked.cast(pa.int64()), np.dtype(np.int64))
    most = np.iinfo(np.int64).max // per_unit
    fits = (counts >= -most) & (counts <= most)
    whole = (np.where(fits, counts, 0) * np.int64(per_unit)).view("datetime64[ns]")
    if not fits.all():
        whole[~fits] = np.datetime64("NaT", "ns")
    return _with_missing(chunked, whole, np.datetime64("NaT", "ns"))


def _buffer_values(chunked: Any, dtype: np.dtype[Any]) -> Column:
    parts = [
        np.frombuffer(chunk.buffers()[1], dtype=dtype, count=len(chunk), offset=chunk.offset * dtype.itemsize)
        for chunk in chunked.chunks
        if len(chunk)
    ]
    return np.concatenate(parts) if parts else np.empty(0, dtype=dtype)


def _with_missing(chunked: Any, values: Column, missing: Any) -> Column:
    if chunked.null_count == 0:
        return values
    filled = values.copy()
    filled[np.array(chunked.is_null().to_pylist(), dtype=bool)] = missing
    return filled
