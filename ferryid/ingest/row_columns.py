"""Columns collected row by row, for message encodings that have no fixed layout."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ferryid.ingest.log import Column, Loss, Series

NS_PER_S = 1_000_000_000
INT64 = np.iinfo(np.int64)
Step = str | int
_NOT_FINITE = {"NaN": np.nan, "Infinity": np.inf, "-Infinity": -np.inf}
"""How JSON writers spell the numbers that JSON does not have."""


def path_steps(path: str) -> tuple[Step, ...] | None:
    """Split ``"pose.covariance[3].x"`` into names and indices; None for a path that is not one."""
    steps: list[Step] = []
    for part in path.split("."):
        match = re.fullmatch(r"([^\[\]]+)((?:\[[0-9]{1,10}\])*)", part)
        if match is None:
            return None
        steps.append(match[1])
        steps.extend(int(index) for index in re.findall(r"[0-9]+", match[2]))
    return tuple(steps)


class RowColumns:
    """Grows one list per wanted path; a value that a message lacks is None until `series` makes it NaN."""

    def __init__(self, topic: str, paths: Sequence[str], types: Mapping[str, str]) -> None:
        self._topic = topic
        self._types = types
        self._values: dict[str, list[Any]] = {path: [] for path in dict.fromkeys(paths)}
        self._receive: list[int] = []
        self._stamps: list[int | None] = []
        self._corrupt: list[int] = []

    def row(self, receive_ns: int, stamp_ns: int | None, values: Mapping[str, Any]) -> None:
        """Add one message."""
        self._receive.append(receive_ns)
        self._stamps.append(stamp_ns)
        for path, collected in self._values.items():
            collected.append(values.get(path))

    def corrupt(self, receive_ns: int) -> None:
        """Count one message that could not be decoded."""
        self._corrupt.append(receive_ns)

    def seen(self, path: str) -> bool:
        """Tell whether any message had this path."""
        return any(value is not None for value in self._values[path])

    def __len__(self) -> int:
        return len(self._receive)

    def series(self) -> Series:
        """Return what was collected."""
        stamps = [stamp for stamp in self._stamps if stamp is not None]
        whole = bool(stamps) and len(stamps) == len(self._receive)
        return Series(
            topic=self._topic,
            receive_ns=np.array(self._receive, np.int64),
            # A stamp that only some messages carry would leave the others without a time.
            stamp_ns=np.array(stamps, np.int64) if whole else None,
            columns={path: _column(values, self._types.get(path)) for path, values in self._values.items()},
        )

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return the messages that could not be decoded."""
        if not self._corrupt:
            return ()
        what = "messages are corrupt and were left out"
        return (Loss(file, what, self._topic, len(self._corrupt), min(self._corrupt), max(self._corrupt)),)


def _column(values: list[Any], primitive: str | None) -> Column:
    """Turn values into the narrowest column that holds them; absent numbers become NaN."""
    present = [value for value in values if value is not None]
    texts = {value for value in present if isinstance(value, str)}
    if texts and texts <= _NOT_FINITE.keys() and any(isinstance(value, (int, float)) for value in present):
        values = [_NOT_FINITE.get(value, value) if isinstance(value, str) else value for value in values]
        return _column(values, primitive)
    if texts or primitive == "string":
        column = np.empty(len(values), object)
        column[:] = values
        return column
    absent = len(present) < len(values)
    if primitive is None:
        if not absent and all(isinstance(value, bool) for value in present):
            return np.array(values, np.bool_)
        whole = all(isinstance(value, int) and INT64.min <= value <= INT64.max for value in present)
        try:
            return np.array(values, np.int64 if whole and not absent else np.float64)
        except OverflowError:
            # An integer beyond what a float holds, which as 1e400 would have been infinite too.
            return np.array([_nearest_float(value) for value in values], np.float64)
    if absent:
        return np.array(values, np.float32 if primitive == "float32" else np.float64)
    return np.array(values, np.bool_ if primitive == "bool" else np.dtype(primitive))


def _nearest_float(value: Any) -> float:
    if value is None:
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
