"""Messages into columns: fixed layouts gathered in bulk, everything else by rosbags' ordinary decoder."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError
from rosbags.typesys.base import normalize_fieldname

from ferryid.errors import FerryIdError
from ferryid.ingest.layout import (
    Target,
    leaf_fields,
    stamp_path,
    targets,
    tree,
)
from ferryid.ingest.log import Column, Loss, Nanoseconds, Series

__all__ = ["Decoder", "decoder_for", "leaf_fields"]


class Decoder(Protocol):
    """Turns the messages of one topic into the wanted columns."""

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the messages that lie in `buffer` at `starts` with `sizes` [bytes]; the buffer is not kept."""
        ...

    def finish(self) -> Series:
        """Return the columns of every message that could be decoded, in the order in which they were added."""
        ...

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return what was corrupt among the messages added so far, said of `file`."""
        ...


def decoder_for(
    encoding: Literal["ros1", "cdr"],
    typestore: Any,
    msgtype: str,
    topic: str,
    paths: Sequence[str],
    capacity: int,
    where: str = "",
) -> Decoder:
    """Return the decoder of one topic.

    Parameters
    ----------
    encoding
        ``"ros1"`` (packed) or ``"cdr"``.
    typestore
        rosbags Typestore that holds `msgtype` and what it is made of.
    msgtype
        Normalised type name, ``"nav_msgs/msg/Odometry"``.
    topic
        Name for the Series.
    paths
        Wanted leaf fields; none decodes times and header stamps only.
    capacity
        Expected number of messages; more are taken too.
    where
        File name that an error begins with.

    Raises
    ------
    FerryIdError
        For a path that the type does not have.
    """
    said = f"{where}: {topic}" if where else topic
    if msgtype not in typestore.fielddefs:
        raise FerryIdError(
            f"{said}: the messages cannot be decoded, the log holds no definition of {msgtype}. "
            "Fix: record again with definitions, or map another topic"
        )
    wanted = targets(typestore, msgtype, paths, said)
    stamp = stamp_path(typestore, msgtype)
    times = targets(typestore, msgtype, [f"{stamp}.sec", f"{stamp}.nanosec"], said) if stamp else ()
    return BulkDecoder(encoding == "cdr", typestore, msgtype, topic, wanted, times, capacity)


class _Unpacker:
    """Takes the wanted values out of one message with rosbags' own decoder."""

    def __init__(self, cdr: bool, typestore: Any, msgtype: str, wanted: Sequence[Target]) -> None:
        self._decode = typestore.deserialize_cdr if cdr else typestore.deserialize_ros1
        self._msgtype = msgtype
        self._wanted = [
            (
                target.path,
                [(operator.attrgetter(normalize_fieldname(name)), index) for name, index in target.steps],
            )
            for target in wanted
        ]

    def values(self, data: bytes) -> dict[str, Any] | None:
        """Return path to value, without the paths that the message lacks; None for a corrupt message."""
        try:
            message = self._decode(data, self._msgtype)
        except (SerdeError, IndexError, OverflowError, MemoryError):
            return None
        found: dict[str, Any] = {}
        for path, steps in self._wanted:
            value = message
            for attribute, index in steps:
                value = attribute(value)
                if index is not None:
                    if index >= len(value):
                        break
                    value = value[index]
            else:
                found[path] = value
        return found


class BulkDecoder:
    """Decoder of one topic of ROS1 or CDR messages."""

    def __init__(
        self,
        cdr: bool,
        typestore: Any,
        msgtype: str,
        topic: str,
        wanted: Sequence[Target],
        times: Sequence[Target],
        capacity: int,
    ) -> None:
        every = {target.path: target for target in (*wanted, *times)}
        self._cdr, self._typestore, self._msgtype, self._topic = cdr, typestore, msgtype, topic
        self._wanted, self._times = tuple(wanted), tuple(times)
        self._targets = every
        self._tree = tree(tuple(every.values()))
        self._unpacker = _Unpacker(cdr, typestore, msgtype, tuple(every.values()))
        self._capacity = max(int(capacity), 1)
        self._receive = np.empty(self._capacity, np.int64)
        self._columns = {path: np.empty(self._capacity, target.dtype) for path, target in every.items()}
        self._rows = 0
        self._bad: list[int] = []

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the messages that lie in `buffer` at `starts` with `sizes` [bytes]; the buffer is not kept."""
        count = len(starts)
        first = self._rows
        self._reserve(first + count)
        self._receive[first : first + count] = receive_ns
        self._rows += count
        view = memoryview(buffer)
        for row, (start, size) in enumerate(zip(starts.tolist(), sizes.tolist(), strict=True), first):
            self._ordinary(row, bytes(view[start : start + size]))

    def _ordinary(self, row: int, data: bytes) -> None:
        values = self._unpacker.values(data)
        if values is None:
            self._bad.append(row)
            return
        for path, column in self._columns.items():
            column[row] = values.get(path, None if column.dtype == object else math.nan)

    def _reserve(self, rows: int) -> None:
        if rows <= self._capacity:
            return
        self._capacity = max(rows, 2 * self._capacity)
        self._receive = _grown(self._receive, self._rows, self._capacity)
        self._columns = {path: _grown(column, self._rows, self._capacity) for path, column in self._columns.items()}

    def finish(self) -> Series:
        """Return the columns of every message that could be decoded, in the order in which they were added."""
        keep: Any = slice(0, self._rows)
        if self._bad:
            keep = np.delete(np.arange(self._rows), self._bad)
        columns = {path: column[keep] for path, column in self._columns.items()}
        stamp = None
        if self._times:
            seconds, nanoseconds = (columns[target.path] for target in self._times)
            stamp = seconds.astype(np.int64) * 1_000_000_000 + nanoseconds
        return Series(
            topic=self._topic,
            receive_ns=self._receive[keep],
            stamp_ns=stamp,
            columns={target.path: columns[target.path] for target in self._wanted},
        )

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return what was corrupt among the messages added so far, said of `file`."""
        if not self._bad:
            return ()
        times = self._receive[self._bad]
        return (
            Loss(
                file=file,
                what=f"{len(self._bad)} messages of {self._topic} do not fit their type {self._msgtype}",
                topic=self._topic,
                messages=len(self._bad),
                start_ns=int(times.min()),
                end_ns=int(times.max()),
            ),
        )


def _grown(column: Column, rows: int, capacity: int) -> Column:
    larger = np.empty(capacity, column.dtype)
    larger[:rows] = column[:rows]
    return larger
