"""Message types of ROS 2 that simulated logs are made of: those of all its packages load longer than a log is simulated."""

from __future__ import annotations

from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

USUAL = {
    "geometry_msgs/msg/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/msg/Pose": "geometry_msgs/msg/Point position, geometry_msgs/msg/Quaternion orientation",
    "geometry_msgs/msg/PoseStamped": "std_msgs/msg/Header header, geometry_msgs/msg/Pose pose",
    "geometry_msgs/msg/PoseWithCovariance": "geometry_msgs/msg/Pose pose, float64[36] covariance",
    "geometry_msgs/msg/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/msg/Twist": "geometry_msgs/msg/Vector3 linear, geometry_msgs/msg/Vector3 angular",
    "geometry_msgs/msg/TwistWithCovariance": "geometry_msgs/msg/Twist twist, float64[36] covariance",
    "geometry_msgs/msg/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/msg/Wrench": "geometry_msgs/msg/Vector3 force, geometry_msgs/msg/Vector3 torque",
    "geometry_msgs/msg/WrenchStamped": "std_msgs/msg/Header header, geometry_msgs/msg/Wrench wrench",
    "nav_msgs/msg/Odometry": (
        "std_msgs/msg/Header header, "
        "string child_frame_id, "
        "geometry_msgs/msg/PoseWithCovariance pose, "
        "geometry_msgs/msg/TwistWithCovariance twist"
    ),
    "sensor_msgs/msg/CompressedImage": "std_msgs/msg/Header header, string format, uint8[] data",
    "sensor_msgs/msg/Imu": (
        "std_msgs/msg/Header header, "
        "geometry_msgs/msg/Quaternion orientation, "
        "float64[9] orientation_covariance, "
        "geometry_msgs/msg/Vector3 angular_velocity, "
        "float64[9] angular_velocity_covariance, "
        "geometry_msgs/msg/Vector3 linear_acceleration, "
        "float64[9] linear_acceleration_covariance"
    ),
    "std_msgs/msg/Header": "builtin_interfaces/msg/Time stamp, string frame_id",
}
"""Fields of message types, each as its type and name, as ROS 2 Jazzy has them."""


def usual_typestore() -> Typestore:
    """Return a store of these types alone."""
    store = get_typestore(Stores.EMPTY)
    store.register({name: ([], [_field(one) for one in text.split(", ")]) for name, text in USUAL.items()})
    return store


def _field(text: str) -> tuple[str, Any]:
    kind, name = text.split()
    base, array, length = kind.partition("[")
    described: Any = (Nodetype.NAME, base) if "/" in base else (Nodetype.BASE, (base, 0))
    if array:
        size = int(length.removesuffix("]") or 0)
        described = (Nodetype.ARRAY if size else Nodetype.SEQUENCE, (described, size))
    return name, described
