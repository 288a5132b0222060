"""ULog: heads of messages, definitions and subscriptions."""

from __future__ import annotations

import contextlib
import io
import struct
import tempfile
from pathlib import Path
from random import Random

import numpy as np
from pyulog import ULog

from tests.attack.case import Base, Mutated, Mutation, Rows, odd_number, replaced
from tests.attack.logs import WANTED, messages
from tests.ingest.autopilot_logs import SYNC, ulog_definition, ulog_header, ulog_message

NAME = "log.ulg"


def bases() -> list[Base]:
    """With marks to find the messages again by, and without."""
    return [_base("plain", marks=False), _base("marks and texts", marks=True)]


def _base(name: str, *, marks: bool) -> Base:
    content = ulog_header() + ulog_definition("point:double x;double y;double z")
    content += ulog_definition("position:uint64_t timestamp;uint64_t timestamp_sample;point point")
    content += ulog_definition("speed:uint64_t timestamp;double data")
    for number, topic in enumerate(("position", "speed")):
        content += ulog_message("A", struct.pack("<BH", 0, number) + topic.encode())
    for place, (topic, time, value) in enumerate(messages()):
        values = (time // 1000, time // 1000 - 5, value, -1.0, 0.0) if topic == "/position" else (time // 1000, value)
        layout = "<HQQddd" if topic == "/position" else "<HQd"
        content += ulog_message("D", struct.pack(layout, int(topic == "/speed"), *values))
        if marks and place % 20 == 0:
            content += ulog_message("S", SYNC) + ulog_message("L", b"6" + bytes(8) + b"on the way")
    return Base("ulog", name, {NAME: content}, NAME, _truth(content), WANTED)


def _truth(content: bytes) -> dict[str, Rows]:
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = Path(folder) / NAME
        path.write_bytes(content)
        found = {f"/{one.name}": one.data for one in ULog(str(path)).data_list}
    return {
        topic: Rows(found[topic]["timestamp"].astype(np.int64) * 1000, found[topic][fields[0]].astype(float))
        for topic, fields in WANTED.items()
    }


def _heads(content: bytes) -> list[int]:
    """Return where messages begin."""
    places, at = [], 16
    while at + 3 <= len(content):
        places.append(at)
        at += 3 + struct.unpack_from("<H", content, at)[0]
    return places


def head(random: Random, base: Base) -> Mutated | None:
    """Set size or kind of a message, or the number of its topic."""
    content = bytearray(base.files[NAME])
    at = random.choice(_heads(bytes(content)))
    where, size, what = random.choice(((0, 2, "size"), (2, 1, "kind"), (3, 2, "number")))
    if at + where + size > len(content):
        return None
    old = int.from_bytes(content[at + where : at + where + size], "little")
    new = odd_number(random, size, old)
    if new == old:
        return None
    content[at + where : at + where + size] = new.to_bytes(size, "little")
    # A message of one kind may be a possible one of another.
    known = what == "number" and new in (0, 1)
    return Mutated(
        f"{what} of the message at {at} set from {old} to {new}", replaced(base, NAME, bytes(content)), content=True,
        missing=1, extra=int(known), counted=False,
    )  # fmt: skip


def definition(random: Random, base: Base) -> Mutated | None:
    """Put another definition in the place of the speed's."""
    content = base.files[NAME]
    old = ulog_definition("speed:uint64_t timestamp;double data")
    text = random.choice(
        (
            "speed:speed data", "speed:", "speed:uint64_t timestamp;double[99999] data", "speed:uint64_t timestamp;double",
            "speed:uint64_t timestamp;none data", "speed:float timestamp;double data", "speed:point[9] timestamp;double data",
            "speed:uint64_t timestamp;char[8] data", "speed:uint64_t timestamp;char[0] data;double data", "x" * 60_000,
            "speed:" + "double data;" * 3000, "speed:uint64_t timestamp;double d\x1bta", "sp\xffeed:double data",
        )
    )  # fmt: skip
    made = content.replace(old, ulog_definition(text), 1)
    return Mutated(f"another definition: {text[:50]!r}", replaced(base, NAME, made), counted=False, content=True)


def again(random: Random, base: Base) -> Mutated | None:
    """Subscribe a topic again, under another number or as another instance."""
    content = base.files[NAME]
    multi, number = random.choice((0, 1, 255)), random.choice((0, 1, 2, 65535))
    name = random.choice((b"speed", b"position", b"point", b"none", b"", b"\xff\x00"))
    at = random.choice(_heads(content))
    made = content[:at] + ulog_message("A", struct.pack("<BH", multi, number) + name) + content[at:]
    return Mutated(
        f"{name!r} subscribed as {number}, instance {multi}, at {at}", replaced(base, NAME, made), counted=False
    )


def flags(random: Random, base: Base) -> Mutated | None:
    """Set flags and places of appended data."""
    made = ulog_header(incompatible=random.choice((1, 2, 3, 255)), appended=random.choice((0, 1, 500, 2**63)))
    content = made + base.files[NAME][len(made) :]
    return Mutated("other flags", replaced(base, NAME, content), counted=False)


MUTATIONS: dict[str, Mutation] = {
    "head of a message": head,
    "definition": definition,
    "subscription": again,
    "flags": flags,
}
