"""Logs of ArduPilot (DataFlash)."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

SYNC, FMT, HEAD_BYTES = b"\xa3\x95", 0x80, 3
"""What every message begins with, the kind of the one that defines the others, and how long its head is."""
SUFFIXES = (".bin",)


def _matches(path: Path, head: bytes) -> bool:
    return (
        path.is_file()
        and head[:2] == SYNC
        and (len(head) < HEAD_BYTES or head[2] == FMT or path.suffix.lower() in SUFFIXES)
    )


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.dataflash_reader import open_dataflash

    return open_dataflash(path, layout)


FORMAT = Format(name="DataFlash log of ArduPilot", matches=_matches, open=_open, order=15, suffixes=SUFFIXES)
