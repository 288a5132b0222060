"""Parquet tables: pages, footers, and columns of every kind."""

from __future__ import annotations

import io
import struct
from random import Random
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

from tests.attack.case import EXACT, UNCHECKED, Base, Mutated, Mutation, Rows, odd_number, replaced
from tests.attack.logs import messages

NAME = "log.parquet"
WANTED = {"table": ("data",)}
OPTIONS: dict[str, dict[str, Any]] = {
    "plain": {"compression": "none", "use_dictionary": False},
    "snappy, dictionary": {"compression": "snappy"},
    "zstd, pages v2": {"compression": "zstd", "data_page_version": "2.0"},
    "snappy, no checksum": {"compression": "snappy", "write_page_checksum": False},
}


def bases() -> list[Base]:
    """Compressions, dictionaries, both versions of pages, with checksums and without."""
    return [_base(name, options) for name, options in OPTIONS.items()]


def _table() -> Any:
    found = [(time, value) for topic, time, value in messages() if topic == "/speed"]
    times = pa.array([time for time, _ in found], pa.timestamp("ns", tz="UTC"))
    return pa.table({"time": times, "data": [value for _, value in found], "note": ["ok", "fine"] * (len(found) // 2)})


def _written(table: Any, **options: Any) -> bytes:
    output = io.BytesIO()
    settings = {"row_group_size": 40, "write_page_checksum": True, "data_page_size": 200, **options}
    parquet.write_table(table, output, **settings)
    return output.getvalue()


def _base(name: str, options: dict[str, Any]) -> Base:
    content = _written(_table(), **options)
    table = parquet.ParquetFile(io.BytesIO(content)).read(use_threads=False)
    times = np.array(table.column("time").cast(pa.int64()).to_pylist(), np.int64)
    truth = {"table": Rows(times, np.array(table.column("data").to_pylist(), float))}
    checked = options.get("write_page_checksum", True)
    spans = {NAME: ((4, _footer(content)[0]),)} if checked else None
    return Base("parquet_table", name, {NAME: content}, NAME, truth, WANTED, EXACT if checked else UNCHECKED, spans)


def _footer(content: bytes) -> tuple[int, int]:
    (size,) = struct.unpack("<L", content[-8:-4])
    return len(content) - 8 - size, size


def footer(random: Random, base: Base) -> Mutated | None:
    """Set bytes of the footer, or its length."""
    content = bytearray(base.files[NAME])
    start, size = _footer(bytes(content))
    if random.random() < 0.15:
        new = odd_number(random, 4, size)
        content[-8:-4] = struct.pack("<L", new)
        return Mutated(f"length of the footer set from {size} to {new}", replaced(base, NAME, bytes(content)))
    at = start + random.randrange(size)
    new = odd_number(random, 1, content[at])
    old, content[at] = content[at], new
    if new == old:
        return None
    what = f"byte {at - start} of the footer set from {old} to {new}"
    return Mutated(what, replaced(base, NAME, bytes(content)), content=True)


def page(random: Random, base: Base) -> Mutated | None:
    """Set bytes before the footer: pages and their headers."""
    content = bytearray(base.files[NAME])
    end, _ = _footer(bytes(content))
    at, size = random.randrange(4, end), random.choice((1, 1, 4))
    content[at : at + size] = random.choice((bytes(size), b"\xff" * size, random.randbytes(size)))
    if bytes(content) == base.files[NAME]:
        return None
    return Mutated(f"{size} bytes at {at} set", replaced(base, NAME, bytes(content)))


def columns(random: Random, base: Base) -> Mutated | None:
    """Write the table with columns of other names, types and values."""
    table = _table()
    count = table.num_rows
    rng = np.random.default_rng(random.randrange(2**32))
    made: dict[str, Any] = {
        "twice the same name": lambda: pa.Table.from_arrays([*table.columns, table.column("data")],
                                                            names=[*table.column_names, "data"]),
        "every name the same": lambda: table.rename_columns(["time"] * 3),
        "far times": lambda: table.set_column(
            0, "time", pa.array(rng.integers(-(2**63), 2**63 - 1, count), pa.timestamp("ns"))
        ),
        "far times in seconds": lambda: table.set_column(
            0, "time", pa.array(rng.integers(-(2**62), 2**62, count), pa.timestamp("s"))
        ),
        "no time at all": lambda: table.set_column(0, "time", pa.nulls(count, pa.timestamp("us"))),
        "times of type null": lambda: table.set_column(0, "time", pa.nulls(count)),
        "times as decimals": lambda: table.set_column(0, "time", table.column(0).cast(pa.int64()).cast(pa.decimal128(38, 0))),
        "times as text": lambda: table.set_column(0, "time", pa.array([f"2020-13-{i}" for i in range(count)])),
        "some times missing": lambda: table.set_column(
            0, "time", pa.array([None if i % 7 == 0 else 1_600_000_000 * 10**9 + i for i in range(count)], pa.timestamp("ns"))
        ),
        "values as lists": lambda: table.set_column(1, "data", pa.array([[1.0]] * count)),
        "values as a map": lambda: table.set_column(
            1, "data", pa.array([[("a", 1)]] * count, pa.map_(pa.string(), pa.int64()))
        ),
        "values as decimals": lambda: table.set_column(1, "data", table.column(1).cast(pa.decimal128(20, 2))),
        "values as binary": lambda: table.set_column(1, "data", pa.array([b"\xff"] * count)),
        "values as text": lambda: table.set_column(1, "data", pa.array(["x"] * count)),
        "values as durations": lambda: table.set_column(1, "data", pa.array([1] * count, pa.duration("ns"))),
        "values as dates": lambda: table.set_column(1, "data", pa.array([2**31 - 1] * count, pa.date32())),
        "values as times of day": lambda: table.set_column(1, "data", pa.array([5] * count, pa.time64("ns"))),
        "values as a struct": lambda: table.set_column(1, "data", pa.array([{"a": 1.0, "b": None}] * count)),
        "a struct beside its member's name": lambda: table.append_column("s", pa.array([{"a": 1}] * count)).append_column(
            "s.a", pa.array([2] * count)
        ),
        "dictionary of text": lambda: table.set_column(1, "data", pa.array(["x"] * count).dictionary_encode()),
        "nested structs": lambda: table.append_column("deep", _nested(count, 60)),
        "2000 columns": lambda: _wide(table, 2000),
        "no rows": lambda: table.slice(0, 0),
        "one row": lambda: table.slice(0, 1),
        "no columns": lambda: table.select([]),
        "names with control characters": lambda: table.rename_columns(["time", "data\x1b[2J", "n\x00te"]),
        "empty names": lambda: table.rename_columns(["time", "", " "]),
        "half floats": lambda: table.set_column(1, "data", pa.array(np.ones(count, np.float16))),
        "unsigned": lambda: table.set_column(1, "data", pa.array(np.full(count, 2**64 - 1, np.uint64))),
    }  # fmt: skip
    what = random.choice(list(made))
    try:
        content = _written(made[what](), **OPTIONS[base.name])
    except (pa.ArrowException, ValueError):
        return None
    total = {"no rows": 0, "no columns": 0, "one row": 1}.get(what, count)
    return Mutated(what, replaced(base, NAME, content), total=total)


def _nested(count: int, depth: int) -> Any:
    value: Any = 1.0
    for _ in range(depth):
        value = {"a": value}
    return pa.array([value] * count)


def _wide(table: Any, count: int) -> Any:
    column = table.column("data")
    return pa.Table.from_arrays(
        [*table.columns, *[column] * count], names=[*table.column_names, *map(str, range(count))]
    )


MUTATIONS: dict[str, Mutation] = {"footer": footer, "pages": page, "columns": columns}
