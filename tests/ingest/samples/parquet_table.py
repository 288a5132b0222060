"""One Parquet file of the speeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as parquet

RENAMED = {"/position": None, "/speed": "table"}


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    rows = [message for message in messages if message.topic == "/speed"]
    times = pa.array([row.receive_ns for row in rows], pa.timestamp("ns", tz="UTC"))
    parquet.write_table(pa.table({"time": times, "data": [row.values["data"] for row in rows]}), folder / "log.parquet")
    return folder / "log.parquet"
