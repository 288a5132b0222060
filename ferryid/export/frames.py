"""The vessel's pose as transforms between frames, which viewers of three dimensions place everything by."""

from __future__ import annotations

from functools import cache
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.simulate.messages import typestore
from ferryid.simulate.sensors import Stream
from ferryid.types import Floats

MAP, WORLD, BODY = "map", "map_ned", "base_link_frd"
"""Frames by the names of ROS REP 103; of the last two z points down, of the first, the usual one of ROS, up."""
TYPE = "tf2_msgs/msg/TFMessage"
STAMP_PLACE = 8
"""Of the stamp in a message [bytes]: behind the head of the encapsulation and the number of transforms."""
TO_NED = (sqrt(0.5), sqrt(0.5), 0.0, 0.0)
"""Rotation from east, north, up to north, east, down as a quaternion x, y, z, w: half a turn about north-east."""


def transform_streams(times_ns: NDArray[np.int64], poses: Floats) -> list[Stream]:
    """Return the pose on ``/tf``, and on ``/tf_static`` how the frame whose z points down lies in ROS's usual one.

    Parameters
    ----------
    times_ns
        Since 1970, shape (n,).
    poses
        North, east [m], and heading [rad], shape (n, 3).
    """
    half = 0.5 * poses[:, 2]
    values = np.zeros((len(poses), 7))
    values[:, :2] = poses[:, :2]
    values[:, 5], values[:, 6] = np.sin(half), np.cos(half)
    first = times_ns[:1]
    lasting = np.array([(0.0, 0.0, 0.0, *TO_NED)])
    return [
        Stream("/tf_static", TYPE, "", first, first, {}, whole=_messages(MAP, WORLD, first, lasting)),
        Stream("/tf", TYPE, "", times_ns, times_ns, {}, whole=_messages(WORLD, BODY, times_ns, values)),
    ]


def _messages(parent: str, child: str, times_ns: NDArray[np.int64], values: Floats) -> tuple[bytes, ...]:
    """Return a message a row: all have the layout of the one that the serialiser writes, and differ in stamp and numbers."""
    template = np.frombuffer(_template(parent, child), dtype=np.uint8)
    rows = np.tile(template, (len(times_ns), 1))
    stamps = np.stack(np.divmod(times_ns, 10**9), axis=1).astype("<u4")
    rows[:, STAMP_PLACE : STAMP_PLACE + 8] = stamps.view(np.uint8)
    numbers = np.ascontiguousarray(values, dtype="<f8").view(np.uint8)
    rows[:, -numbers.shape[1] :] = numbers
    return tuple(row.tobytes() for row in rows)


@cache
def _template(parent: str, child: str) -> bytes:
    types: Any = typestore(2).types
    vector, turn = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    header = types["std_msgs/msg/Header"](stamp=types["builtin_interfaces/msg/Time"](0, 0), frame_id=parent)
    transform = types["geometry_msgs/msg/Transform"](vector(0.0, 0.0, 0.0), turn(0.0, 0.0, 0.0, 1.0))
    one = types["geometry_msgs/msg/TransformStamped"](header, child, transform)
    return bytes(typestore(2).serialize_cdr(types[TYPE]([one]), TYPE))
