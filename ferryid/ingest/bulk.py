"""Messages into columns: fixed layouts gathered in bulk, everything else by rosbags' ordinary decoder."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError
from rosbags.typesys.base import normalize_fieldname

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.ingest.definitions import PARSER_ERRORS
from ferryid.ingest.fixed import Fixed
from ferryid.ingest.layout import (
    LayoutError,
    Target,
    Walk,
    leaf_fields,
    stamp_path,
    targets,
    tree,
)
from ferryid.ingest.log import Column, Loss, Series
from ferryid.ingest.rosbags_reading import generate_reading
from ferryid.types import Nanoseconds

__all__ = ["Decoder", "decoder_for", "leaf_fields"]

# Rows gathered before columns are copied: few enough to stay in the cache, enough to hide the cost of a call.
SCRATCH_ROWS = 2048
SCRATCH_BYTES = 4 << 20
FIRST_ROWS = 64
# As many messages at a time are read from where they lie, without those of other calls.
DIRECT_ROWS = 256
# A larger message is decoded by rosbags only if it holds no more values than this: each becomes an object of Python.
COUNTED_BYTES = 1 << 20
MAX_VALUES = 1_000_000
# A type whose messages have more lengths or layouts than this gains nothing from bulk.
MAX_GROUPS = 512
MAX_LAYOUTS = 1024


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
    try:
        generate_reading(typestore, msgtype, "deserialize_cdr_le" if encoding == "cdr" else "deserialize_ros1")
    except PARSER_ERRORS as error:
        raise FerryIdError(
            f"{said}: the messages cannot be decoded, found an incomplete definition of {msgtype} "
            f"({type(error).__name__}: {error}). Fix: record again with complete definitions, or map another topic"
        ) from error
    wanted = targets(typestore, msgtype, paths, said)
    stamp = stamp_path(typestore, msgtype)
    times = targets(typestore, msgtype, [f"{stamp}.sec", f"{stamp}.nanosec"], said) if stamp else ()
    return BulkDecoder(encoding == "cdr", typestore, msgtype, topic, wanted, times, capacity)


class _Unpacker:
    """Takes the wanted values out of one message with rosbags' own decoder."""

    def __init__(self, cdr: bool, typestore: Any, msgtype: str, wanted: Sequence[Target]) -> None:
        self._typestore, self._cdr = typestore, cdr
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
            if len(data) > COUNTED_BYTES:
                Walk(self._typestore, data, self._cdr, {}, MAX_VALUES).count(self._msgtype)
            message = self._decode(data, self._msgtype)
        except (SerdeError, LayoutError, IndexError, OverflowError, MemoryError):
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


@dataclass
class _Group:
    """Messages of one total size, gathered and waiting to be copied; `rows` are their places in the columns."""

    size: int
    messages: NDArray[np.void]
    rows: NDArray[np.int64]
    filled: int = 0
    layouts: list[Fixed] = field(default_factory=list)

    @classmethod
    def of(cls, size: int, rows: int) -> _Group:
        """Return an empty group for up to `rows` messages, fewer when they are large."""
        rows = max(1, min(rows, SCRATCH_BYTES // size))
        return cls(size, np.empty(rows, f"V{size}"), np.empty(rows, np.int64))


class BulkDecoder:
    """Decoder of one topic of ROS1 or CDR messages.

    Messages are gathered by size into a scratch; when it is full every length field in it is compared with the known
    layouts of that size, and the wanted fields are copied to their columns. What fits no layout goes to rosbags.
    """

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
        self._targets = {target.path: target for target in (*wanted, *times)}
        self._cdr, self._typestore, self._msgtype, self._topic = cdr, typestore, msgtype, topic
        self._wanted, self._times = tuple(wanted), tuple(times)
        self._tree = tree(tuple(self._targets.values()))
        self._unpacker = _Unpacker(cdr, typestore, msgtype, tuple(self._targets.values()))
        self._capacity = max(int(capacity), 1)
        self._receive = np.empty(self._capacity, np.int64)
        self._columns = {path: np.empty(self._capacity, target.dtype) for path, target in self._targets.items()}
        self._rows = 0
        self._bad: list[int] = []
        self._groups: dict[int, _Group] = {}
        self._layouts = 0

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the messages that lie in `buffer` at `starts` with `sizes` [bytes]; the buffer is not kept.

        Parameters
        ----------
        buffer
            Anything with the buffer interface.
        starts, sizes
            Non-negative, shape (n,). A message that ends behind the buffer counts as corrupt.
        receive_ns
            Receive times [ns], shape (n,).
        """
        count = len(starts)
        if count == 0:
            return
        first = self._rows
        self._reserve(first + count)
        self._receive[first : first + count] = receive_ns
        self._rows += count
        size = int(sizes[0])
        if (sizes == size).all():
            self._gather(buffer, size, starts, np.arange(first, first + count))
            return
        order = np.argsort(sizes, kind="stable")
        for picked in np.split(order, np.flatnonzero(np.diff(sizes[order])) + 1):
            self._gather(buffer, int(sizes[picked[0]]), starts[picked], first + picked)

    def _gather(self, buffer: Any, size: int, starts: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        group = self._groups.get(size)
        if group is None:
            if size == 0 or len(self._groups) >= MAX_GROUPS:
                view = memoryview(buffer)
                for row, start in zip(rows.tolist(), starts.tolist(), strict=True):
                    self._ordinary(row, bytes(view[start : start + size]))
                return
            group = self._groups[size] = _Group.of(size, FIRST_ROWS)
        inside = memoryview(buffer).nbytes - size
        if (starts > inside).any():
            self._bad.extend(rows[starts > inside].tolist())
            rows, starts = rows[starts <= inside], starts[starts <= inside]
            if not len(starts):
                return
        if len(group.layouts) == 1 and group.layouts[0].sparse and len(starts) >= DIRECT_ROWS:
            starts, rows = self._pieces(group.layouts[0], buffer, starts, rows)
        # Every window of this size over the buffer, overlapping: indexing it copies whole messages at memory speed.
        windows = np.ndarray((inside + 1,), group.messages.dtype, buffer=buffer, strides=(1,))
        taken = 0
        while taken < len(starts):
            part = min(len(starts) - taken, len(group.rows) - group.filled)
            into = slice(group.filled, group.filled + part)
            group.messages[into] = windows[starts[taken : taken + part]]
            group.rows[into] = rows[taken : taken + part]
            group.filled += part
            taken += part
            if group.filled == len(group.rows):
                self._flush(group)
                if len(group.rows) == FIRST_ROWS:
                    larger = _Group.of(size, SCRATCH_ROWS)
                    group.messages, group.rows = larger.messages, larger.rows

    def _pieces(
        self, layout: Fixed, buffer: Any, starts: NDArray[np.int64], rows: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Copy the wanted fields alone of messages of one layout to the columns; returns the messages of another."""
        others = []
        for first in range(0, len(starts), SCRATCH_ROWS):
            here = rows[first : first + SCRATCH_ROWS]
            records = layout.gathered(buffer, starts[first : first + SCRATCH_ROWS])
            wrong = layout.mismatches(records)
            if wrong is None:
                fitting = here
                faults = layout.copy(records, self._columns, _where(here), slice(None))
            else:
                others.append(first + np.flatnonzero(wrong))
                fitting = here[~wrong]
                faults = layout.copy(records, self._columns, fitting, ~wrong)
            self._bad.extend(int(fitting[position]) for position in faults)
        left = np.concatenate(others) if others else np.empty(0, np.int64)
        return starts[left], rows[left]

    def _flush(self, group: _Group) -> None:
        """Copy everything gathered in the group to the columns."""
        messages, rows = group.messages[: group.filled], group.rows[: group.filled]
        group.filled = 0
        left = np.arange(len(rows))
        known = 0
        while len(left):
            if known < len(group.layouts):
                layout = group.layouts[known]
            else:
                fresh = self._layout_of(messages[left[0]].tobytes())
                if fresh is None:
                    self._ordinary(int(rows[left[0]]), messages[left[0]].tobytes())
                    left = left[1:]
                    continue
                layout = fresh
                group.layouts.append(layout)
            known += 1
            records = layout.records(messages)
            wrong = layout.mismatches(records)
            if wrong is None and len(left) == len(rows):
                fitting, left = left, left[:0]
                faults = layout.copy(records, self._columns, _where(rows), slice(None))
            else:
                fitting = left if wrong is None else left[~wrong[left]]
                left = left[:0] if wrong is None else left[wrong[left]]
                faults = layout.copy(records, self._columns, rows[fitting], fitting)
            self._bad.extend(int(rows[fitting[position]]) for position in faults)

    def _layout_of(self, sample: bytes) -> Fixed | None:
        """Return the layout of a sample once rosbags gives the same values from it, None for rosbags alone."""
        if self._layouts >= MAX_LAYOUTS:
            return None
        self._layouts += 1
        try:
            layout = Walk(self._typestore, sample, self._cdr, self._tree).run(self._msgtype)
        except LayoutError:
            return None
        values = self._unpacker.values(sample)
        if values is None:
            return None
        fixed = Fixed(layout, self._cdr, self._targets)
        message = np.frombuffer(sample, f"V{len(sample)}")
        ours = {path: np.empty(1, target.dtype) for path, target in self._targets.items()}
        theirs = {path: np.empty(1, target.dtype) for path, target in self._targets.items()}
        fixed.copy(fixed.records(message), ours, slice(0, 1), slice(None))
        self._fill(theirs, 0, values)
        same = all(
            np.array_equal(ours[path], theirs[path], equal_nan=target.dtype.kind == "f")
            for path, target in self._targets.items()
        )
        return fixed if same else None

    def _ordinary(self, row: int, data: bytes) -> None:
        values = self._unpacker.values(data)
        if values is None:
            self._bad.append(row)
        else:
            self._fill(self._columns, row, values)

    @staticmethod
    def _fill(columns: Mapping[str, Column], row: int, values: Mapping[str, Any]) -> None:
        for path, column in columns.items():
            column[row] = values.get(path, None if column.dtype == object else math.nan)

    def _reserve(self, rows: int) -> None:
        if rows <= self._capacity:
            return
        self._capacity = max(rows, 2 * self._capacity)
        self._receive = _grown(self._receive, self._rows, self._capacity)
        self._columns = {path: _grown(column, self._rows, self._capacity) for path, column in self._columns.items()}

    def finish(self) -> Series:
        """Return the columns of every message that could be decoded, in the order in which they were added."""
        self._flush_all()
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

    def _flush_all(self) -> None:
        for group in self._groups.values():
            if group.filled:
                self._flush(group)

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return what was corrupt among the messages added so far, said of `file`."""
        self._flush_all()
        if not self._bad:
            return ()
        times = self._receive[self._bad]
        return (
            Loss(
                file=file,
                what=f"{counted(len(self._bad), 'message')} of {self._topic} {verb(len(self._bad), 'does')} not fit the type "
                f"{self._msgtype}",
                topic=self._topic,
                messages=len(self._bad),
                start_ns=int(times.min()),
                end_ns=int(times.max()),
            ),
        )


def _where(rows: NDArray[np.int64]) -> Any:
    """Return rows of the columns as an index, as a slice where they follow one another."""
    return slice(int(rows[0]), int(rows[-1]) + 1) if rows[-1] - rows[0] == len(rows) - 1 else rows


def _grown(column: Column, rows: int, capacity: int) -> Column:
    larger = np.empty(capacity, column.dtype)
    larger[:rows] = column[:rows]
    return larger
