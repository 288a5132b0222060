"""ROS2 recordings: a folder with its metadata.yaml, or that file."""

from __future__ import annotations

from pathlib import Path

from ferryid.ingest.log import Format, Reader, TableLayout

NAME = "metadata.yaml"
KEY = "rosbag2_bagfile_information"


def matches(path: Path, head: bytes) -> bool:
    """Take a folder that holds a metadata.yaml, or that metadata.yaml itself."""
    if path.name == NAME and head:
        return KEY.encode() in head
    return path.is_dir() and (path / NAME).is_file()


def _open(path: Path, layout: TableLayout | None) -> Reader:
    from ferryid.ingest.rosbag2_reader import FolderLog

    return FolderLog(path if path.is_dir() else path.parent)


FORMAT = Format("ROS2 folder", matches, _open, order=20)
