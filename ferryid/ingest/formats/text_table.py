"""One text table, comma, semicolon, tab or blank separated: one topic named ``table``."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

CERTAIN = (".csv", ".tsv")
"""Suffixes of nothing else than tables: a damaged byte does not make such a file something else."""
SUFFIXES = (*CERTAIN, ".txt", ".dat", ".asc", ".tab", ".prn", ".log", ".out")


def _matches(path: Path, head: bytes) -> bool:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES or not path.is_file():
        return False
    if suffix in CERTAIN:
        return True
    from ferryid.ingest.table_text import looks_like_text

    return looks_like_text(head)


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.table_text import open_text
    from ferryid.ingest.tables import TableReader

    return TableReader([open_text(path, layout)])


FORMAT = Format(name="CSV or text table", matches=_matches, open=_open, order=80, suffixes=SUFFIXES)
