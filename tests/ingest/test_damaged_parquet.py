"""Parquet tables: any type of column, and damage that is found by checksums, counted, and never a crash."""

from __future__ import annotations

import tracemalloc
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Reader, Series, TableLayout
from ferryid.ingest.parquet_footer import null_counts

N = 300


def columns() -> dict[str, Any]:
    return {"time_ns": np.arange(N) * 10**8, "u": np.sin(np.arange(N)), "f": np.cos(np.arange(N))}


def read(path: Path, layout: TableLayout | None = None) -> tuple[Series, Reader]:
    reader = open_log(path, layout)
    return reader.read({"table": tuple(reader.topics[0].fields)})["table"], reader


def written(path: Path, table: pa.Table, **options: Any) -> bytearray:
    parquet.write_table(table, path, compression="none", use_dictionary=False, write_page_checksum=True, **options)
    return bytearray(path.read_bytes())


def damage(path: Path, content: bytearray, value: float) -> None:
    """Flip one bit of the page that holds a value."""
    place = content.index(np.float64(value).tobytes())
    content[place] ^= 1
    path.write_bytes(bytes(content))


def test_a_flipped_bit_of_a_page_is_refused_by_its_checksum(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    content = written(path, pa.table(columns()))
    damage(path, content, float(np.sin(7)))
    with pytest.raises(FerryIdError, match=r"cannot be read \(.*(CRC|checksum).*\)\. Fix: export"):
        read(path)


def test_a_damaged_row_group_costs_its_rows(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    content = written(path, pa.table(columns()), row_group_size=100)
    damage(path, content, float(np.sin(150)))
    series, reader = read(path)
    assert series.columns["u"].tolist() == [*np.sin(np.arange(100)), *np.sin(np.arange(200, 300))]
    (loss,) = reader.losses
    assert loss.messages == 100
    assert "1 of 3 row groups" in loss.what
    # A column whose pages are whole is not affected.
    assert len(open_log(path).read({"table": ("f",)})["table"].receive_ns) == N


def test_columns_of_one_name_are_numbered(tmp_path: Path) -> None:
    table = pa.Table.from_arrays(
        [pa.array([0.0, 0.1]), pa.array([1, 2]), pa.array([3, 4]), pa.array([{"x": 5}, {"x": 6}]), pa.array([7, 8])],
        names=["time", "u", "u", "p", "p.x"],
    )
    parquet.write_table(table, tmp_path / "log.parquet")
    series, reader = read(tmp_path / "log.parquet")
    assert {name: values.tolist() for name, values in series.columns.items() if name != "time"} == {
        "u": [1, 2],
        "u (2)": [3, 4],
        "p.x": [5, 6],
        "p.x (2)": [7, 8],
    }
    assert "repeated column names" in reader.topics[0].note


def test_types_that_no_signal_can_have_are_listed(tmp_path: Path) -> None:
    table = pa.table(
        {
            "time": [0.0, 0.1],
            "list": [[1], [2]],
            "raw": [b"a", b"b"],
            "price": pa.array([None, None], pa.decimal128(9, 2)),
            "none": pa.nulls(2),
            "coded": pa.array([1.5, 2.5]).dictionary_encode(),
        }
    )
    parquet.write_table(table, tmp_path / "log.parquet")
    series, reader = read(tmp_path / "log.parquet")
    assert 'columns of these types are not read: "list" (list' in reader.topics[0].note
    assert '"raw" (binary)' in reader.topics[0].note
    assert series.columns["coded"].tolist() == [1.5, 2.5]
    assert np.isnan(series.columns["price"]).all()
    assert np.isnan(series.columns["none"]).all()


@pytest.mark.parametrize(
    ("times", "rows"),
    [
        (pa.array([0, 253402300800, 1], pa.timestamp("s")), 2),
        (pa.array([0, None, 10**6], pa.timestamp("us", "Europe/Oslo")), 2),
        (pa.array([10**9, 2 * 10**9, -(2**63) + 5], pa.int64()), 2),
        (pa.array([1, 2, 2**64 - 1], pa.uint64()), 2),
        (pa.array([19000, 19001, 19002], pa.date32()), 3),
    ],
)
def test_times_of_any_type_are_read_or_counted(tmp_path: Path, times: pa.Array, rows: int) -> None:
    parquet.write_table(pa.table({"time": times, "u": [1.0, 2.0, 3.0]}), tmp_path / "log.parquet")
    series, reader = read(tmp_path / "log.parquet", TableLayout(time="time", time_unit="ns"))
    assert len(series.receive_ns) == rows
    assert sum(loss.messages or 0 for loss in reader.losses) == 3 - rows


def test_nanoseconds_with_a_missing_cell_stay_exact(tmp_path: Path) -> None:
    first = 1744362945123456789
    table = pa.table({"time": pa.array([first, None, first + 1]), "u": [1.0, 2.0, 3.0]})
    parquet.write_table(table, tmp_path / "log.parquet")
    series, _ = read(tmp_path / "log.parquet", TableLayout(time="time", time_unit="ns"))
    assert series.receive_ns.tolist() == [first, first + 1]


def test_an_empty_first_row_group_is_skipped(tmp_path: Path) -> None:
    table = pa.table(columns())
    with parquet.ParquetWriter(tmp_path / "log.parquet", table.schema) as writer:
        writer.write_table(table.slice(0, 0))
        writer.write_table(table)
    assert len(read(tmp_path / "log.parquet")[0].receive_ns) == N


def test_a_footer_that_claims_more_than_the_file_can_hold_is_refused(tmp_path: Path) -> None:
    rows = 200_000_000
    import ferryid.ingest.parquet_reader as module

    parquet.write_table(pa.table(columns()), tmp_path / "log.parquet")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_claimed_bytes", lambda path, file: 8 * rows)
        with pytest.raises(FerryIdError, match=r"claims 300 rows that need 1600 MB"):
            read(tmp_path / "log.parquet")


def test_an_encrypted_table_is_named_so(tmp_path: Path) -> None:
    (tmp_path / "log.parquet").write_bytes(b"PARE" + b"\0" * 100 + b"\x10\0\0\0PARE")
    with pytest.raises(FerryIdError, match=r"is encrypted\. Fix"):
        open_log(tmp_path / "log.parquet")


def test_milliseconds_stated_as_seconds_are_noted(tmp_path: Path) -> None:
    table = pa.table({"time": np.arange(50) * 100, "u": np.arange(50.0)})
    parquet.write_table(table, tmp_path / "log.parquet")
    (topic,) = open_log(tmp_path / "log.parquet", TableLayout(time="time")).topics
    assert 'look like milliseconds, so set time_unit = "ms"' in topic.note


@pytest.mark.parametrize("as_dictionary", [True, False])
def test_a_long_text_that_all_rows_have_is_held_once(tmp_path: Path, as_dictionary: bool) -> None:
    text = "a" * (4 << 20)
    rows = pa.array(np.zeros(N, np.int32), mask=np.arange(N) == 7)
    table = pa.table({**columns(), "note": pa.DictionaryArray.from_arrays(rows, pa.array([text]))})
    parquet.write_table(table, tmp_path / "log.parquet", store_schema=as_dictionary)
    allowed = 100 << 20
    pa_before = pa.default_memory_pool().bytes_allocated()
    tracemalloc.start()
    try:
        series, _ = read(tmp_path / "log.parquet")
        assert tracemalloc.get_traced_memory()[1] < allowed
    finally:
        tracemalloc.stop()
    assert pa.default_memory_pool().bytes_allocated() - pa_before < allowed
    notes = series.columns["note"]
    assert [len(notes[row]) for row in (0, 7, 8)] == [len(text), 0, len(text)]
    assert notes[0] is notes[N - 1]


def test_texts_in_structs_of_several_row_groups_are_read(tmp_path: Path) -> None:
    texts = pa.array(["a", "b", None] * (N // 3))
    struct = pa.StructArray.from_arrays([texts, pa.array(np.arange(N))], ["note", "value"])
    parquet.write_table(
        pa.table({**columns(), "s": struct, "note": texts}), tmp_path / "log.parquet", row_group_size=90
    )
    series, reader = read(tmp_path / "log.parquet")
    assert not reader.losses
    for name in ("s.note", "note"):
        assert series.columns[name].tolist() == ["a", "b", ""] * (N // 3)


@pytest.mark.slow
def test_no_byte_of_a_page_header_makes_values_missing_in_silence(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    content = written(path, pa.table(columns()), row_group_size=100)
    place = parquet.ParquetFile(path).metadata.row_group(1).column(1).data_page_offset
    true, silent = np.sin(np.arange(N)), list[tuple[int, int]]()
    # Eight is the number, as it is stored, of an encoding of the levels that pyarrow reads without an error.
    for byte, value in product(range(40), (0, 8, 16, 255)):
        damaged = content.copy()
        damaged[place + byte] = value
        path.write_bytes(bytes(damaged))
        try:
            series, reader = read(path)
        except FerryIdError:
            continue
        if not reader.losses and not np.array_equal(series.columns["u"], true):
            silent.append((byte, value))
    assert silent == []


def test_values_that_were_missing_when_the_table_was_written_are_no_damage(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    table = pa.table({**columns(), "u": [None if k % 3 else 1.0 for k in range(N)]})
    written(path, table, row_group_size=100)
    series, reader = read(path)
    assert int(np.isnan(series.columns["u"]).sum()) == N - N // 3
    assert reader.losses == ()
    assert [one["u"] for one in null_counts(path)] == [66, 67, 67]
    path.write_bytes(path.read_bytes()[:-20] + bytes(12) + path.read_bytes()[-8:])
    assert null_counts(path) == [] or len(null_counts(path)) == 3
