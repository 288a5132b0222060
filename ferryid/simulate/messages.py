"""Messages of a simulated log, as the ordinary ROS1 and ROS2 serialisers write them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ferryid.simulate.sensors import Stream
from ferryid.simulate.usual_messages import USUAL, usual_typestore

CUSTOM = {
    "ferry_msgs/msg/ThrusterState": (
        "std_msgs/Header header\n"
        "float64 speed    # rpm\n"
        "float64 azimuth  # rad, where the thrust points, relative to the bow, positive to starboard\n"
    ),
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
BLOCK = 4096
"""Messages that are made at once."""


@cache
def typestore(ros_version: int) -> Typestore:
    """Return the message types of ROS1 Noetic or ROS2 Jazzy together with the ferry's own."""
    store = get_typestore(Stores.ROS1_NOETIC if ros_version == 1 else Stores.ROS2_JAZZY)
    for name, text in CUSTOM.items():
        store.register(get_types_from_msg(text, name))
    return store


@cache
def _store_of(name: str, ros_version: int, text: str = "") -> Typestore:
    """Return message types that one is among: the few usual ones, if they will do, with one that `text` defines."""
    if text:
        store = usual_typestore() if ros_version == 2 else get_typestore(Stores.ROS1_NOETIC)
        store.register(get_types_from_msg(text, name))
        return store
    if ros_version == 2 and (name in USUAL or name in CUSTOM):
        return _few()
    return typestore(ros_version)


@cache
def _few() -> Typestore:
    store = usual_typestore()
    for name, text in CUSTOM.items():
        store.register(get_types_from_msg(text, name))
    return store


@cache
def definition(name: str, ros_version: int, own: str = "") -> tuple[str, str]:
    """Return a type's definition with those of all types in it, and its hash; the ferry's own with their comments.

    `own` is the definition of a type that is made for a vessel's own topics.
    """
    text, digest = _store_of(name, ros_version, own).generate_msgdef(name, ros_version=ros_version)
    if name in CUSTOM:
        _, line, others = text.partition("=" * 80)
        text = CUSTOM[name] + line + others
    return text, digest


def type_hash(stream: Stream) -> str:
    """Return the hash of a stream's type in ROS 2."""
    store = _store_of(stream.type, 2, stream.definition) if stream.definition else typestore(2)
    return store.hash_rihs01(stream.type)


class MessageTable:
    """The messages of a stream without blobs, as rows of bytes.

    The serialiser writes one message. All others have the same layout, and differ from it in the places of those fields that
    change, where whole columns are put at once.

    Attributes
    ----------
    size
        Of every message [bytes].
    """

    def __init__(self, stream: Stream, ros_version: int) -> None:
        store, message = _store_of(stream.type, ros_version, stream.definition), _message(stream, ros_version)
        self._template = _bytes(store, message, stream.type, ros_version)
        self.size = len(self._template)
        places = _places(store, stream.type, message, ros_version)
        seconds, nanoseconds = np.divmod(stream.stamp_ns, 10**9)
        self._columns = {"header.stamp.sec": seconds, "header.stamp.nanosec": nanoseconds, **stream.columns}
        if ros_version == 1:
            self._columns["header.seq"] = np.arange(len(stream.stamp_ns))
        offsets, formats = zip(*(places[path] for path in self._columns), strict=True)
        self._layout = np.dtype(
            {"names": list(self._columns), "formats": list(formats), "offsets": list(offsets), "itemsize": self.size}
        )

    def rows(self, start: int, stop: int) -> NDArray[np.void]:
        """Return some of the messages, each one element."""
        block = np.frombuffer(bytearray(self._template * (stop - start)), dtype=self._layout)
        for path, values in self._columns.items():
            block[path] = values[start:stop]
        return block.view(f"V{self.size}")


def serialised(stream: Stream, ros_version: int) -> Iterator[bytes]:
    """Yield the messages of a stream as bytes, in its order; only frames of a camera are written one by one."""
    if stream.whole:
        yield from stream.whole
    elif stream.blobs:
        yield from _one_by_one(stream, _message(stream, ros_version), ros_version)
    else:
        table = MessageTable(stream, ros_version)
        count = len(stream.stamp_ns)
        for start in range(0, count, BLOCK):
            data = table.rows(start, min(start + BLOCK, count)).tobytes()
            for place in range(0, len(data), table.size):
                yield data[place : place + table.size]


def sizes(stream: Stream, ros_version: int) -> NDArray[np.int64]:
    """Return the size of every message of a stream of blobs or whole messages [bytes]."""
    if stream.whole:
        return np.array([len(one) for one in stream.whole], dtype=np.int64)
    # The blob is the last field: what stands before it has the same length in all of them.
    first = next(_one_by_one(stream, _message(stream, ros_version), ros_version))
    return np.array([len(one) for one in stream.blobs], dtype=np.int64) + (len(first) - len(stream.blobs[0]))


def _message(stream: Stream, ros_version: int) -> Any:
    """Return a message of a stream with what all of its messages share."""
    message = _blank(_store_of(stream.type, ros_version, stream.definition), stream.type)
    _put(message, "header.frame_id", stream.frame_id)
    for path, value in stream.constants.items():
        _put(message, path, value)
    return message


def _one_by_one(stream: Stream, message: Any, ros_version: int) -> Iterator[bytes]:
    """Yield messages that hold blobs, whose lengths differ, through the serialiser."""
    stamp = message.header.stamp
    for row, (when, blob) in enumerate(zip(stream.stamp_ns.tolist(), stream.blobs, strict=True)):
        stamp.sec, stamp.nanosec = divmod(when, 10**9)
        if ros_version == 1:
            message.header.seq = row
        message.data = np.frombuffer(blob, dtype=np.uint8)
        yield _bytes(_store_of(stream.type, ros_version), message, stream.type, ros_version)


def _bytes(store: Typestore, message: Any, name: str, ros_version: int) -> bytes:
    write: Callable[..., Any] = store.serialize_ros1 if ros_version == 1 else store.serialize_cdr
    return bytes(write(message, name))


def _places(store: Typestore, name: str, message: Any, ros_version: int) -> dict[str, tuple[int, str]]:
    """Return where the numbers of a message without sequences lie: field path to offset [bytes] and type.

    ROS1 packs its fields; CDR aligns each to its own size, counted from the end of its header of 4 bytes.
    """
    aligned = ros_version == 2
    header = 4 if aligned else 0
    places: dict[str, tuple[int, str]] = {}
    end = header

    def walk(name: str, message: Any, prefix: str) -> None:
        nonlocal end
        node: Any
        for field, (node, description) in store.get_msgdef(name).fields:
            value = getattr(message, field)
            if node.name == "NAME":
                walk(str(description), value, f"{prefix}{field}.")
                continue
            form: Any = description
            base, count = (form[0], 1) if node.name == "BASE" else (form[0][1][0], form[1])
            text = base == "string"
            number = np.dtype("uint32" if text else base).newbyteorder("<")
            if aligned:
                end += (header - end) % number.itemsize
            places[prefix + field] = (end, number.str if node.name == "BASE" else f"({count},){number.str}")
            # A string is its length, its bytes and, in CDR, a zero.
            end += number.itemsize * count + (len(value.encode()) + (1 if aligned else 0) if text else 0)

    walk(name, message, "")
    return places


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
