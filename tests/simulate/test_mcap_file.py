"""MCAP files are byte for byte those of the package mcap."""

from __future__ import annotations

import io
from collections.abc import Callable
from random import Random
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from ferryid.simulate.mcap_file import BytesSource, McapFile, Source, TableSource


def filled(file: Any, publish: str, messages: int) -> None:
    """Write schemas, channels, some of which stay empty, and messages whose times are in no order."""
    chance = Random(5)
    file.add_metadata("about", {"vessel": "ferry", "größe": "5 m"})
    schemas = [file.register_schema(name, "ros2msg", name.encode() * 20) for name in ("pkg/msg/A", "pkg/msg/Größe")]
    channels = [file.register_channel(f"/topic{k}", "cdr", schemas[k % 2]) for k in range(4)]
    for number in range(messages):
        when = 1_600_000_000_000_000_000 + chance.randrange(10**9)
        data = chance.randbytes(chance.choice((0, 8, 300)))
        file.add_message(
            channels[chance.choice((0, 2, 3))], when, data, sequence=number, **{publish: when - chance.randrange(9)}
        )
    file.finish()


def theirs(target: io.BytesIO, chunk_bytes: int) -> Writer:
    writer = Writer(target, chunk_size=chunk_bytes, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library="")
    return writer


def written(make: Callable[[io.BytesIO], Any], publish: str, messages: int) -> bytes:
    target = io.BytesIO()
    filled(make(target), publish, messages)
    return target.getvalue()


@pytest.mark.parametrize("messages", [0, 1, 400])
@pytest.mark.parametrize("chunk_bytes", [1, 5000, 1 << 20])
def test_the_bytes_are_those_of_the_package(messages: int, chunk_bytes: int) -> None:
    ours = written(lambda target: McapFile(target, profile="ros2", chunk_bytes=chunk_bytes), "stamp_ns", messages)
    assert ours == written(lambda target: theirs(target, chunk_bytes), "publish_time", messages)
    summary = make_reader(io.BytesIO(ours), validate_crcs=True).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == messages


@pytest.mark.parametrize("chunk_bytes", [1, 5000, 1 << 20])
def test_messages_added_at_once_are_those_added_one_by_one(chunk_bytes: int) -> None:
    random = np.random.default_rng(3)
    counts, kind = (300, 1, 0, 40), np.dtype("V24")
    receive = [np.sort(1_600_000_000_000_000_000 + random.integers(0, 10**6, count)) for count in counts]
    stamp = [one - random.integers(0, 9, len(one)) for one in receive]
    tables = [np.frombuffer(random.bytes(24 * count), kind) for count in counts[:3]]
    blobs = [random.bytes(int(size)) for size in random.integers(0, 900, counts[3])]

    def begun(target: io.BytesIO) -> McapFile:
        file = McapFile(target, chunk_bytes=chunk_bytes)
        schema = file.register_schema("pkg/msg/A", "ros2msg", b"float64 x")
        for number in range(4):
            file.register_channel(f"/topic{number}", "cdr", schema)
        return file

    at_once, by_one = io.BytesIO(), io.BytesIO()
    file = begun(at_once)
    sources: list[Source] = [
        TableSource(k + 1, receive[k], stamp[k], 24, lambda start, stop, k=k: tables[k][start:stop])  # type: ignore[misc]
        for k in range(3)
    ]
    sizes = np.array([len(one) for one in blobs])
    file.add_messages([*sources, BytesSource(4, receive[3], stamp[3], sizes, iter(blobs))])
    file.finish()
    file = begun(by_one)
    every = [(when, k, row) for k in range(4) for row, when in enumerate(receive[k].tolist())]
    for when, k, row in sorted(every):
        data = blobs[row] if k == 3 else tables[k][row].tobytes()
        file.add_message(k + 1, when, data, stamp_ns=int(stamp[k][row]), sequence=row)
    file.finish()
    assert at_once.getvalue() == by_one.getvalue()
