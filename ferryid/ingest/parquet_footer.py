"""What the footer of a Parquet file counts: the missing values of every column in every row group.

Checksums cover the content of a page and not its header, and one changed byte there makes values missing in silence. The footer
counts them, but pyarrow ends the process where the statistics of a column are damaged, so the footer is parsed here.

References
----------
Apache Parquet format, parquet.thrift; Apache Thrift, compact protocol specification.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from struct import unpack_from
from typing import Any

LARGEST = 64 << 20
"""Bytes of a footer that are looked at."""
DEEPEST = 16
ROW_GROUPS, COLUMNS, META_DATA, PATH, STATISTICS, NULL_COUNT = 4, 1, 3, 3, 12, 3
"""Fields on the way to the number of missing values."""


def null_counts(path: Path) -> list[dict[str, int]]:
    """Return for every row group how many values of each column are missing, by its dotted name.

    Columns without a count are left out; so is all of it where the footer cannot be parsed.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - 8))
        tail = file.read(8)
        length = int.from_bytes(tail[:4], "little")
        if tail[4:] != b"PAR1" or length > min(size - 8, LARGEST):
            return []
        file.seek(size - 8 - length)
        content = file.read(length)
    try:
        groups = _Reader(content).struct(0).get(ROW_GROUPS, [])
        return [_of_group(group) for group in groups]
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError):
        return []


def _of_group(group: dict[int, Any]) -> dict[str, int]:
    found: dict[str, int] = {}
    for column in group.get(COLUMNS, []):
        meta = column.get(META_DATA, {})
        count = meta.get(STATISTICS, {}).get(NULL_COUNT)
        if count is not None and count >= 0:
            name = b".".join(meta[PATH]).decode("utf-8", "replace")
            # Of columns with one name, the sum.
            found[name] = found.get(name, 0) + count
    return found


class _Reader:
    """Thrift's compact protocol: a struct is a dictionary by field number."""

    def __init__(self, content: bytes) -> None:
        self.content, self.at = content, 0

    def byte(self) -> int:
        self.at += 1
        return self.content[self.at - 1]

    def varint(self) -> int:
        value = shift = 0
        while True:
            one = self.byte()
            value |= (one & 0x7F) << shift
            shift += 7
            if not one & 0x80:
                return value
            if shift > 63:
                raise ValueError("no number")

    def number(self) -> int:
        value = self.varint()
        return (value >> 1) ^ -(value & 1)

    def bytes(self) -> bytes:
        length = self.varint()
        if length > len(self.content) - self.at:
            raise ValueError("no text")
        self.at += length
        return self.content[self.at - length : self.at]

    def double(self) -> float:
        self.at += 8
        return float(unpack_from("<d", self.content, self.at - 8)[0])

    def struct(self, depth: int) -> dict[int, Any]:
        found: dict[int, Any] = {}
        field = 0
        while head := self.byte():
            field = field + (head >> 4) if head >> 4 else self.number()
            found[field] = self.value(head & 15, depth + 1)
        return found

    def list(self, depth: int) -> list[Any]:
        head = self.byte()
        size = head >> 4 if head >> 4 < 15 else self.varint()
        if size > len(self.content) - self.at:
            raise ValueError("no list")
        return [self.value(head & 15, depth + 1, inside=True) for _ in range(size)]

    def value(self, kind: int, depth: int, *, inside: bool = False) -> Any:
        if depth > DEEPEST:
            raise ValueError("too deep")
        if kind in (1, 2):
            # A field's truth is in its kind, an element's in a byte of its own.
            return self.byte() == 1 if inside else kind == 1
        simple: dict[int, Callable[[], Any]] = {
            3: self.byte, 4: self.number, 5: self.number, 6: self.number, 7: self.double, 8: self.bytes
        }  # fmt: skip
        if kind in simple:
            return simple[kind]()
        if kind in (9, 10):
            return self.list(depth)
        if kind == 12:
            return self.struct(depth)
        raise ValueError("no kind of value that a footer has")
