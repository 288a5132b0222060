"""The table of a batch: one row a log, one column a parameter."""

from __future__ import annotations

import json
import os
import sys
from datetime import UTC, datetime
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ferryid.batch.summary import table_of, write_table
from tests.batch.rows import finding, row

BAD = {
    "status": "refused", "reason": "empty", "sha256": None, "start_ns": None, "duration_s": None, "fit": None, "evaluate": None,
    "diagnose": None, "seconds": {}, "files": [],
}  # fmt: skip


def test_columns(tmp_path: Path) -> None:
    rows = [
        row("a.mcap", 3, findings=(finding("fouling", surge=1.4), finding("thruster_gain", "bow", 0.3, factor=0.8))),
        row("b.mcap", 4),
        row("c.mcap", **BAD),
    ]
    write_table(tmp_path / "s.parquet", table_of(rows))
    table = pq.read_table(tmp_path / "s.parquet")
    assert table.num_rows == 3
    a, b, c = table.to_pylist()
    assert a["date"] == datetime(2024, 5, 3, tzinfo=UTC)
    assert table.schema.field("date").type == pa.timestamp("us", "UTC")
    assert [a[f"fouling.surge{end}"] for end in ("", ".low", ".high", ".probability")] == pytest.approx(
        [1.4, 0.4, 2.4, 0.99]
    )
    assert a["thruster_gain(bow).factor"] == 0.8
    assert a["thruster_gain(bow).factor.probability"] == 0.3
    assert b["fouling.surge"] is None
    assert (a["verdict"], b["verdict"], c["verdict"]) == ("explained", "matched", None)
    assert [one["effect"] for one in json.loads(a["findings"])] == ["fouling", "thruster_gain"]
    assert a["fit_report"] == "results/a.mcap-0123/reports/m-v1/report.html"
    assert a["evaluation"] == "results/a.mcap-0123/evaluation.json"
    assert (a["accepted"], b["accepted"], c["accepted"]) == (True, False, None)
    assert (a["mse_base.yaw"], a["mse_fit.yaw"], a["mse_evaluated.yaw"]) == (300.0, 30.0, 243.0)
    assert (a["mse_diagnosed_before.sway"], a["mse_diagnosed_after.sway"]) == (4.0, 1.0)
    assert (a["seconds"], c["seconds"]) == (5.5, 0.0)
    assert (c["status"], c["reason"], c["bytes"]) == ("refused", "empty", 0)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems take no such name")
def test_a_folder_whose_name_holds_bytes_that_are_no_characters(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"o\xff") / "s.parquet"
    write_table(path, table_of([]))
    assert path.is_file()


def test_where_nothing_came_of_any_log() -> None:
    table = table_of([row("c.mcap", **BAD)])
    # Columns have their types all the same, so that tables of several batches can be put together.
    assert table.schema.field("normalised_mse").type == pa.float64()
    assert table.schema.field("date").type == pa.timestamp("us", "UTC")


@pytest.mark.parametrize(
    ("start_ns", "date", "said", "source"),
    [
        (1_714_521_600_000_000_000, None, "2024-05-01T00:00:00+00:00", "log"),
        # The clock of a table that counts from its own start is no date.
        (0, None, None, None),
        (3_600_000_000_000, None, None, None),
        (-(2**62), None, None, None),
        (0, "2023-01-02T00:00:00+00:00", "2023-01-02T00:00:00+00:00", "manifest"),
        (1_714_521_600_000_000_000, "2023-01-02T00:00:00+00:00", "2023-01-02T00:00:00+00:00", "manifest"),
    ],
)
def test_dates(start_ns: int, date: str | None, said: str | None, source: str | None) -> None:
    made = row("a.mcap", start_ns=start_ns, date=date)
    assert (made.date, made.date_from) == (said, source)
