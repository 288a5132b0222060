"""How one would read these logs without ferryid: rosbags into pandas and Parquet, rerun-sdk into NumPy.

Nothing heavy is imported before it is needed: `main` also runs in a process of its own, start-up included.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from operator import attrgetter
from pathlib import Path
from typing import Any

FIELDS = {
    "/navigation/odometry": (
        "pose.pose.position.x",
        "pose.pose.position.y",
        "twist.twist.linear.x",
        "twist.twist.linear.y",
        "twist.twist.angular.z",
    ),
    "/imu/data": ("orientation.x", "orientation.y", "orientation.z", "orientation.w"),
    "/thruster1/state": ("speed", "azimuth"),
    "/weather/wind": ("speed", "direction"),
}
STAMP = ("header.stamp.sec", "header.stamp.nanosec")


def rosbags_to_parquet(log: Path, out: Path) -> None:
    """Deserialise the wanted topics with rosbags and write one Parquet file of each with pandas."""
    import pandas as pd
    from rosbags.highlevel import AnyReader

    rows: dict[str, list[tuple[Any, ...]]] = {topic: [] for topic in FIELDS}
    add = {topic: found.append for topic, found in rows.items()}
    pick = {topic: attrgetter(*STAMP, *fields) for topic, fields in FIELDS.items()}
    with AnyReader([log]) as reader:
        connections = [connection for connection in reader.connections if connection.topic in FIELDS]
        for connection, time, raw in reader.messages(connections=connections):
            message = reader.deserialize(raw, connection.msgtype)
            add[connection.topic]((time, *pick[connection.topic](message)))
    for number, (topic, found) in enumerate(rows.items()):
        table = pd.DataFrame(found, columns=["time_ns", "sec", "nanosec", *FIELDS[topic]])
        table.to_parquet(out / f"{number}.parquet")


def small_mcap_to_parquet(log: Path, out: Path, every: bool = False) -> None:
    """Decode with small-mcap and mcap-ros2-support-fast, and write the wanted fields with pandas.

    With `every`, messages of all topics are decoded, and the same fields are kept.
    """
    import pandas as pd
    from mcap_ros2_support_fast.decoder import DecoderFactory
    from small_mcap import read_message_decoded

    rows: dict[str, list[tuple[Any, ...]]] = {topic: [] for topic in FIELDS}
    pick = {topic: attrgetter(*STAMP, *fields) for topic, fields in FIELDS.items()}

    def wanted(channel: Any, _schema: Any) -> bool:
        return every or channel.topic in FIELDS

    with log.open("rb") as file:
        for found in read_message_decoded(file, should_include=wanted, decoder_factories=[DecoderFactory()]):
            topic = found.channel.topic
            message = found.decoded_message
            if topic in FIELDS:
                rows[topic].append((found.message.log_time, *pick[topic](message)))
    for number, (topic, kept) in enumerate(rows.items()):
        table = pd.DataFrame(kept, columns=["time_ns", "sec", "nanosec", *FIELDS[topic]])
        table.to_parquet(out / f"{number}.parquet")


def rerun_columns(log: Path) -> dict[str, dict[str, Any]]:
    """Read the wanted fields of an MCAP file to NumPy arrays with rerun-sdk's Rust reader."""
    import numpy as np
    from rerun.chunk import McapReader

    topics = [f"^{topic}$" for topic in FIELDS]
    reader = McapReader(log, decoders=["ros2_reflection"], include_topic_regex=topics)
    parts: dict[str, dict[str, list[Any]]] = {topic: {} for topic in FIELDS}
    for chunk in reader.stream().to_chunks():
        if chunk.entity_path not in FIELDS or chunk.is_static:
            continue
        batch = chunk.to_record_batch()
        found = parts[chunk.entity_path]
        found.setdefault("time_ns", []).append(batch.column("message_log_time").to_numpy(zero_copy_only=False))
        (name,) = (name for name in batch.schema.names if name.endswith(":message"))
        messages = batch.column(name).flatten()
        for path in (*STAMP, *FIELDS[chunk.entity_path]):
            column = messages
            for step in path.split("."):
                column = column.field(step)
            found.setdefault(path, []).append(column.to_numpy(zero_copy_only=False))
    return {
        topic: {path: np.concatenate(pieces) for path, pieces in columns.items()} for topic, columns in parts.items()
    }


def main(convert: Callable[[Path, Path], None] = rosbags_to_parquet) -> None:
    """Convert the log named first on the command line into the folder named second."""
    convert(Path(sys.argv[1]), Path(sys.argv[2]))


def main_small_mcap() -> None:
    """`main` with small-mcap, the mapped topics alone."""
    main(small_mcap_to_parquet)


def main_small_mcap_all() -> None:
    """`main` with small-mcap, messages of all topics decoded."""
    main(lambda log, out: small_mcap_to_parquet(log, out, every=True))
