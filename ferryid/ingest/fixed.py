"""One fixed layout of a message: check gathered messages against it and copy their fields to columns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.layout import PRIMITIVES, Layout, Target
from ferryid.ingest.log import Column

LITTLE_ENDIAN_CDR = int.from_bytes(b"\x00\x01", "little")


GAP_BYTES = 64
"""Fields of a message with more than a cache line between them are copied in pieces of their own."""
SPARSE = 0.75
"""Pieces are worth their calls where they hold less than this part of the message."""

Records = Mapping[str, NDArray[Any]] | NDArray[np.void]
"""Fields of a number of messages by name, each of shape (n,)."""


class Fixed:
    """One layout, ready to be read from gathered messages: a structured dtype over their bytes.

    Attributes
    ----------
    sparse
        Whether `gathered` copies much less than the messages.
    """

    def __init__(self, layout: Layout, cdr: bool, wanted: Mapping[str, Target]) -> None:
        spans: dict[str, tuple[str, int]] = {}
        self._expected: dict[str, int] = {}
        if cdr:
            spans["encapsulation "] = "<u2", 0
            self._expected["encapsulation "] = LITTLE_ENDIAN_CDR
        for offset, value in layout.lengths:
            spans[f"length {offset}"] = "<u4", offset
            self._expected[f"length {offset}"] = value
        for offset in layout.zeros:
            spans[f"terminator {offset}"] = "u1", offset
            self._expected[f"terminator {offset}"] = 0
        for path, (offset, length) in layout.places.items():
            primitive = wanted[path].primitive
            if length:
                spans[path] = f"V{length}" if primitive == "string" else PRIMITIVES[primitive], offset
        self._dtype = _structure(spans, 0, layout.size)
        self._pieces = _pieces(spans)
        self.sparse = sum(dtype.itemsize for _, dtype in self._pieces) < SPARSE * layout.size
        self._wanted = wanted
        self._places = layout.places

    def records(self, messages: NDArray[np.void]) -> Records:
        """Return the fields of whole messages, shape (n,)."""
        return messages.view(self._dtype)

    def gathered(self, buffer: Any, starts: NDArray[np.int64]) -> Records:
        """Copy the fields of the messages that begin at `starts` out of a buffer that holds them whole."""
        size = memoryview(buffer).nbytes
        found: dict[str, NDArray[Any]] = {}
        for offset, dtype in self._pieces:
            # Every window of this size over the buffer, overlapping: indexing it copies pieces at memory speed.
            windows = np.ndarray((size - dtype.itemsize + 1,), f"V{dtype.itemsize}", buffer, strides=(1,))
            piece = windows[starts + offset].view(dtype)
            found |= {name: piece[name] for name in dtype.names or ()}
        return found

    def mismatches(self, records: Records) -> NDArray[np.bool_] | None:
        """Return which messages have another layout, shape (n,), or None when all have this one."""
        wrong: NDArray[np.bool_] | None = None
        for name, value in self._expected.items():
            differs = records[name] != value
            if differs.any():
                wrong = differs if wrong is None else wrong | differs
        return wrong

    def copy(self, records: Records, columns: Mapping[str, Column], rows: Any, picked: Any) -> list[int]:
        """Copy the wanted fields of the picked messages into `rows` of the columns.

        Returns
        -------
        list
            Positions among the picked messages whose strings are not UTF-8.
        """
        undecoded: set[int] = set()
        for path, target in self._wanted.items():
            place = self._places.get(path)
            if place is None:
                columns[path][rows] = None if target.primitive == "string" else math.nan
            elif target.primitive == "string":
                values, faults = _texts(records[path][picked] if place[1] else None, columns[path][rows].shape[0])
                columns[path][rows] = values
                undecoded.update(faults)
            elif target.primitive == "bool":
                columns[path][rows] = records[path][picked] != 0
            else:
                columns[path][rows] = records[path][picked]
        return sorted(undecoded)


def _structure(spans: Mapping[str, tuple[str, int]], first: int, size: int) -> np.dtype[Any]:
    """Return the dtype of `size` bytes from the offset `first` that has the fields (code, offset) of `spans`."""
    return np.dtype(
        {
            "names": list(spans),
            "formats": [code for code, _ in spans.values()],
            "offsets": [offset - first for _, offset in spans.values()],
            "itemsize": size,
        }
    )


def _pieces(spans: Mapping[str, tuple[str, int]]) -> list[tuple[int, np.dtype[Any]]]:
    """Return offset and dtype of the pieces of a message that hold these fields (code, offset)."""
    pieces: list[tuple[int, int, dict[str, tuple[str, int]]]] = []
    for name, (code, offset) in sorted(spans.items(), key=lambda item: item[1][1]):
        end = offset + np.dtype(code).itemsize
        if pieces and offset - pieces[-1][1] <= GAP_BYTES:
            first, last, inside = pieces[-1]
            pieces[-1] = first, max(last, end), {**inside, name: (code, offset)}
        else:
            pieces.append((offset, end, {name: (code, offset)}))
    return [(first, _structure(inside, first, last - first)) for first, last, inside in pieces]


def _texts(raw: NDArray[np.void] | None, count: int) -> tuple[Column, list[int]]:
    """Decode strings of one length; also return the positions of those that are not UTF-8."""
    texts = np.full(count, "", dtype=object)
    faults: list[int] = []
    if raw is None:
        return texts, faults
    known: dict[bytes, str] = {}
    for position, data in enumerate(raw.tolist()):
        text = known.get(data)
        if text is None:
            try:
                text = known[data] = data.decode()
            except UnicodeDecodeError:
                faults.append(position)
                continue
        texts[position] = text
    return texts, faults
