"""A log as one MCAP file, laid out as an ordinary recorder leaves it: nothing in it names the program that made it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.ingest.log import Series
from ferryid.ingest.row_columns import path_steps
from ferryid.simulate.mcap_file import BytesSource, McapFile, Source, TableSource
from ferryid.simulate.messages import MessageTable, definition, serialised, sizes
from ferryid.simulate.sensors import Stream


def write_mcap(
    streams: list[Stream],
    path: Path,
    chunk_bytes: int,
    *,
    library: str = "",
    metadata: Mapping[str, Mapping[str, str]] | None = None,
) -> None:
    """Write one MCAP file of CDR messages, with the name of what wrote it and records of metadata by their names."""
    with path.open("wb") as file:
        writer = McapFile(file, profile="ros2", library=library, chunk_bytes=chunk_bytes)
        for name, values in (metadata or {}).items():
            writer.add_metadata(name, values)
        schemas: dict[str, int] = {}
        channels = []
        for stream in streams:
            if stream.type not in schemas:
                text = definition(stream.type, 2, stream.definition)[0]
                schemas[stream.type] = writer.register_schema(stream.type, "ros2msg", text.encode())
            channels.append(writer.register_channel(stream.topic, "cdr", schemas[stream.type]))
        writer.add_messages([_source(stream, channel) for stream, channel in zip(streams, channels, strict=True)])
        writer.finish()


def _source(stream: Stream, channel: int) -> Source:
    """Return the messages of a stream for a channel of an MCAP file."""
    times = stream.receive_ns, stream.stamp_ns
    if stream.whole or stream.blobs:
        return BytesSource(channel, *times, sizes(stream, 2), serialised(stream, 2))
    table = MessageTable(stream, 2)
    return TableSource(channel, *times, table.size, table.rows)


def write_json_mcap(every: Sequence[Series], path: Path) -> None:
    """Write series of fields as one MCAP file of JSON messages, whose paths, times and stamps are those of the series."""
    with path.open("wb") as file:
        writer = McapFile(file)
        schema = writer.register_schema("fields", "jsonschema", b'{"type": "object"}')
        channels = [writer.register_channel(one.topic, "json", schema) for one in every]
        receive = np.concatenate([one.receive_ns for one in every])
        index = np.repeat(np.arange(len(every)), [len(one.receive_ns) for one in every])
        messages = [_json_messages(one) for one in every]
        for place in np.argsort(receive, kind="stable").tolist():
            which, when = int(index[place]), int(receive[place])
            writer.add_message(channels[which], when, next(messages[which]), stamp_ns=when)
        writer.finish()


def _json_messages(series: Series) -> Iterator[bytes]:
    """Yield the messages of a series in the order in which a recorder gets them, what is not finite as null."""
    paths = [(path, path_steps(path) or ()) for path in series.columns]
    columns = {path: np.asarray(values).tolist() for path, values in series.columns.items()}
    for row in np.argsort(series.receive_ns, kind="stable").tolist():
        message: dict[str, Any] = {}
        if series.stamp_ns is not None:
            seconds, rest = divmod(int(series.stamp_ns[row]), 1_000_000_000)
            message["header"] = {"stamp": {"sec": seconds, "nanosec": rest}}
        for path, steps in paths:
            value = columns[path][row]
            _put(message, steps, None if isinstance(value, float) and not isfinite(value) else value)
        yield json.dumps(message).encode()


def _put(message: Any, steps: Sequence[str | int], value: Any) -> None:
    """Put a value where a path leads, with whatever is needed around it."""
    for step, inner in zip(steps, (*steps[1:], None), strict=True):
        fresh: Any = value if inner is None else [] if isinstance(inner, int) else {}
        if isinstance(step, int):
            message += [None] * (step + 1 - len(message))
            if inner is None or message[step] is None:
                message[step] = fresh
        elif inner is None or step not in message:
            message[step] = fresh
        message = message[step]
