"""A ROS1 bag of several small chunks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Writer


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    writer = Writer(folder / "log.bag")
    writer.set_compression(Writer.CompressionFormat.LZ4)
    writer.chunk_threshold = 8000
    writer.open()
    types = {message.topic: message.msgtype for message in messages}
    connections = {topic: writer.add_connection(topic, kind, typestore=ros.ros1) for topic, kind in types.items()}
    for message in messages:
        writer.write(connections[message.topic], message.receive_ns, ros.serialised(message, "ros1"))
    writer.close()
    return folder / "log.bag"
