"""A log compressed as a whole by zstd or lz4 (``trial.mcap.zst``, ``trial.bag.lz4``), outside a ROS2 folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ferryid.ingest.log import Format, TableLayout

SUFFIXES = (".zstd", ".zst", ".lz4")


def _matches(path: Path, head: bytes) -> bool:
    if not path.name.endswith(SUFFIXES):
        return False
    from ferryid.ingest.unpack import codec_of

    return codec_of(head) is not None


def _open(path: Path, layout: TableLayout | None) -> Any:
    from ferryid.ingest.unpacked_reader import UnpackedLog

    return UnpackedLog(path, layout)


# After SQLite, which unpacks its own files.
FORMAT = Format(name="log compressed by zstd or lz4", matches=_matches, open=_open, order=60, suffixes=SUFFIXES)
