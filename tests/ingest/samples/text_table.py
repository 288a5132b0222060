"""One CSV file of the speeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

RENAMED = {"/position": None, "/speed": "table"}
# A row that a cut leaves incomplete may still be a valid, shorter number.
CUT_SHOWS = False


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    rows = [message for message in messages if message.topic == "/speed"]
    lines = [f"{row.receive_ns},{row.values['data']!r}" for row in rows]
    (folder / "log.csv").write_text("\n".join(["time,data", *lines]) + "\n")
    return folder / "log.csv"
