"""Messages of a simulated log, serialised by the ordinary ROS1 and ROS2 serialisers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ferryid.simulate.sensors import Stream

CUSTOM = {
    "ferry_msgs/msg/ThrusterState": "std_msgs/Header header\nfloat64 speed    # rpm\nfloat64 azimuth  # rad\n",
    "ferry_msgs/msg/Wind": (
        "std_msgs/Header header\n"
        "float32 speed      # m/s, apparent\n"
        "float32 direction  # rad, where the wind comes from, relative to the bow, positive to starboard\n"
    ),
    "ferry_msgs/msg/Current": (
        "std_msgs/Header header\nfloat64 north    # m/s, where the water goes to, over ground\nfloat64 east     # m/s\n"
    ),
    "ferry_msgs/msg/Payload": (
        "std_msgs/Header header\n"
        "float64 mass     # kg, aboard besides the vessel itself\n"
        "float64 x        # m, its centre forward of the body origin\n"
    ),
}
"""Message types of the ferry's own package, whose definitions travel in the log."""


@cache
def typestore(ros_version: int) -> Typestore:
    """Return the message types of ROS1 Noetic or ROS2 Humble together with the ferry's own."""
    store = get_typestore(Stores.ROS1_NOETIC if ros_version == 1 else Stores.ROS2_HUMBLE)
    for name, text in CUSTOM.items():
        store.register(get_types_from_msg(text, name))
    return store


def serialised(stream: Stream, ros_version: int) -> Iterator[bytes]:
    """Yield the messages of a stream as bytes, in its order."""
    store = typestore(ros_version)
    message = _blank(store, stream.type)
    _put(message, "header.frame_id", stream.frame_id)
    for path, value in stream.constants.items():
        _put(message, path, value)
    setters = [_setter(message, path) for path in stream.columns]
    values = [column.tolist() for column in stream.columns.values()]
    write: Callable[..., Any] = store.serialize_ros1 if ros_version == 1 else store.serialize_cdr
    stamp = message.header.stamp
    for row, when in enumerate(stream.stamp_ns.tolist()):
        stamp.sec, stamp.nanosec = divmod(when, 10**9)
        if ros_version == 1:
            message.header.seq = row
        for (holder, name), column in zip(setters, values, strict=True):
            setattr(holder, name, column[row])
        if stream.blobs:
            message.data = np.frombuffer(stream.blobs[row], dtype=np.uint8)
        yield bytes(write(message, stream.type))


def _blank(store: Typestore, name: str) -> Any:
    """Return a message of zeros and empty strings."""
    made: dict[str, Any] = {}
    for field, (node, description) in store.get_msgdef(name).fields:
        made[field] = _blank_field(store, node.name, description)
    return store.types[name](**made)


def _blank_field(store: Typestore, node: str, description: Any) -> Any:
    if node == "NAME":
        return _blank(store, description)
    if node == "BASE":
        base = description[0]
        return "" if base == "string" else False if base == "bool" else 0.0 if base.startswith("float") else 0
    (_, (base, _)), length = description
    return np.zeros(length, dtype=base)


def _setter(message: Any, path: str) -> tuple[Any, str]:
    """Return the object that holds the field at `path`, and the field's own name."""
    *parents, name = path.split(".")
    for parent in parents:
        message = getattr(message, parent)
    if not hasattr(message, name):
        raise AttributeError(f"{type(message).__name__} has no field {name}")
    return message, name


def _put(message: Any, path: str, value: Any) -> None:
    holder, name = _setter(message, path)
    setattr(holder, name, value)
