"""ROS1 bags."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

SUFFIXES = (".bag", ".bag.active")


def matches(path: Path, head: bytes) -> bool:
    """Tell a bag by its first bytes, or by its name so that a damaged one gets a clear line."""
    return head.startswith(b"#ROSBAG") or (path.is_file() and path.name.endswith(SUFFIXES))


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.rosbag1_reader import Rosbag1Reader

    return Rosbag1Reader(path)


FORMAT = Format(name="ROS1 bag (.bag)", matches=matches, open=_open, order=20, suffixes=SUFFIXES, parts=True)
