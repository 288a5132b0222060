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


class Fixed:
    """One layout, ready to be read from gathered messages: a structured dtype over their bytes."""

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
        self._dtype = np.dtype(
            {
                "names": list(spans),
                "formats": [code for code, _ in spans.values()],
                "offsets": [offset for _, offset in spans.values()],
                "itemsize": layout.size,
            }
        )
        self._wanted = wanted
        self._places = layout.places

    def mismatches(self, messages: NDArray[np.void]) -> NDArray[np.bool_] | None:
        """Return which messages have another layout, shape (n,), or None when all have this one."""
        records = messages.view(self._dtype)
        wrong: NDArray[np.bool_] | None = None
        for name, value in self._expected.items():
            differs = records[name] != value
            if differs.any():
                wrong = differs if wrong is None else wrong | differs
        return wrong

    def copy(self, messages: NDArray[np.void], columns: Mapping[str, Column], rows: Any, picked: Any) -> list[int]:
        """Copy the wanted fields of the picked messages into `rows` of the columns.

        Returns
        -------
        list
            Positions among the picked messages whose strings are not UTF-8.
        """
        records = messages.view(self._dtype)
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
