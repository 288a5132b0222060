"""ULog of PX4 (``.ulg``): definitions, subscriptions, and data messages of fixed layout; one topic for each subscription.

The format is published by PX4 (docs.px4.io, "ULog File Format"). It has no checksums and no index: opening looks at the head of
every message, and decodes none.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.ingest.log import Loss, TableLayout
from ferryid.ingest.parameters import Parameter, gathered
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

_HEADER = 16
_KINDS = frozenset(b"ABCDFILMOPQRS")
_TYPES = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "?", "char": "S1",
}  # fmt: skip
_PART = re.compile(r"([A-Za-z0-9_/-]+)(?:\[([0-9]{1,5})\])? ([A-Za-z0-9_]+)$")
_SIZES = {"S": 8, "R": 2}
_KEYS = {"I": 0, "P": 0, "M": 1, "Q": 1}
"""Kinds of messages that have a type and a name, and where its length is."""
_DEEPEST, _MOST_FIELDS = 8, 20_000
"""Messages in messages, and fields of one topic, beyond which a definition is damaged."""
_CHAIN = 4
"""Heads in a row by which messages are recognised again after a damaged stretch."""
_APPENDED = 1
"""The one flag of incompatible contents that is known: data appended after a crash."""
_RECEIVERS = ("/sensor_gps", "/vehicle_gps_position")


@dataclass
class _Scan:
    """What the heads of all messages show."""

    formats: dict[str, str] = field(default_factory=dict)
    subscriptions: dict[int, tuple[str, int]] = field(default_factory=dict)
    tables: dict[int, RecordTable] = field(default_factory=dict)
    sizes: dict[int, tuple[int, int]] = field(default_factory=dict)
    """Message id to the size of its data without trailing padding, and with it."""
    places: dict[int, list[int]] = field(default_factory=dict)
    parameters: list[tuple[int, str, float]] = field(default_factory=list)
    """Where each value of a parameter stands in the file [bytes], its name, and the value."""
    untimed: list[str] = field(default_factory=list)
    stretches: int = 0
    lost_bytes: int = 0
    cut: bool = False
    dropouts_ms: int = 0
    dropouts: int = 0


def open_ulog(path: Path, layout: TableLayout | None) -> RecordReader:
    data = file_bytes(path)
    raw = data.tobytes()
    if len(raw) < _HEADER:
        raise FerryIdError(
            f"{path}: the ULog ends within its first {_HEADER} bytes, found {len(raw)}. Fix: copy it from the autopilot again"
        )
    scan = _scanned(path, raw)
    tables = [with_places(table, scan.places[number]) for number, table in scan.tables.items() if scan.places[number]]
    if not tables:
        raise FerryIdError(
            f"{path}: the ULog holds no data, found {counted(len(scan.formats), 'definition')} and "
            f"{counted(len(scan.subscriptions), 'topic')}"
            f"{', and damage' if scan.stretches or scan.cut else ''}. Fix: copy it from the autopilot again, or record while "
            "the vessel is armed"
        )
    since_ns = _utc(data, tables)
    note = (
        "times counted from the start-up of the autopilot: no receiver knew UTC"
        if since_ns is None
        else "times of the autopilot in UTC, as its receiver had it"
    )
    return RecordReader(
        path,
        data,
        _merged(tables),
        _losses(path, scan),
        encoding="ulog",
        since_ns=since_ns or 0,
        note=note,
        parameters=partial(_parameters, scan.parameters, tables),
    )


def _parameters(
    stated: list[tuple[int, str, float]], tables: list[RecordTable], data: NDArray[np.uint8], since_ns: int
) -> dict[str, Parameter]:
    """Return the parameters of the log; a value has no time of its own, but that of the data before it."""
    if not stated:
        return {}
    before = []
    for table in tables:
        times, good = times_of(data, table, table.time, since_ns)
        before.append(np.column_stack([table.places[good], times[good]]))
    rows = np.concatenate(before)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    # What stands in the header holds from the first message on.
    places = np.asarray([place for place, _, _ in stated], np.int64)
    times = rows[np.clip(np.searchsorted(rows[:, 0], places) - 1, 0, len(rows) - 1), 1] if len(rows) else 0 * places
    values = np.asarray([value for _, _, value in stated], np.float64)
    return gathered([name for _, name, _ in stated], times, values)


def _merged(tables: list[RecordTable]) -> list[RecordTable]:
    """Put subscriptions of one topic together, which a log appended to has again; of other layout they are further topics."""
    found: dict[str, RecordTable] = {}
    for table in tables:
        name, number = table.name, 2
        while name in found and found[name].fields != table.fields:
            name, number = f"{table.name} ({number})", number + 1
        if name in found:
            found[name] = with_places(found[name], np.sort(np.r_[found[name].places, table.places]))
        else:
            found[name] = RecordTable(
                name, table.type, table.fields, table.places, table.time, table.time_ns, table.stamp
            )
    return list(found.values())


def _losses(path: Path, scan: _Scan) -> list[Loss]:
    losses = damage_loss(path, "ULog", scan.stretches, scan.lost_bytes)
    if scan.cut:
        losses.append(Loss(str(path), "the ULog ends within a message: the end of the recording is missing"))
    if scan.dropouts:
        losses.append(
            Loss(
                str(path),
                f"the autopilot could not write for {scan.dropouts_ms / 1000:.3g} s in all ({scan.dropouts} times)",
                messages=None,
            )
        )
    losses += [
        Loss(str(path), f"{name} has no field timestamp and cannot be read", topic=name) for name in scan.untimed
    ]
    return losses


def _scanned(path: Path, raw: bytes) -> _Scan:
    """Go from head to head; where something else than a message begins, to the next place where messages do."""
    scan = _Scan()
    position, end = _HEADER, len(raw)
    appended: list[int] = []
    head = struct.Struct("<HB").unpack_from
    number_of = struct.Struct("<H").unpack_from
    sizes, places = scan.sizes, scan.places
    while position + 3 <= end:
        size, kind = head(raw, position)
        after = position + 3 + size
        if appended and position < appended[0] < after:
            # Written when the autopilot crashed: the message before was never finished.
            position = appended.pop(0)
            continue
        if kind == 68 and size >= 2 and after <= end:  # D, data
            (number,) = number_of(raw, position + 3)
            known = sizes.get(number)
            if known is not None and known[0] <= size - 2 <= known[1]:
                places[number].append(position + 5)
                position = after
                continue
        if (
            kind in _KINDS
            and kind != 68
            and after <= end
            and _taken(path, scan, kind, raw[position + 3 : after], appended)
        ):
            if kind == 80:  # P, a parameter
                _keep_parameter(scan, position, raw[position + 3 : after])
            position = after
            continue
        if after > end and _plausible(raw, position, scan, inside=False):
            scan.cut = True
            return scan
        resumed = _resumed(raw, position + 1, scan)
        if kind == 68 and after < end and resumed >= after and _chained(raw, after, scan):
            # Data of a topic that was not subscribed, or of another size than its definition.
            resumed = after
        scan.stretches += 1
        scan.lost_bytes += resumed - position
        position = resumed
    scan.cut = scan.cut or position < end
    return scan


def _taken(path: Path, scan: _Scan, kind: int, content: bytes, appended: list[int]) -> bool:
    """Take what a message other than data states; False where it cannot be one."""
    letter = chr(kind)
    if letter == "B":
        return _flags(path, content, appended)
    if letter == "F":
        name, colon, parts = content.decode("utf-8", "replace").partition(":")
        if not colon or not name:
            return False
        scan.formats.setdefault(name, parts)
    elif letter == "A":
        if len(content) < 4:
            return False
        multi, number = struct.unpack_from("<BH", content)
        _subscribe(scan, number, content[3:].decode("utf-8", "replace"), multi)
    elif letter == "O":
        if len(content) != 2:
            return False
        scan.dropouts += 1
        scan.dropouts_ms += int.from_bytes(content, "little")
    elif letter in _SIZES:
        return len(content) == _SIZES[letter]
    elif letter in _KEYS:
        place = _KEYS[letter]
        key = content[place + 1 : place + 1 + content[place]] if len(content) > place else b""
        return len(key) > 2 and key.isascii() and b" " in key
    elif letter in "LC":
        return len(content) >= 9 and content[0] in b"01234567"
    return True


def _keep_parameter(scan: _Scan, position: int, content: bytes) -> None:
    """Keep the value of a parameter, as its key has its type: ``float CA_ROTOR0_PX``."""
    key, value = content[1 : 1 + content[0]], content[1 + content[0] :]
    kind, _, name = key.decode("ascii").partition(" ")
    if kind in ("float", "int32_t") and len(value) == 4:
        scan.parameters.append((position, name, float(np.frombuffer(value, _TYPES[kind])[0])))


def _flags(path: Path, content: bytes, appended: list[int]) -> bool:
    if len(content) < 40:
        return False
    incompatible = content[8:16]
    if incompatible[0] & ~_APPENDED or any(incompatible[1:]):
        raise FerryIdError(
            f"{path}: the ULog has contents of a kind that is not known here (flags {incompatible.hex()}). "
            "Fix: convert it by the tools of its autopilot, or copy it again if it is damaged"
        )
    if incompatible[0] & _APPENDED:
        appended += sorted(place for place in struct.unpack_from("<3Q", content, 16) if place > 0)
    return True


def _subscribe(scan: _Scan, number: int, name: str, multi: int) -> None:
    if scan.subscriptions.get(number) == (name, multi) or name not in scan.formats:
        return
    found: dict[str, RecordField] = {}
    whole = _lay_out(scan.formats, name, "", 0, found, 0)
    topic = instance_name(name, multi)
    scan.subscriptions[number] = (name, multi)
    if whole is None:
        scan.untimed.append(topic)
        scan.sizes[number], scan.places[number] = (0, 65535), []
        return
    clock = found.get("timestamp")
    if clock is None or clock.dtype.kind != "u":
        scan.untimed.append(topic)
    # Padding at the end of a message is not written.
    least = max((one.at + one.dtype.itemsize for one in found.values()), default=0)
    scan.sizes[number] = (least, whole)
    scan.places[number] = []
    if clock is not None and clock.dtype.kind == "u":
        stamp = found.get("timestamp_sample")
        sampled = "timestamp_sample" if stamp is not None and stamp.dtype.kind == "u" else ""
        scan.tables[number] = RecordTable(topic, name, found, np.empty(0, np.int64), "timestamp", 1000, sampled)


def _lay_out(
    formats: dict[str, str], name: str, prefix: str, at: int, found: dict[str, RecordField], depth: int
) -> int | None:
    """Add the fields of a message, elements of arrays one by one; return where it ends, None for no possible definition."""
    if depth > _DEEPEST:
        return None
    for part in filter(None, formats[name].split(";")):
        match = _PART.match(part.strip())
        if match is None:
            return None
        kind, count, label = match[1], match[2], match[3]
        elements = 1 if count is None else int(count)
        if kind == "char" and count is not None:
            if elements and not label.startswith("_padding"):
                found[prefix + label] = RecordField(at, np.dtype(f"S{elements}"))
            at += elements
            continue
        if elements > _MOST_FIELDS:
            return None
        for index in range(elements):
            path = prefix + label + ("" if count is None else f"[{index}]")
            if kind in _TYPES:
                dtype = np.dtype(_TYPES[kind])
                if not label.startswith("_padding"):
                    found[path] = RecordField(at, dtype)
                at += dtype.itemsize
            elif kind in formats:
                inner = _lay_out(formats, kind, path + ".", at, found, depth + 1)
                if inner is None:
                    return None
                at = inner
            else:
                return None
            if len(found) > _MOST_FIELDS:
                return None
    return at


def _plausible(raw: bytes, position: int, scan: _Scan, *, inside: bool = True) -> bool:
    """Whether a message may begin here; with `inside` also end in the file."""
    if position + 3 > len(raw):
        return False
    size, kind = raw[position] | raw[position + 1] << 8, raw[position + 2]
    if inside and position + 3 + size > len(raw):
        return False
    if kind == 68:
        if position + 5 > len(raw):
            return not inside
        known = scan.sizes.get(raw[position + 3] | raw[position + 4] << 8)
        return known is not None and known[0] <= size - 2 <= known[1]
    expected = {83: 8, 79: 2, 82: 2}.get(kind)
    return kind in _KINDS and size > 0 and (expected is None or size == expected)


def _chained(raw: bytes, position: int, scan: _Scan) -> bool:
    """Whether several messages follow each other from here, or all to the end of the file."""
    for _ in range(_CHAIN):
        if position == len(raw):
            return True
        if not _plausible(raw, position, scan):
            return False
        position += 3 + (raw[position] | raw[position + 1] << 8)
    return True


def _resumed(raw: bytes, position: int, scan: _Scan) -> int:
    """Return the next place from which messages follow each other, or the end of the file."""
    block = 1 << 16
    kinds = np.frombuffer(bytes(_KINDS), np.uint8)
    while position < len(raw):
        part = np.frombuffer(raw, np.uint8, min(block, len(raw) - position), position)
        for place in np.flatnonzero(np.isin(part, kinds)):
            begins = position + int(place) - 2
            if place >= 2 and _chained(raw, begins, scan):
                return begins
        if position + len(part) >= len(raw):
            break
        position += max(len(part) - 2, 1)
    return len(raw)


def _utc(data: NDArray[np.uint8], tables: list[RecordTable]) -> int | None:
    """Return by how much UTC is later than the autopilot's clock [ns], by its receivers; None where none knew it."""
    for table in tables:
        utc = table.fields.get("time_utc_usec")
        if table.name in _RECEIVERS and utc is not None and utc.dtype.kind == "u":
            clock, known = (
                column_of(data, table, name).astype(float) * 1e-6 for name in ("timestamp", "time_utc_usec")
            )
            if (offset := utc_offset_ns(clock, known)) is not None:
                return offset
    return None
