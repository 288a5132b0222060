"""A folder of CSV files, one topic per file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ferryid.ingest import log_suffixes
from ferryid.ingest.log import Format, Reader, TableLayout


def csv_files(folder: Path) -> Iterator[Path]:
    """CSV files of the folder and of folders in it, hidden ones left out, in a fixed order."""
    found = (path for path in folder.rglob("*") if path.suffix.lower() == ".csv" and path.is_file())
    return iter(sorted(p for p in found if not any(part.startswith(".") for part in p.relative_to(folder).parts)))


def _matches(path: Path, head: bytes) -> bool:
    if not path.is_dir() or any(file.name.endswith(log_suffixes(parts=True)) for file in path.iterdir()):
        return False  # notes in a CSV beside bags do not make the bags a table
    return next(csv_files(path), None) is not None


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.csv_folder_reader import open_folder

    return open_folder(path, layout)


FORMAT = Format(name="folder of CSV files", matches=_matches, open=_open, order=80)
