"""Recordings of kinds that are not read, and what makes a log of each."""

from __future__ import annotations

import re
from collections.abc import Sequence

_PACKED = {
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"7z\xbc\xaf\x27\x1c": "7-Zip",
    b"Rar!": "RAR",
    b"PK\x03\x04": "zip",
}
_WORKBOOK = re.compile(
    rb"PK\x03\x04.{26}(?:\[Content_Types\]|docProps/|_rels/|xl/|mimetypeapplication/vnd\.oasis)", re.DOTALL
)
"""The head of a workbook: which of its members comes first depends on the program that wrote it."""
_MAVLINK = (0xFE, 0xFD)
_STAMP_US = (10**15, 5 * 10**15)
"""Microseconds since 1970 that a telemetry log may begin with: 2001 to 2128."""
_NMEA = re.compile(r"[$!][A-Z][A-Z0-9]{3,7},[^$]*\*[0-9A-Fa-f]{2}\s*$")
_DATAFLASH = re.compile(r"FMT, *\d+, *\d+, *[A-Z0-9]+,")
_SHARE = 0.5


def unread_file(head: bytes) -> tuple[str, str] | None:
    """Return what a file is by its first bytes, and the remedy; None where they show nothing.

    Parameters
    ----------
    head
        First bytes of the file, 64 where it has as many.
    """
    if _WORKBOOK.match(head):
        return "a workbook of a spreadsheet program", "save the sheet as CSV"
    for magic, name in _PACKED.items():
        if head.startswith(magic):
            return f"a file packed by {name}", "unpack it and give the log inside"
    # Frames of MAVLink 1 or 2, each after its time in microseconds.
    if len(head) > 8 and head[8] in _MAVLINK and _STAMP_US[0] < int.from_bytes(head[:8], "big") < _STAMP_US[1]:
        return (
            "a telemetry log of MAVLink (.tlog)",
            "take the log that the autopilot wrote itself (.bin of ArduPilot, .ulg of PX4), or convert it to CSV",
        )
    return None


def unread_text(lines: Sequence[str]) -> tuple[str, str] | None:
    """Return what a text is that is no table, and the remedy; None where its lines show nothing."""
    filled = [line for line in lines if line.strip()]
    if not filled:
        return None
    if sum(_NMEA.search(line) is not None for line in filled) >= _SHARE * len(filled):
        return (
            "sentences of NMEA 0183",
            "convert them to a table with a header, one row a time, and columns such as time, latitude, longitude, heading",
        )
    if any(_DATAFLASH.match(line) for line in filled[:2]):
        return (
            "a DataFlash log of ArduPilot as text",
            "take the binary log (.bin), or convert each kind of message to a CSV file of one folder",
        )
    return None
