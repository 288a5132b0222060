"""A DataFlash log of the speeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.ingest.autopilot_logs import DataFlash

RENAMED = {"/position": None, "/speed": "/SPD"}
# The file ends with its last message.
CUT_SHOWS = False


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    log = DataFlash()
    log.define("SPD", "Qd", "TimeUS,data")
    for one in messages:
        if one.topic == "/speed":
            log.add("SPD", one.receive_ns // 1000, one.values["data"])
    (folder / "log.bin").write_bytes(log.content)
    return folder / "log.bin"
