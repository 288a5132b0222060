"""SQLite files of rosbag2, without their folder or within it."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

SUFFIX = ".db3"
MAGIC = b"SQLite format 3\0"


def matches(path: Path, head: bytes) -> bool:
    """Take SQLite files by their first bytes, and compressed or damaged ones by their name."""
    name = path.name.removesuffix(".zstd").removesuffix(".lz4")
    return head.startswith(MAGIC) or (bool(head) and name.endswith(SUFFIX))


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.sqlite3_reader import open_file

    return open_file(path)


FORMAT = Format("ROS2 SQLite file (.db3)", matches, _open, order=30, suffixes=(SUFFIX, f"{SUFFIX}.zstd"), parts=True)
