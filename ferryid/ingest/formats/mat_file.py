"""MAT files of MATLAB and Octave (``.mat``)."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

SUFFIXES = (".mat",)
_HEADS = (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")


def _matches(path: Path, head: bytes) -> bool:
    if not path.is_file():
        return False
    return head.startswith(_HEADS) or path.suffix.lower() in SUFFIXES


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.mat_reader import open_mat

    return open_mat(path, layout)


FORMAT = Format(name="MAT file of MATLAB", matches=_matches, open=_open, order=25, suffixes=SUFFIXES)
