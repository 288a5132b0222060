"""MCAP files, of any profile."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

SUFFIX = ".mcap"
MAGIC = b"\x89MCAP0\r\n"


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.mcap_reader import open_mcap

    return open_mcap(path)


FORMAT = Format(
    name="MCAP",
    matches=lambda path, head: head.startswith(MAGIC),
    open=_open,
    order=10,
    suffixes=(SUFFIX, f"{SUFFIX}.zstd"),
    parts=True,
)
