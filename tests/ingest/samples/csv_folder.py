"""A folder with one CSV per topic, as exports of ROS2 bags have it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

# A row that a cut leaves incomplete may still be a valid, shorter number.
CUT_SHOWS = False


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    path = folder / "export"
    path.mkdir()
    for topic in {message.topic for message in messages}:
        rows = [message for message in messages if message.topic == topic]
        stamped = rows[0].stamp_ns is not None
        names = ["time", *(["header_stamp_sec", "header_stamp_nanosec"] if stamped else []), *rows[0].values]
        lines = [",".join(names)]
        for row in rows:
            stamp = [str(part) for part in divmod(row.stamp_ns, 10**9)] if stamped else []
            lines.append(",".join([str(row.receive_ns), *stamp, *(repr(value) for value in row.values.values())]))
        (path / f"{topic[1:]}.csv").write_text("\n".join(lines) + "\n")
    return path
