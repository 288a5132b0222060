"""The three formats of a log, laid out as an ordinary recorder leaves them: nothing in one names the program that made it."""

from __future__ import annotations

import json
import sqlite3
import struct
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.rosbag2.enums import CompressionFormat
from rosbags.rosbag2.storage_mcap import McapWriter as McapStorage
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer as Sqlite3Storage

from ferryid.errors import FerryIdError
from ferryid.ingest.log import Series
from ferryid.ingest.row_columns import path_steps
from ferryid.simulate.mcap_file import McapFile
from ferryid.simulate.messages import definition, serialised, typestore
from ferryid.simulate.sensors import Stream

DISTRO = "jazzy"
"""The ROS 2 release whose recorder lays out metadata of version 9."""
BULKY = ("/imu/", "/camera/")
"""Topics that are offered as best effort, as drivers of fast sensors do."""
_FOREVER = QosTime(9223372036, 854775807)


def write_mcap(streams: list[Stream], path: Path, chunk_bytes: int) -> None:
    """Write one MCAP file of CDR messages."""
    with path.open("wb") as file:
        writer = McapFile(file, profile="ros2", chunk_bytes=chunk_bytes)
        schemas: dict[str, int] = {}
        channels = []
        for stream in streams:
            if stream.type not in schemas:
                text = definition(stream.type, 2)[0]
                schemas[stream.type] = writer.register_schema(stream.type, "ros2msg", text.encode())
            channels.append(writer.register_channel(stream.topic, "cdr", schemas[stream.type]))
        counts = [0] * len(streams)
        for when, index, stamp, data in _in_order(streams, 2):
            writer.add_message(channels[index], when, data, stamp_ns=stamp, sequence=counts[index])
            counts[index] += 1
        writer.finish()


def write_json_mcap(every: Sequence[Series], path: Path) -> None:
    """Write series of fields as one MCAP file of JSON messages, whose paths, times and stamps are those of the series."""
    with path.open("wb") as file:
        writer = McapFile(file)
        schema = writer.register_schema("fields", "jsonschema", b'{"type": "object"}')
        channels = [writer.register_channel(one.topic, "json", schema) for one in every]
        receive = np.concatenate([one.receive_ns for one in every])
        index = np.repeat(np.arange(len(every)), [len(one.receive_ns) for one in every])
        messages = [_json_messages(one) for one in every]
        for place in np.argsort(receive, kind="stable").tolist():
            which, when = int(index[place]), int(receive[place])
            writer.add_message(channels[which], when, next(messages[which]), stamp_ns=when)
        writer.finish()


def _json_messages(series: Series) -> Iterator[bytes]:
    """Yield the messages of a series in the order in which a recorder gets them, what is not finite as null."""
    paths = [(path, path_steps(path) or ()) for path in series.columns]
    columns = {path: np.asarray(values).tolist() for path, values in series.columns.items()}
    for row in np.argsort(series.receive_ns, kind="stable").tolist():
        message: dict[str, Any] = {}
        if series.stamp_ns is not None:
            seconds, rest = divmod(int(series.stamp_ns[row]), 1_000_000_000)
            message["header"] = {"stamp": {"sec": seconds, "nanosec": rest}}
        for path, steps in paths:
            value = columns[path][row]
            _put(message, steps, None if isinstance(value, float) and not isfinite(value) else value)
        yield json.dumps(message).encode()


def _put(message: Any, steps: Sequence[str | int], value: Any) -> None:
    """Put a value where a path leads, with whatever is needed around it."""
    for step, inner in zip(steps, (*steps[1:], None), strict=True):
        fresh: Any = value if inner is None else [] if isinstance(inner, int) else {}
        if isinstance(step, int):
            message += [None] * (step + 1 - len(message))
            if inner is None or message[step] is None:
                message[step] = fresh
        elif inner is None or step not in message:
            message[step] = fresh
        message = message[step]


def write_ros1(streams: list[Stream], path: Path, chunk_bytes: int) -> None:
    """Write one ROS1 bag."""
    writer = Ros1Writer(path)
    writer.chunk_threshold = chunk_bytes
    writer.set_compression(Ros1Writer.CompressionFormat.LZ4)
    with writer:
        connections = []
        for stream in streams:
            text, md5sum = definition(stream.type, 1)
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
    store = typestore(2)
    try:
        with writer:
            connections = [
                writer.add_connection(
                    stream.topic,
                    stream.type,
                    msgdef=definition(stream.type, 2)[0],
                    rihs01=store.hash_rihs01(stream.type),
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
