"""One SQLite file of a ROS2 recording, without its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.rosbag2 import StoragePlugin, Writer


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    path = folder / "recording"
    types = {message.topic: message.msgtype for message in messages}
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {topic: writer.add_connection(topic, kind, typestore=ros.ros2) for topic, kind in types.items()}
        for message in messages:
            writer.write(connections[message.topic], message.receive_ns, ros.serialised(message, "cdr"))
    return (path / "recording.db3").rename(folder / "log.db3")
