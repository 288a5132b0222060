"""Logs of PX4 (ULog)."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

MAGIC = b"ULog\x01\x12\x35"
SUFFIXES = (".ulg", ".ulog")


def _matches(path: Path, head: bytes) -> bool:
    return path.is_file() and (
        head.startswith(MAGIC[:4]) or (path.suffix.lower() in SUFFIXES and MAGIC.startswith(head))
    )


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.ulog_reader import open_ulog

    return open_ulog(path, layout)


FORMAT = Format(name="ULog of PX4", matches=_matches, open=_open, order=15, suffixes=SUFFIXES)
