"""JSON messages into columns."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.definitions import DefinitionError, FieldList
from ferryid.ingest.log import Loss, Series
from ferryid.ingest.row_columns import INT64, NS_PER_S, RowColumns, Step, path_steps
from ferryid.types import Nanoseconds

STAMP_PATHS: tuple[tuple[str, ...], ...] = (("header", "stamp"), ("timestamp",), ("stamp",))
_SECONDS = ("sec", "secs", "seconds")
_NANOSECONDS = ("nsec", "nanosec", "nsecs", "nanos", "nanoseconds")
_TYPES = {"number": "float64", "integer": "int64", "boolean": "bool", "string": "string"}
MAX_DEPTH = 20
MAX_SCHEMA_BYTES = 4 << 20
MAX_MESSAGE_BYTES = 16 << 20
"""One message; parsed it needs up to thirty times as much memory."""
# What json.loads raises for a text that is no JSON, is nested too deep or holds a number of too many digits.
JSON_ERRORS = (ValueError, RecursionError, MemoryError)


def schema_fields(schema: bytes) -> dict[str, str]:
    """List the fields that a JSON schema declares, as `Topic.fields` has them.

    Empty where it declares none, or more than can be listed.
    """
    if len(schema) > MAX_SCHEMA_BYTES:
        return {}
    try:
        return FieldList().collect(_declared(json.loads(schema), "", 0))
    except (DefinitionError, *JSON_ERRORS):
        return {}


def _declared(schema: Any, prefix: str, depth: int) -> Iterator[tuple[str, str]]:
    if not isinstance(schema, Mapping) or depth > MAX_DEPTH:
        return
    kind = schema.get("type")
    if isinstance(kind, list):
        kind = next((one for one in kind if one != "null"), None)
    if not isinstance(kind, str):
        kind = None
    properties = schema.get("properties")
    if isinstance(properties, Mapping):
        for name, inner in properties.items():
            name = _text(name)
            yield from _declared(inner, f"{prefix}.{name}" if prefix else name, depth + 1)
    elif kind == "array":
        yield from _declared(schema.get("items"), f"{prefix}[]", depth + 1)
    elif kind in _TYPES and prefix:
        yield prefix, _TYPES[kind]


def sample_fields(message: bytes) -> dict[str, str]:
    """List the fields of one message, for a topic without a schema; empty where they are more than can be listed."""
    try:
        return _listed(_parsed(message))
    except JSON_ERRORS:
        return {}


def _parsed(message: bytes) -> Any:
    if len(message) > MAX_MESSAGE_BYTES:
        raise ValueError(f"larger than {MAX_MESSAGE_BYTES} bytes")
    return json.loads(message)


def _listed(message: Any) -> dict[str, str]:
    try:
        return FieldList().collect(_present(message, "", 0))
    except DefinitionError:
        return {}


def _text(value: str) -> str:
    """Return a text without halves of surrogate pairs, which JSON can write down but no file or terminal takes."""
    return value if value.isascii() else value.encode(errors="replace").decode()


def _present(value: Any, prefix: str, depth: int) -> Iterator[tuple[str, str]]:
    if depth > MAX_DEPTH:
        return
    if isinstance(value, dict):
        for name, inner in value.items():
            name = _text(name)
            yield from _present(inner, f"{prefix}.{name}" if prefix else name, depth + 1)
    elif isinstance(value, list):
        if value:
            yield from _present(value[0], f"{prefix}[]", depth + 1)
    elif prefix:
        kind = "bool" if isinstance(value, bool) else "string" if isinstance(value, str) else "float64"
        yield prefix, kind


class JsonDecoder:
    """Decoder of one topic of JSON messages; a value that a message lacks, or null, is NaN.

    Parameters
    ----------
    topic
        Name for the Series.
    paths
        Wanted leaf fields.
    where
        File and topic that an error begins with.

    Raises
    ------
    FerryIdError
        For a path that cannot be one; `finish` raises it for a path that no message has.
    """

    def __init__(self, topic: str, paths: Sequence[str], where: str) -> None:
        self._where = where
        self._wanted: dict[str, tuple[Step, ...]] = {}
        for path in paths:
            steps = path_steps(path)
            if steps is None:
                raise FerryIdError(
                    f"{where}: {path!r} names no field, found a path that cannot be split. "
                    "Fix: write it as name.name[0]"
                )
            self._wanted[path] = steps
        self._rows = RowColumns(topic, paths, {})
        self._fields: dict[str, str] | None = None

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the messages that lie in `buffer` at `starts` with `sizes` [bytes]; the buffer is not kept."""
        view = memoryview(buffer).cast("B")
        for start, size, time in zip(starts.tolist(), sizes.tolist(), receive_ns.tolist(), strict=True):
            data = bytes(view[start : start + size])
            try:
                message = _parsed(data)
            except JSON_ERRORS:
                self._rows.corrupt(time)
                continue
            stamp_ns = _stamp_ns(message)
            if stamp_ns is not None and not INT64.min <= stamp_ns <= INT64.max:
                self._rows.corrupt(time)
                continue
            if self._fields is None:
                self._fields = _listed(message)
            values = {path: _leaf(message, steps) for path, steps in self._wanted.items()}
            self._rows.row(time, stamp_ns, values)

    def finish(self) -> Series:
        """Return the columns of every message that could be decoded.

        Raises
        ------
        FerryIdError
            For a path that none of the messages has.
        """
        for path in self._wanted:
            first = re.sub(r"\[[0-9]+\]", "[0]", path)
            if first != path and first in self._wanted and self._rows.seen(first):
                continue  # a longer array than any message has
            if len(self._rows) and not self._rows.seen(path):
                fields = list(self._fields or ())
                shown = ", ".join(fields[:8]) or "no fields"
                plain = [name.replace("[]", "[0]") for name in fields]
                raise FerryIdError(
                    f"{self._where}: no JSON message has a value at {path!r}, found {shown}. "
                    f"Fix: name one of the fields.{did_you_mean(path, plain)}"
                )
        return self._rows.series()

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return the messages that could not be decoded."""
        return self._rows.losses(file)


def _leaf(message: Any, steps: Sequence[Step]) -> Any:
    for step in steps:
        if isinstance(step, int):
            if not isinstance(message, list) or step >= len(message):
                return None
            message = message[step]
        else:
            if not isinstance(message, dict):
                return None
            message = message.get(step)
    if isinstance(message, str):
        return _text(message)
    return None if isinstance(message, (dict, list)) else message


def _stamp_ns(message: Any) -> int | None:
    for path in STAMP_PATHS:
        place = message
        for name in path:
            place = place.get(name) if isinstance(place, dict) else None
        if isinstance(place, dict):
            seconds = next((place[name] for name in _SECONDS if isinstance(place.get(name), int)), None)
            rest = next((place[name] for name in _NANOSECONDS if isinstance(place.get(name), int)), None)
            if seconds is not None and rest is not None:
                return int(seconds) * NS_PER_S + int(rest)
    return None
