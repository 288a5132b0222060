"""Places of messages in decompressed chunks of a ROS1 bag, from the index entries of all of them at once."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.rosbag1_records import (
    CONNECTION,
    MAX_KEPT_HEADER,
    MESSAGE,
    Entries,
    Record,
    RecordError,
    Records,
)

_U32 = struct.Struct("<I").unpack_from


class Messages:
    """Finds the data of message records in decompressed chunks; one shape of header serves them all."""

    def __init__(self) -> None:
        self._shapes: dict[int, np.dtype[np.void]] = {}

    def locate(
        self, buffer: Any, entries: Entries, connections: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_] | None]:
        """Return where the messages lie.

        Parameters
        ----------
        buffer
            A decompressed chunk.
        entries
            Times and places of the message records, shape (n,).
        connections
            Number of the connection that each must have, shape (n,).

        Returns
        -------
        tuple
            Starts and sizes [bytes], shape (n,), and which records are intact, None when all are.
        """
        places = entries[:, 2].astype(np.int64)
        limit = memoryview(buffer).nbytes
        if not len(places):
            return places, places, None
        shape = self._shape(buffer, int(places[0]), limit)
        starts, sizes = np.zeros(len(places), np.int64), np.zeros(len(places), np.int64)
        good = np.zeros(len(places), np.bool_)
        if shape is not None:
            inside = places <= limit - shape.itemsize
            windows = np.ndarray((limit - shape.itemsize + 1,), f"V{shape.itemsize}", buffer=buffer, strides=(1,))
            headers = windows[places if inside.all() else np.where(inside, places, 0)].view(shape)
            starts = places + shape.itemsize
            sizes = headers["size"].astype(np.int64)
            good = (
                inside
                & (headers["length"] == shape.itemsize - 8)
                & (headers["op"] == MESSAGE)
                & (headers["conn"] == connections)
                & (headers["sec"] == entries[:, 0])
                & (headers["nsec"] == entries[:, 1])
                & (starts + sizes <= limit)
            )
            if good.all():
                return starts, sizes, None
        records = Records(buffer)
        for row in np.flatnonzero(~good).tolist():
            found = _message_at(records, int(places[row]), entries[row], int(connections[row]), limit)
            if found is not None:
                starts[row], sizes[row] = found.start, found.end - found.start
                good[row] = True
        return starts, sizes, good

    def _shape(self, buffer: Any, place: int, limit: int) -> np.dtype[np.void] | None:
        """Return the shape of the message header at a place, None where none is."""
        try:
            known = self._shapes.get(_U32(buffer, place)[0])
            if known is not None:
                return known if known.itemsize <= limit else None
            record = Records(buffer).at(place)
            # A long header would be copied for every message.
            return self._new_shape(record) if record.start - place <= MAX_KEPT_HEADER else None
        except (RecordError, struct.error):
            return None

    def _new_shape(self, record: Record) -> np.dtype[np.void]:
        at, cursor = {}, 4
        # The fields come in the writer's order, each as its length, its name, "=" and the value.
        for name, value in record.fields.items():
            cursor += 4 + len(name) + 1
            at[name, len(value)] = cursor
            cursor += len(value)
        try:
            time = at[b"time", 8]
            places = [0, at[b"op", 1], at[b"conn", 4], time, time + 4, cursor]
        except KeyError as error:
            raise RecordError(f"no message at byte {record.position}") from error
        names, formats = ["length", "op", "conn", "sec", "nsec", "size"], ["<u4", "u1", "<u4", "<u4", "<u4", "<u4"]
        shape = np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": cursor + 4})
        self._shapes[cursor - 4] = shape
        return shape


def _message_at(records: Records, place: int, entry: Any, connection: int, limit: int) -> Record | None:
    """Return the one message record that an index entry means, None when it is damaged."""
    try:
        record = records.at(place)
        # An index entry may point at the connection record written before its first message.
        if record.op == CONNECTION:
            record = records.at(record.end)
        time = int(entry[0]) | int(entry[1]) << 32
        wanted = record.op == MESSAGE and record.number(b"conn") == connection and record.number(b"time") == time
    except RecordError:
        return None
    return record if wanted and record.end <= limit else None
