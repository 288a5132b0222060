"""A log as a ROS1 bag or a ROS2 folder, laid out as ordinary recorders leave them: nothing names the program."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.rosbag2.enums import CompressionFormat
from rosbags.rosbag2.storage_mcap import McapWriter as McapStorage
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer as Sqlite3Storage

from ferryid.errors import FerryIdError
from ferryid.simulate.messages import definition, serialised, type_hash
from ferryid.simulate.sensors import Stream

DISTRO = "jazzy"
"""The ROS 2 release whose recorder lays out metadata of version 9."""
BULKY = ("/imu/", "/camera/")
"""Topics that are offered as best effort, as drivers of fast sensors do."""
_FOREVER = QosTime(9223372036, 854775807)


def write_ros1(streams: list[Stream], path: Path, chunk_bytes: int) -> None:
    """Write one ROS1 bag."""
    writer = Ros1Writer(path)
    writer.chunk_threshold = chunk_bytes
    writer.set_compression(Ros1Writer.CompressionFormat.LZ4)
    with writer:
        connections = []
        for stream in streams:
            text, md5sum = definition(stream.type, 1, stream.definition)
            connections.append(
                writer.add_connection(
                    stream.topic, stream.type, msgdef=text, md5sum=md5sum, callerid=_node(stream.topic), latching=0
                )
            )
        for when, index, _, data in _in_order(streams, 1):
            writer.write(connections[index], when, data)


def write_ros2(streams: list[Stream], folder: Path, storage: str) -> None:
    """Write a ROS2 folder; `storage` is ``sqlite3`` or ``mcap``.

    Raises
    ------
    FerryIdError
        When the database cannot be written.
    """
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer = _Writer(folder, version=9, storage_plugin=plugin)
    if plugin is StoragePlugin.MCAP:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    try:
        with writer:
            connections = [
                writer.add_connection(
                    stream.topic,
                    stream.type,
                    msgdef=definition(stream.type, 2, stream.definition)[0],
                    rihs01=type_hash(stream),
                    offered_qos_profiles=[_offered(stream.topic)],
                )
                for stream in streams
            ]
            for when, index, _, data in _in_order(streams, 2):
                writer.write(connections[index], when, data)
    except sqlite3.Error as error:
        raise FerryIdError(
            f"{folder.name}: the database cannot be written, {error}. Fix: check the space on the disk"
        ) from error
    writer.metapath.write_text(_signed(writer.metapath.read_text(encoding="utf-8")), encoding="utf-8")


def _in_order(streams: list[Stream], ros_version: int) -> Iterator[tuple[int, int, int, bytes]]:
    """Yield (receive time, stream index, stamp, bytes) of all messages as a recorder gets them."""
    receive = np.concatenate([stream.receive_ns for stream in streams])
    stamps = np.concatenate([stream.stamp_ns for stream in streams])
    index = np.repeat(np.arange(len(streams)), [len(stream.stamp_ns) for stream in streams])
    order = np.lexsort((index, receive))
    messages = [serialised(stream, ros_version) for stream in streams]
    for when, which, stamp in zip(receive[order].tolist(), index[order].tolist(), stamps[order].tolist(), strict=True):
        yield when, which, stamp, next(messages[which])


def _node(topic: str) -> str:
    """Return the node that a topic comes from: the controller gives the thrusters their commands."""
    return "/control" if topic.endswith("/command") else f"/{topic.split('/')[1]}"


def _offered(topic: str) -> Qos:
    """Return a topic's quality of service as a recorder learns it from the publisher, who does not tell history and depth."""
    reliability = QosReliability.BEST_EFFORT if topic.startswith(BULKY) else QosReliability.RELIABLE
    return Qos(
        history=QosHistory.UNKNOWN,
        depth=0,
        reliability=reliability,
        durability=QosDurability.VOLATILE,
        deadline=_FOREVER,
        lifespan=_FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_FOREVER,
        avoid_ros_namespace_conventions=False,
    )


def _signed(metadata: str) -> str:
    return metadata.replace("ros_distro: rosbags", f"ros_distro: {DISTRO}")


class _Sqlite3(Sqlite3Storage):
    SQLITE_SCHEMA = Sqlite3Storage.SQLITE_SCHEMA.replace("'rosbags'", f"'{DISTRO}'")

    def close(self, version: int, metadata: str) -> None:
        super().close(version, _signed(metadata))


class _Mcap(McapStorage):
    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        # The header anew, after the magic bytes: profile ros2, and no name of a library.
        fields = struct.pack("<I4sI", 4, b"ros2", 0)
        self.bio.seek(8)
        self.bio.truncate()
        self.bio.write(struct.pack("<BQ", 1, len(fields)) + fields)

    def close(self, version: int, metadata: str) -> None:
        super().close(version, _signed(metadata))


class _Writer(Ros2Writer):
    STORAGE_PLUGINS = {StoragePlugin.SQLITE3: _Sqlite3, StoragePlugin.MCAP: _Mcap}  # noqa: RUF012
