"""One Parquet table."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

SUFFIXES = (".parquet", ".pq")


def _matches(path: Path, head: bytes) -> bool:
    return path.is_file() and (head[:4] in (b"PAR1", b"PARE") or path.suffix.lower() in SUFFIXES)


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.parquet_reader import open_table

    return open_table(path, layout)


FORMAT = Format(name="Parquet table", matches=_matches, open=_open, order=20, suffixes=SUFFIXES)
