"""Logs of autopilots: messages of fixed layout one after another, whose places are known before any is decoded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.log import Column, Loss, Series, Topic
from ferryid.ingest.parameters import Parameter
from ferryid.types import Nanoseconds

FARTHEST_NS = 1 << 62
"""Times further from 1970 (146 years) count as unreadable: the difference of two of them would not fit into 64 bits."""
EARLIEST_UTC_S, LATEST_UTC_S = 1.0e9, 4.2e9
"""A receiver's clock that was never set shows another time than one between these (2001 and 2103)."""


@dataclass(frozen=True)
class RecordField:
    """One number or text in every message of a topic.

    `at` is its place in the message [bytes], `dtype` its little-endian NumPy type; a number is `divisor` times as large in the
    file as it is returned.
    """

    at: int
    dtype: np.dtype[Any]
    divisor: float = 1.0

    @property
    def kind(self) -> str:
        """Type as a topic lists it."""
        if self.dtype.kind == "S":
            return "string"
        return "float64" if self.divisor != 1.0 else self.dtype.newbyteorder("=").name


@dataclass(frozen=True)
class RecordTable:
    """All messages of one topic.

    Attributes
    ----------
    name, type
        Topic and type.
    fields
        Path to field, in the order of the message.
    places
        Where each message begins in the file [bytes], shape (n,).
    time, time_ns
        Field of the recorder's time, and the length of its unit [ns].
    stamp
        Field of the sender's time in the same unit, empty where there is none.
    """

    name: str
    type: str
    fields: Mapping[str, RecordField]
    places: NDArray[np.int64]
    time: str
    time_ns: int
    stamp: str = ""

    @property
    def hidden(self) -> tuple[str, ...]:
        """Fields that are times, which a series has anyway."""
        return tuple(name for name in (self.time, self.stamp) if name)


def column_of(data: NDArray[np.uint8], table: RecordTable, name: str) -> Column:
    """Decode one field of all messages of a topic, shape (n,)."""
    field = table.fields[name]
    size = field.dtype.itemsize
    rows = np.empty((len(table.places), size), np.uint8)
    for byte in range(size):
        rows[:, byte] = data[table.places + (field.at + byte)]
    raw = rows.view(field.dtype).reshape(len(table.places))
    if field.dtype.kind == "S":
        texts = np.empty(len(raw), object)
        texts[:] = [value.split(b"\0")[0].decode("utf-8", "replace") for value in raw.tolist()]
        return texts
    if field.divisor != 1.0:
        return raw / field.divisor
    return raw.astype(field.dtype.newbyteorder("="))


def times_of(
    data: NDArray[np.uint8], table: RecordTable, name: str, since_ns: int
) -> tuple[Nanoseconds, NDArray[np.bool_]]:
    """Return times of a topic [ns], shape (n,), `since_ns` later than its field has them, and which can be read."""
    counts = column_of(data, table, name)
    most = (FARTHEST_NS - abs(since_ns)) // table.time_ns
    good = counts <= most if counts.dtype.kind == "u" else np.abs(counts.astype(np.int64)) <= most
    return np.where(good, counts, 0).astype(np.int64) * np.int64(table.time_ns) + np.int64(since_ns), good


class RecordReader:
    """Reader of a log of such messages (see `ferryid.ingest.log.Reader`)."""

    def __init__(
        self,
        path: Path,
        data: NDArray[np.uint8],
        tables: Sequence[RecordTable],
        losses: Sequence[Loss],
        *,
        encoding: str,
        since_ns: int,
        note: str,
        parameters: Callable[[NDArray[np.uint8], int], Mapping[str, Parameter]],
    ) -> None:
        self.paths: tuple[Path, ...] = (path,)
        self._tables = {table.name: table for table in tables}
        self._since_ns = since_ns
        self._parameters = parameters
        self._size = len(data)
        self.losses = tuple(losses)
        self.topics = tuple(_topic(data, table, encoding, since_ns, note) for table in self._tables.values())

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters of the autopilot by name, decoded when asked for.

        Raises
        ------
        FerryIdError
            For a log that became shorter since it was opened.
        """
        data = file_bytes(self.paths[0])
        if len(data) < self._size:
            raise self._shorter()
        return self._parameters(data, self._since_ns)

    def _shorter(self) -> FerryIdError:
        return FerryIdError(f"{self.paths[0]}: the log became shorter while it was read. Fix: wait until it is copied")

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields; see `ferryid.ingest.log.Reader.read`. There are no checksums that `verify` could check."""
        path = self.paths[0]
        for name, fields in wanted.items():
            if name not in self._tables:
                raise FerryIdError(
                    f'{path}: there is no topic "{name}".{did_you_mean(name, self._tables)} '
                    f"Fix: use one of {_listed(list(self._tables))}"
                )
            known = self._tables[name].fields
            for field in fields:
                if field not in known:
                    raise FerryIdError(
                        f'{path}: there is no field "{field}" in {name}.{did_you_mean(field, known)} '
                        f"Fix: use one of {_listed(list(known))}"
                    )
        data = file_bytes(path)
        series: dict[str, Series] = {}
        for name, fields in wanted.items():
            table = self._tables[name]
            if len(table.places) and int(table.places[-1]) + _size(table) > len(data):
                raise self._shorter()
            series[name], lost = self._series(data, table, tuple(fields))
            known_losses = {(loss.what, loss.topic) for loss in self.losses}
            self.losses += tuple(loss for loss in lost if (loss.what, loss.topic) not in known_losses)
        return series

    def _series(
        self, data: NDArray[np.uint8], table: RecordTable, fields: tuple[str, ...]
    ) -> tuple[Series, tuple[Loss, ...]]:
        times, good = times_of(data, table, table.time, self._since_ns)
        stamps = None
        if table.stamp:
            stamps, stamped = times_of(data, table, table.stamp, self._since_ns)
            # What was not sampled anew has a sender's time of zero.
            if not np.all(stamped & (column_of(data, table, table.stamp) > 0)):
                stamps = None
        losses: tuple[Loss, ...] = ()
        if not good.all():
            bad = int(np.sum(~good))
            losses = (
                Loss(
                    str(self.paths[0]), f"{counted(bad, 'message')} without a possible time left out", table.name, bad
                ),
            )
        columns = {name: column_of(data, table, name)[good] for name in fields}
        return Series(table.name, times[good], None if stamps is None else stamps[good], columns), losses


def file_bytes(path: Path) -> NDArray[np.uint8]:
    """Read a whole file."""
    return np.fromfile(path, np.uint8)


def utc_offset_ns(clock_s: NDArray[np.float64], utc_s: NDArray[np.float64]) -> int | None:
    """Return by how much UTC is later than an autopilot's clock [ns], by a receiver's times; None where it never knew it.

    Parameters
    ----------
    clock_s, utc_s
        The autopilot's time and what the receiver had for it [s], shape (n,); impossible ones are left out.
    """
    good = np.isfinite(clock_s) & (utc_s > EARLIEST_UTC_S) & (utc_s < LATEST_UTC_S)
    if not good.any():
        return None
    # Whole microseconds, as the clock counts them.
    return round(float(np.median(utc_s[good] - clock_s[good])) * 1e6) * 1000


def instance_name(name: str, instance: int) -> str:
    """Return the topic of one of several alike: the first has the bare name, further ones their number."""
    return f"/{name}" if instance == 0 else f"/{name}[{instance}]"


def damage_loss(path: Path, what: str, stretches: int, size: int) -> list[Loss]:
    """Return what is reported of stretches of a file that hold no messages."""
    if not stretches:
        return []
    return [
        Loss(
            str(path),
            f"{counted(stretches, 'damaged stretch')} of the {what} ({counted(size, 'byte')}) left out; how many messages "
            "were in it cannot be known",
        )
    ]


def _topic(data: NDArray[np.uint8], table: RecordTable, encoding: str, since_ns: int, note: str) -> Topic:
    times, good = times_of(data, table, table.time, since_ns)
    times = times[good]
    fields = {name: field.kind for name, field in table.fields.items() if name not in table.hidden}
    first, last = (int(times[0]), int(times[-1])) if len(times) else (None, None)
    return Topic(table.name, table.type, encoding, len(table.places), first, last, fields, note)


def _size(table: RecordTable) -> int:
    return max((field.at + field.dtype.itemsize for field in table.fields.values()), default=0)


def _listed(names: Sequence[str]) -> str:
    shown = [f'"{name}"' for name in names[:12]]
    return ", ".join(shown) + (f" and {len(names) - len(shown)} more" if len(names) > len(shown) else "")


def with_places(table: RecordTable, places: Sequence[int] | NDArray[np.int64]) -> RecordTable:
    """Return a topic with the messages at these places."""
    return replace(table, places=np.asarray(places, np.int64))
