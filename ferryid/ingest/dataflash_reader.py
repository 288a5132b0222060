"""DataFlash logs of ArduPilot (``.bin``): messages that the log itself defines; one topic for each, and for each instance.

The format is published by ArduPilot (libraries/AP_Logger/LogStructure.h). It has no checksums and no index: opening looks at
the head of every message, and decodes none but the definitions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.ingest.formats.dataflash import FMT, HEAD_BYTES, SYNC
from ferryid.ingest.log import Loss, TableLayout
from ferryid.ingest.parameters import Parameter, gathered, together
from ferryid.ingest.records import (
    RecordField,
    RecordReader,
    RecordTable,
    column_of,
    damage_loss,
    file_bytes,
    instance_name,
    times_of,
    utc_offset_ns,
    with_places,
)

_FMT_SIZE = 89
_TYPES: Mapping[str, tuple[str, float]] = {
    "b": ("<i1", 1.0), "B": ("<u1", 1.0), "M": ("<u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
    "i": ("<i4", 1.0), "I": ("<u4", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
    "g": ("<f2", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0),
    "c": ("<i2", 100.0), "C": ("<u2", 100.0), "e": ("<i4", 100.0), "E": ("<u4", 100.0), "L": ("<i4", 1e7),
    "n": ("S4", 1.0), "N": ("S16", 1.0), "Z": ("S64", 1.0),
}  # fmt: skip
"""Letter of a definition to the type of its field, and how many times as large the file has it (LogStructure.h)."""
_TIMES: Mapping[str, int] = {"TimeUS": 1000, "TimeMS": 1_000_000, "timestamp": 1000}
"""Names of the field with the time since start-up, and its unit [ns]."""
_ARRAY = 32
_DEFINITIONS = frozenset({"FMT", "UNIT", "MULT", "FMTU", "PARM", "FILE"})
"""What a log states of itself once, and files that are kept in it: no signals."""
_CHAIN = 4
"""Heads in a row by which messages are recognised again after a damaged stretch."""
_GPS_EPOCH_S, _WEEK_S = 315_964_800, 604_800
"""GPS time began on 1980-01-06 [s since 1970]."""
_LEAPS = {1_230_768_000: 15, 1_341_100_800: 16, 1_435_708_800: 17, 1_483_228_800: 18}
"""From which time on [s since 1970] GPS time is ahead of UTC by how much [s]."""
_OF_GPS = frozenset({"TimeMS", "Week"})
"""Fields of the receivers until 2014: their TimeMS counts from the begin of the week, and T has the autopilot's clock [ms]."""
_WEEKS = (("GWk", "GMS"), ("Week", "TimeMS"))
"""Names of week and milliseconds of the week."""


@dataclass(frozen=True)
class _Layout:
    """One definition of a message: name, size with its head, letters of the fields, their labels."""

    name: str
    size: int
    letters: str
    labels: tuple[str, ...]


@dataclass
class _Scan:
    layouts: dict[int, _Layout] = field(default_factory=lambda: {FMT: _Layout("FMT", _FMT_SIZE, "", ())})
    places: dict[int, list[int]] = field(default_factory=dict)
    stretches: int = 0
    lost_bytes: int = 0
    cut: bool = False


def open_dataflash(path: Path, layout: TableLayout | None) -> RecordReader:
    data = file_bytes(path)
    raw = data.tobytes()
    scan = _scanned(raw)
    tables = [
        table
        for number, places in scan.places.items()
        for table in _tables(data, scan, scan.layouts[number], np.asarray(places, np.int64))
    ]
    tables = _distinct(tables)
    if not tables:
        raise FerryIdError(
            f"{path}: the ArduPilot log holds no data, found {len(scan.layouts) - 1} definitions"
            f"{' and damage' if scan.stretches or scan.cut else ''}. Fix: download it from the autopilot again, or set "
            "LOG_DISARMED where the vessel was never armed"
        )
    since_ns = _utc(data, tables)
    note = (
        "times counted from the start-up of the autopilot: no receiver knew UTC"
        if since_ns is None
        else "times of the autopilot in UTC, as its receiver had it"
    )
    losses = damage_loss(path, "ArduPilot log", scan.stretches, scan.lost_bytes)
    if scan.cut:
        losses.append(Loss(str(path), "the ArduPilot log ends within a message: the end of the recording is missing"))
    losses += _timeless(path, scan)
    return RecordReader(
        path,
        data,
        tables,
        losses,
        encoding="dataflash",
        since_ns=since_ns or 0,
        note=note,
        parameters=partial(_parameters, _parameter_tables(scan)),
    )


def _scanned(raw: bytes) -> _Scan:
    """Go from head to head; where something else than a message begins, to the next place where messages do."""
    scan = _Scan()
    sizes = {FMT: _FMT_SIZE}
    position, end = 0, len(raw)
    while position < end:
        number = raw[position + 2] if position + 2 < end else -1
        size = sizes.get(number)
        after = position + (size or 0)
        if size is None or raw[position : position + 2] != SYNC or (after < end and not _head(raw, after)):
            if size is None and raw[position : position + 2] == SYNC[: end - position] and position + 3 > end:
                scan.cut = True
                break
            resumed = _resumed(raw, position + 1, sizes)
            scan.stretches += 1
            scan.lost_bytes += resumed - position
            position = resumed
            continue
        if after > end:
            # An erased end of the memory is no message.
            scan.cut = True
            break
        if number == FMT:
            made = _definition(raw[position + HEAD_BYTES : after])
            if made is not None and made[0] != FMT:
                kind, stated = made
                known = scan.layouts.get(kind)
                if known is None or not scan.places[kind]:
                    scan.layouts[kind], sizes[kind], scan.places[kind] = stated, stated.size, []
        else:
            scan.places[number].append(position + HEAD_BYTES)
        position = after
    return scan


def _head(raw: bytes, position: int) -> bool:
    return raw[position : position + 2] == SYNC[: len(raw) - position]


def _definition(content: bytes) -> tuple[int, _Layout] | None:
    """Return the message type that a definition is of, and its layout; None where the parts contradict each other."""
    kind, size = content[0], content[1]
    name, letters, labels = (
        content[start:stop].split(b"\0")[0].decode("ascii", "replace") for start, stop in ((2, 6), (6, 22), (22, 86))
    )
    labels_found = tuple(label.strip() for label in labels.split(",") if label.strip())
    if (
        not name
        or size <= HEAD_BYTES
        or not letters
        or any(letter not in _TYPES and letter != "a" for letter in letters)
    ):
        return None
    if HEAD_BYTES + sum(_size(letter) for letter in letters) != size or len(labels_found) != len(letters):
        return None
    return kind, _Layout(name, size, letters, labels_found)


def _size(letter: str) -> int:
    return 2 * _ARRAY if letter == "a" else np.dtype(_TYPES[letter][0]).itemsize


def _tables(data: NDArray[np.uint8], scan: _Scan, layout: _Layout, places: NDArray[np.int64]) -> list[RecordTable]:
    """Return the topics of one message: one, or one for each instance that its definition names."""
    if layout.name in _DEFINITIONS or not len(places):
        return []
    whole = _whole(layout, places)
    if whole is None:
        return []
    label = _instance_label(data, scan, layout)
    if not label or whole.fields[label].dtype.kind not in "iu":
        return [whole]
    numbers = column_of(data, whole, label)
    return [
        with_places(replace(whole, name=instance_name(layout.name, int(number))), places[numbers == number])
        for number in np.unique(numbers)
    ]


def _whole(layout: _Layout, places: NDArray[np.int64]) -> RecordTable | None:
    """Return all messages of one definition as a topic, None where they have no time."""
    fields: dict[str, RecordField] = {}
    at = 0
    for letter, label in zip(layout.letters, layout.labels, strict=True):
        if letter == "a":
            fields |= {f"{label}[{k}]": RecordField(at + 2 * k, np.dtype("<i2")) for k in range(_ARRAY)}
        else:
            dtype, divisor = _TYPES[letter]
            fields[label] = RecordField(at, np.dtype(dtype), divisor)
        at += _size(letter)
    units: Mapping[str, int] = {"T": 1_000_000} if fields.keys() >= _OF_GPS else _TIMES
    clock = next((name for name in units if name in fields and fields[name].dtype.kind in "iu"), None)
    if clock is None:
        return None
    return RecordTable(instance_name(layout.name, 0), layout.name, fields, places, clock, units[clock])


def _timeless(path: Path, scan: _Scan) -> list[Loss]:
    """Return the messages that cannot be placed in time, as a damaged label of their definition leaves them."""
    return [
        Loss(
            str(path),
            f"no field of its definition is a time of the autopilot ({' or '.join(_TIMES)}"
            f"{', but here TimeMS is the time of the week' if set(layout.labels) >= _OF_GPS else ''}): "
            f"{', '.join(layout.labels)}",
            topic=instance_name(layout.name, 0),
            messages=len(places),
        )
        for number, places in scan.places.items()
        for layout in [scan.layouts[number]]
        if places and layout.name not in _DEFINITIONS and _whole(layout, np.asarray(places, np.int64)) is None
    ]


def _parameter_tables(scan: _Scan) -> list[RecordTable]:
    """Return the messages PARM, which state a parameter each."""
    found = []
    for number, layout in scan.layouts.items():
        places = np.asarray(scan.places.get(number, ()), np.int64)
        table = _whole(layout, places) if layout.name == "PARM" and len(places) else None
        if table is not None and {"Name", "Value"} <= table.fields.keys() and table.fields["Value"].dtype.kind != "S":
            found.append(table)
    return found


def _parameters(tables: list[RecordTable], data: NDArray[np.uint8], since_ns: int) -> dict[str, Parameter]:
    """Return the parameters that messages state."""
    found = []
    for table in tables:
        times, good = times_of(data, table, table.time, since_ns)
        names, values = column_of(data, table, "Name"), np.asarray(column_of(data, table, "Value"), np.float64)
        found.append(gathered([str(one) for one in names[good]], times[good], values[good]))
    return together(found)


def _instance_label(data: NDArray[np.uint8], scan: _Scan, layout: _Layout) -> str:
    """Return the field that counts devices of one kind, by the units that the log states ("#"), or an empty string."""
    for number, units in scan.layouts.items():
        if units.name != "FMTU" or units.letters != "QBNN":
            continue
        for place in scan.places.get(number, ()):
            kind = int(data[place + 8])
            if scan.layouts.get(kind) == layout:
                marks = bytes(data[place + 9 : place + 25]).split(b"\0")[0].decode("ascii", "replace")
                found = marks.find("#")
                return layout.labels[found] if 0 <= found < len(layout.labels) else ""
    return ""


def _distinct(tables: list[RecordTable]) -> list[RecordTable]:
    """Number topics of one name, which two definitions may have."""
    found: dict[str, RecordTable] = {}
    for table in tables:
        name, number = table.name, 2
        while name in found:
            name, number = f"{table.name} ({number})", number + 1
        found[name] = RecordTable(name, table.type, table.fields, table.places, table.time, table.time_ns)
    return list(found.values())


def _resumed(raw: bytes, position: int, sizes: Mapping[int, int]) -> int:
    """Return the next place from which messages follow each other, or the end of the file."""
    while (position := raw.find(SYNC, position)) >= 0:
        if _chained(raw, position, sizes):
            return position
        position += 1
    return len(raw)


def _chained(raw: bytes, position: int, sizes: Mapping[int, int]) -> bool:
    for _ in range(_CHAIN):
        if position == len(raw):
            return True
        if position + HEAD_BYTES > len(raw) or raw[position : position + 2] != SYNC:
            return False
        size = sizes.get(raw[position + 2])
        if size is None or position + size > len(raw):
            return False
        position += size
    return True


def _utc(data: NDArray[np.uint8], tables: list[RecordTable]) -> int | None:
    """Return by how much UTC is later than the autopilot's clock [ns], by its receivers; None where none knew it."""
    for table in tables:
        names = next((names for names in _WEEKS if set(names) <= table.fields.keys()), None)
        if table.type != "GPS" or names is None:
            continue
        clock = column_of(data, table, table.time).astype(float) * (table.time_ns * 1e-9)
        weeks, ms = (column_of(data, table, name).astype(float) for name in names)
        by_gps = _GPS_EPOCH_S + weeks * _WEEK_S + ms * 1e-3
        ahead = np.asarray([0, *_LEAPS.values()])[np.searchsorted(list(_LEAPS), by_gps, side="right")]
        known = np.where(weeks > 0, by_gps - ahead, 0.0)
        if (offset := utc_offset_ns(clock, known)) is not None:
            return offset
    return None
