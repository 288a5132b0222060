"""The messages of the undamaged logs, and how other libraries write and read them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from tests.attack.case import Rows

NS = 1_000_000_000
START = 1_600_000_000 * NS
STEPS = 120
TYPES = {"/position": "geometry_msgs/msg/PointStamped", "/speed": "std_msgs/msg/Float64"}
WANTED = {"/position": ("point.x", "point.y", "point.z"), "/speed": ("data",)}
STORES = {"ros1": get_typestore(Stores.ROS1_NOETIC), "cdr": get_typestore(Stores.ROS2_HUMBLE)}


def messages() -> Iterator[tuple[str, int, float]]:
    """Topic, receive time [ns] and value, in order of time: speeds at 100 Hz, stamped positions at 50 Hz."""
    for index in range(STEPS):
        yield "/speed", START + index * NS // 100, index * 0.25
        if index % 2 == 0:
            yield "/position", START + index * NS // 100 + 1000, index * 1.5 - 7.0


def serialized(topic: str, time_ns: int, value: float, encoding: str) -> bytes:
    """Return one message in ``"ros1"`` or ``"cdr"``."""
    store = STORES[encoding]
    types = store.types
    made: Any
    if topic == "/speed":
        made = types[TYPES[topic]](value)
    else:
        stamp = types["builtin_interfaces/msg/Time"]((time_ns - 5000) // NS, (time_ns - 5000) % NS)
        sequence = (7,) if encoding == "ros1" else ()
        header = types["std_msgs/msg/Header"](*sequence, stamp, "map")
        made = types[TYPES[topic]](header, types["geometry_msgs/msg/Point"](value, -1.0 / (abs(value) + 1), 0.0))
    write = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    return bytes(write(made, TYPES[topic]))


def in_folder(write: Callable[[Path], Path]) -> tuple[dict[str, bytes], str, Path]:
    """Write a log into a temporary folder, which stays until the process ends: its files, what to open, the folder."""
    folder = Path(tempfile.mkdtemp(prefix="attack-base-", dir=_kept()))
    path = write(folder)
    files = {
        file.relative_to(folder).as_posix(): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()
    }
    return files, path.relative_to(folder).as_posix(), folder


def truth_of(path: Path, encoding: str) -> dict[str, Rows]:
    """Read a ROS 1 bag or a ROS 2 folder by rosbags."""
    store = STORES[encoding]
    with AnyReader([path], default_typestore=store) as reader:
        found = [(one.topic, time, reader.deserialize(data, one.msgtype)) for one, time, data in reader.messages()]
    return rows((topic, time, leaf(message, WANTED[topic][0])) for topic, time, message in found)


def rows(found: Iterator[tuple[str, int, float]]) -> dict[str, Rows]:
    """Sort messages by topic."""
    by_topic: dict[str, list[tuple[int, float]]] = {}
    for topic, time, value in found:
        by_topic.setdefault(topic, []).append((time, value))
    return {
        topic: Rows(np.array([time for time, _ in each], np.int64), np.array([value for _, value in each], float))
        for topic, each in by_topic.items()
    }


def leaf(message: Any, path: str) -> float:
    for part in path.split("."):
        message = message[part] if isinstance(message, Mapping) else getattr(message, part)
    return float(message)


_FOLDERS: list[Any] = []


def _kept() -> str:
    if not _FOLDERS:
        _FOLDERS.append(tempfile.TemporaryDirectory(prefix="attack-"))
    return str(_FOLDERS[0].name)
