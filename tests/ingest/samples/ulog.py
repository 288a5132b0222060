"""A ULog whose messages have the fields of the ROS messages as messages in messages."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from tests.ingest.autopilot_logs import ulog_definition, ulog_header, ulog_message

# The file ends with its last message.
CUT_SHOWS = False


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    content = ulog_header() + ulog_definition("point:double x;double y;double z")
    content += ulog_definition("position:uint64_t timestamp;uint64_t timestamp_sample;point point")
    content += ulog_definition("speed:uint64_t timestamp;double data")
    content += ulog_message("A", struct.pack("<BH", 0, 0) + b"position")
    content += ulog_message("A", struct.pack("<BH", 0, 1) + b"speed")
    for one in messages:
        number = 0 if one.topic == "/position" else 1
        times = [one.receive_ns // 1000] + ([] if one.stamp_ns is None else [one.stamp_ns // 1000])
        data = struct.pack(f"<H{len(times)}Q{len(one.values)}d", number, *times, *one.values.values())
        content += ulog_message("D", data)
    (folder / "log.ulg").write_bytes(content)
    return folder / "log.ulg"
