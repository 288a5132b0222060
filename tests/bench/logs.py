"""Logs to measure on: Odometry and Imu at 100 Hz, thruster state at 20 Hz, wind at 10 Hz, with cameras if asked.

They are made with the writers of rosbags and mcap, never with ours, and reused while their folder is kept.
"""

from __future__ import annotations

import os
import shutil
import struct
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

START_NS = 1_700_000_000_000_000_000
CAMERA_SHAPE = (720, 1280, 3)

CUSTOM = {
    "ferry_msgs/msg/ThrusterState": "std_msgs/Header header\nfloat64 speed\nfloat64 azimuth\n",
    "ferry_msgs/msg/Wind": "std_msgs/Header header\nfloat32 speed\nfloat32 direction\n",
}
ODOMETRY = "nav_msgs/msg/Odometry"
TOPICS = {
    "/navigation/odometry": (ODOMETRY, 100.0, "odom"),
    "/imu/data": ("sensor_msgs/msg/Imu", 100.0, "imu_link"),
    "/thruster1/state": ("ferry_msgs/msg/ThrusterState", 20.0, "thruster1"),
    "/weather/wind": ("ferry_msgs/msg/Wind", 10.0, "mast"),
}
CAMERA = "/camera/image"
CAMERA_HZ = 2.0


@dataclass(frozen=True)
class Messages:
    """All messages of one topic: equal sizes, end to end in `data`."""

    topic: str
    msgtype: str
    time_ns: NDArray[np.int64]
    data: bytes
    size: int

    def __getitem__(self, index: int) -> bytes:
        return self.data[index * self.size : (index + 1) * self.size]


def typestore(ros1: bool) -> Typestore:
    """Bundled types of rosbags plus the two custom ones."""
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for name, text in CUSTOM.items():
        store.register(get_types_from_msg(text, name))
    return store


def signals(topic: str, time_s: NDArray[np.float64], rng: np.random.Generator) -> dict[str, Any]:
    """Values of the fields that change: a boat turning wide circles, with sensor noise."""

    def noisy(values: Any, std: float) -> NDArray[np.float64]:
        return np.asarray(values + std * rng.standard_normal(time_s.size))

    yaw = 0.02 * time_s
    wave = np.sin(0.6 * time_s)
    match topic:
        case "/navigation/odometry":
            return {
                "pose.pose.position.x": noisy(50 * np.sin(yaw), 0.01),
                "pose.pose.position.y": noisy(50 * np.cos(yaw), 0.01),
                "pose.pose.orientation.z": noisy(np.sin(yaw / 2), 1e-4),
                "pose.pose.orientation.w": noisy(np.cos(yaw / 2), 1e-4),
                "twist.twist.linear.x": noisy(1 + 0.1 * wave, 0.01),
                "twist.twist.linear.y": noisy(0.05 * wave, 0.01),
                "twist.twist.angular.z": noisy(0.02 + 0.001 * wave, 1e-3),
            }
        case "/imu/data":
            return {
                "orientation.x": noisy(0.02 * wave, 1e-4),
                "orientation.y": noisy(0.01 * wave, 1e-4),
                "orientation.z": noisy(np.sin(yaw / 2), 1e-4),
                "orientation.w": noisy(np.cos(yaw / 2), 1e-4),
                "angular_velocity.x": noisy(0.01 * wave, 1e-3),
                "angular_velocity.y": noisy(0.01 * wave, 1e-3),
                "angular_velocity.z": noisy(0.02 + 0 * wave, 1e-3),
                "linear_acceleration.x": noisy(0.1 * wave, 0.02),
                "linear_acceleration.y": noisy(0.1 * wave, 0.02),
                "linear_acceleration.z": noisy(9.81 + 0.1 * wave, 0.02),
            }
        case "/thruster1/state":
            return {"speed": noisy(600 + 100 * wave, 2.0), "azimuth": noisy(0.3 * wave, 0.01)}
        case _:
            return {"speed": noisy(5 + wave, 0.3), "direction": noisy(1 + 0.2 * wave, 0.05)}


def plain(store: Typestore, msgtype: str) -> Any:
    """Return a message with zeros in every field."""
    arguments: dict[str, Any] = {}
    for name, (kind, what) in store.get_msgdef(msgtype).fields:
        if kind.name == "NAME":
            arguments[name] = plain(store, str(what))
        elif kind.name == "BASE":
            arguments[name] = {"string": "", "bool": False}.get(what[0], 0)
        elif kind.name == "ARRAY":
            arguments[name] = np.zeros(what[1], what[0][1][0])
        else:
            arguments[name] = np.zeros(0, np.uint8)
    return store.types[msgtype](**arguments)


def messages(topic: str, minutes: float, ros1: bool) -> Messages:
    """Serialise every message of one topic: one by rosbags, the others by patching its bytes.

    Each changing value is first a number found nowhere else in the message, which gives its place.
    """
    msgtype, rate_hz, frame = TOPICS[topic]
    store = typestore(ros1)
    rng = np.random.default_rng(len(topic))
    n = round(minutes * 60 * rate_hz)
    stamp_ns = START_NS + (np.arange(n) * (1e9 / rate_hz)).astype(np.int64)
    receive_ns = stamp_ns + 2_000_000 + rng.exponential(300_000.0, n).astype(np.int64)

    sample = plain(store, msgtype)
    sample.header.frame_id = frame
    if msgtype == ODOMETRY:
        sample.child_frame_id = "base_link"
        sample.pose.covariance[:] = (np.eye(6) * 1e-4).ravel()
        sample.twist.covariance[:] = (np.eye(6) * 1e-3).ravel()
    sample.header.stamp.sec, sample.header.stamp.nanosec = 0x7A7B7C7D, 0x6A6B6C6D
    values = signals(topic, (stamp_ns - START_NS) * 1e-9, rng)
    code = "<f" if topic == "/weather/wind" else "<d"
    marks = {path: struct.pack(code, -12345.5 - 64 * i) for i, path in enumerate(values)}
    for path, mark in marks.items():
        *parents, leaf = path.split(".")
        owner = sample
        for parent in parents:
            owner = getattr(owner, parent)
        setattr(owner, leaf, struct.unpack(code, mark)[0])
    serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
    template = bytes(serialize(sample, msgtype))

    rows = np.tile(np.frombuffer(template, np.uint8), (n, 1))

    def patch(mark: bytes, column: NDArray[Any]) -> None:
        if template.count(mark) != 1:
            raise ValueError(f"mark is not unique in {msgtype}")
        at = template.index(mark)
        rows[:, at : at + len(mark)] = column.view(np.uint8).reshape(n, -1)

    patch(struct.pack("<I", 0x7A7B7C7D), (stamp_ns // 10**9).astype("<u4"))
    patch(struct.pack("<I", 0x6A6B6C6D), (stamp_ns % 10**9).astype("<u4"))
    for path, column in values.items():
        patch(marks[path], column.astype(code))
    return Messages(topic, msgtype, receive_ns, rows.tobytes(), len(template))


def pictures(minutes: float, ros1: bool) -> Messages:
    """Raw camera frames: smooth shades with sensor noise, so that they compress about as well as real ones."""
    store = typestore(ros1)
    rng = np.random.default_rng(7)
    height, width, depth = CAMERA_SHAPE
    shades = np.linspace(0, 200, width)[None, :, None] + np.linspace(0, 40, height)[:, None, None]
    frame = (shades + rng.integers(0, 4, CAMERA_SHAPE)).astype(np.uint8)
    sample = plain(store, "sensor_msgs/msg/Image")
    sample.header.frame_id, sample.encoding = "camera", "rgb8"
    sample.height, sample.width, sample.step = height, width, width * depth
    n = round(minutes * 60 * CAMERA_HZ)
    serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
    sample.data = frame.ravel()
    # The picture is the last field: one frame is serialised, and others differ by their bytes alone.
    head = bytes(serialize(sample, "sensor_msgs/msg/Image"))[: -frame.size]
    data, turns = frame.tobytes(), (17 * i % frame.size for i in range(n))
    frames = [b"".join((head, data[frame.size - turn :], data[: frame.size - turn])) for turn in turns]
    time_ns = START_NS + (np.arange(n) * (1e9 / CAMERA_HZ)).astype(np.int64)
    return Messages(CAMERA, "sensor_msgs/msg/Image", time_ns, b"".join(frames), len(frames[0]))


def merged(streams: list[Messages]) -> Iterator[tuple[int, int, bytes]]:
    """All messages of all topics in order of receive time: (stream number, time, data)."""
    which = np.concatenate([np.full(s.time_ns.size, i) for i, s in enumerate(streams)])
    index = np.concatenate([np.arange(s.time_ns.size) for s in streams])
    time_ns = np.concatenate([s.time_ns for s in streams])
    order = np.argsort(time_ns, kind="stable")
    for stream, row, time in zip(which[order].tolist(), index[order].tolist(), time_ns[order].tolist(), strict=True):
        yield stream, time, streams[stream][row]


def write_mcap(path: Path, streams: list[Messages], compression: str) -> None:
    """MCAP with the official Python writer at its own defaults (1 MiB chunks, checksums)."""
    from mcap.writer import CompressionType, Writer

    store = typestore(ros1=False)
    with path.open("wb") as out:
        writer = Writer(out, compression=CompressionType[compression.upper()])
        writer.start(profile="ros2", library="bench")
        channels = []
        for stream in streams:
            text, _ = store.generate_msgdef(stream.msgtype, ros_version=2)
            schema = writer.register_schema(stream.msgtype, "ros2msg", text.encode())
            channels.append(writer.register_channel(stream.topic, "cdr", schema))
        for which, time, data in merged(streams):
            writer.add_message(channels[which], time, data, time)
        writer.finish()


def write_bag(path: Path, streams: list[Messages], compression: str) -> None:
    """ROS1 bag with the writer of rosbags."""
    from rosbags.rosbag1 import Writer

    store = typestore(ros1=True)
    writer = Writer(path)
    if compression != "none":
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    with writer:
        connections = [writer.add_connection(s.topic, s.msgtype, typestore=store) for s in streams]
        for which, time, data in merged(streams):
            writer.write(connections[which], time, data)


def write_db3(path: Path, streams: list[Messages], compression: str) -> None:
    """ROS2 folder with sqlite3 storage, with the writer of rosbags."""
    from rosbags.rosbag2 import Writer

    if compression != "none":
        raise ValueError("the db3 log is measured uncompressed")
    store = typestore(ros1=False)
    with Writer(path, version=9) as writer:
        connections = [writer.add_connection(s.topic, s.msgtype, typestore=store) for s in streams]
        for which, time, data in merged(streams):
            writer.write(connections[which], time, data)


WRITERS = {"mcap": write_mcap, "bag": write_bag, "db3": write_db3}


def make(folder: Path, wanted: Iterable[tuple[str, str, float, bool]]) -> None:
    """Make those of the logs that the folder does not hold, each as the arguments of `log`, on all cores: nothing is timed."""
    missing = [one for one in dict.fromkeys(wanted) if not _place(folder, *one).exists()]
    # The longest take most, and come first.
    missing.sort(key=lambda one: one[2], reverse=True)
    if missing:
        with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as workers:
            list(workers.map(log, [folder] * len(missing), *zip(*missing, strict=True)))


def _place(folder: Path, kind: str, compression: str, minutes: float, camera: bool) -> Path:
    ending = "" if kind == "db3" else f".{kind}"
    return folder / f"{'camera' if camera else 'plain'}_{minutes:g}min_{kind}_{compression}{ending}"


def log(folder: Path, kind: str, compression: str, minutes: float, camera: bool = False) -> Path:
    """Return the log asked for, made first if the folder does not hold it yet.

    Parameters
    ----------
    folder
        Where logs are kept.
    kind
        ``"mcap"``, ``"bag"`` or ``"db3"``.
    compression
        ``"zstd"``, ``"lz4"`` or ``"none"``.
    minutes
        Length [min].
    camera
        Add raw 1280 x 720 frames at 2 Hz: 0.33 GB a minute.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = _place(folder, kind, compression, minutes, camera)
    if path.exists():
        return path
    streams = [messages(topic, minutes, ros1=kind == "bag") for topic in TOPICS]
    if camera:
        streams.append(pictures(minutes, ros1=kind == "bag"))
    draft = path.with_name("draft_" + path.name)
    if draft.is_dir():
        shutil.rmtree(draft)
    draft.unlink(missing_ok=True)
    WRITERS[kind](draft, streams, compression)
    if draft.is_dir():
        # rosbags names the storage after its folder.
        metadata = draft / "metadata.yaml"
        metadata.write_text(metadata.read_text().replace(draft.name, path.name))
        (draft / f"{draft.name}.db3").rename(draft / f"{path.name}.db3")
    draft.rename(path)
    return path
