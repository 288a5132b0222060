"""Writers of the logs of PX4 (ULog) and ArduPilot (DataFlash), after their published formats."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

MAGIC = b"ULog\x01\x12\x35"
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"


def ulog_message(kind: str, content: bytes) -> bytes:
    """One message of a ULog: size, kind, content."""
    return struct.pack("<HB", len(content), ord(kind)) + content


def ulog_definition(text: str) -> bytes:
    return ulog_message("F", text.encode())


def ulog_header(start_us: int = 0, incompatible: int = 0, appended: int = 0) -> bytes:
    """The head of a file of version 1, and the message of its flags."""
    flags = bytes(8) + bytes([incompatible]) + bytes(7) + struct.pack("<3Q", appended, 0, 0)
    return MAGIC + b"\x01" + struct.pack("<Q", start_us) + ulog_message("B", flags)


_ULOG = {"f4": "float", "f8": "double", "u8": "uint64_t", "i4": "int32_t", "u4": "uint32_t", "u2": "uint16_t",
         "i2": "int16_t", "u1": "uint8_t", "i1": "int8_t", "b1": "bool"}  # fmt: skip


def ulog_parameter(name: str, value: float) -> bytes:
    """The message of a parameter: whole numbers are integers of 32 bits, others floats, as PX4 has them."""
    kind, packed = (
        ("int32_t", struct.pack("<i", value)) if isinstance(value, int) else ("float", struct.pack("<f", value))
    )
    key = f"{kind} {name}".encode()
    return ulog_message("P", bytes([len(key)]) + key + packed)


def ulog(
    topics: dict[str, dict[str, Any]],
    *,
    instances: dict[str, int] | None = None,
    parameters: dict[str, float] | None = None,
    changed: tuple[tuple[int, str, float], ...] = (),
) -> bytes:
    """A ULog of topics with columns; ``timestamp`` is in whole microseconds, matrices are arrays of a message.

    `parameters` stand in the header, `changed` (time [us], name, value) among the data.
    """
    content = ulog_header()
    for name, value in (parameters or {}).items():
        content += ulog_parameter(name, value)
    rows = []
    for number, (name, columns) in enumerate(topics.items()):
        arrays = {path: np.asarray(values) for path, values in columns.items()}
        parts = []
        for path, values in arrays.items():
            kind = _ULOG[values.dtype.str[1:]]
            parts.append(f"{kind}{f'[{values.shape[1]}]' if values.ndim > 1 else ''} {path}")
        content += ulog_definition(f"{name}:{';'.join(parts)};")
        dtype = np.dtype([(path, values.dtype, values.shape[1:]) for path, values in arrays.items()])
        table = np.empty(len(arrays["timestamp"]), dtype)
        for path, values in arrays.items():
            table[path] = values
        rows += [(int(row["timestamp"]), number, row.tobytes()) for row in table]
    for number, name in enumerate(topics):
        content += ulog_message("A", struct.pack("<BH", (instances or {}).get(name, 0), number) + name.encode())
    messages = [(time, ulog_message("D", struct.pack("<H", number) + data)) for time, number, data in rows]
    messages += [(time, ulog_parameter(name, value)) for time, name, value in changed]
    return content + b"".join(data for _, data in sorted(messages, key=lambda one: one[0]))


_PACK = {"b": "b", "B": "B", "M": "B", "h": "h", "H": "H", "i": "i", "I": "I", "q": "q", "Q": "Q", "f": "f", "d": "d",
         "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "n": "4s", "N": "16s", "Z": "64s", "a": "32h"}  # fmt: skip


class DataFlash:
    """A log of ArduPilot, written message by message; what its definitions scale is given as the file has it."""

    def __init__(self) -> None:
        self._types = {"FMT": (128, "BBnNZ")}
        self.content = self._definition("FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def define(self, name: str, letters: str, labels: str) -> None:
        self._types[name] = (len(self._types), letters)
        self.content += self._definition(name, letters, labels)

    def _definition(self, name: str, letters: str, labels: str) -> bytes:
        size = 3 + struct.calcsize("<" + "".join(_PACK[one] for one in letters))
        values = (self._types[name][0], size, name.encode(), letters.encode(), labels.encode())
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", *values)

    def units(self, name: str, units: str) -> None:
        """State the units of a message's fields; "#" marks the number of an instance."""
        if "FMTU" not in self._types:
            self.define("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
        self.add("FMTU", 0, self._types[name][0], units.encode(), b"-" * len(units))

    def add(self, name: str, *values: Any) -> None:
        number, letters = self._types[name]
        self.content += bytes([0xA3, 0x95, number]) + struct.pack("<" + "".join(_PACK[one] for one in letters), *values)

    def parameters(self, values: dict[str, float], time_us: int = 0) -> None:
        """State parameters as a log does at its start, or where one is changed."""
        if "PARM" not in self._types:
            self.define("PARM", "QNff", "TimeUS,Name,Value,Default")
        for name, value in values.items():
            self.add("PARM", time_us, name.encode(), value, 0.0)

    def table(self, rows: list[tuple[Any, ...]]) -> None:
        """Add messages in order of their times: name, time [us], values."""
        for name, *values in sorted(rows, key=lambda one: one[1]):
            self.add(name, *values)
