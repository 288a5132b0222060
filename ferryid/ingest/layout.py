"""Where the fields of a serialised ROS message lie: the schema walked on one sample."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean

PRIMITIVES: Mapping[str, str] = {
    "bool": "u1",
    "byte": "i1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}
SIZES: Mapping[str, int] = {name: int(np.dtype(code).itemsize) for name, code in PRIMITIVES.items()}
HEADER_TYPE = "std_msgs/msg/Header"
# rosbags gives an empty message this member; ROS2 serialises it as one byte, ROS1 as nothing.
EMPTY_MEMBER = "structure_needs_at_least_one_member"
MAX_DEPTH = 40
MAX_STEPS = 20_000
MAX_CHECKS = 256

Step = tuple[str, int | None]


class LayoutError(Exception):
    """A sample that its schema does not fit, or whose layout is not worth fixing; the ordinary decoder judges it."""


@dataclass(frozen=True)
class Target:
    """One wanted field: its path as steps of (name, index or None) and its primitive type.

    `optional` is True where the path goes through a sequence, so that a message may lack the element.
    """

    path: str
    steps: tuple[Step, ...]
    primitive: str
    optional: bool

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the column: the file's own, or a float that can hold NaN where an element may be absent."""
        if self.primitive == "string":
            return np.dtype(object)
        if self.optional:
            return np.dtype(np.float32 if self.primitive == "float32" else np.float64)
        return np.dtype(np.bool_) if self.primitive == "bool" else np.dtype(PRIMITIVES[self.primitive])


@dataclass(frozen=True)
class Layout:
    """Offsets [bytes] of the wanted fields in every message that has these lengths.

    Attributes
    ----------
    size
        Total length of the message.
    places
        Path to (offset, length) of the wanted fields that are present; a string's without its terminator.
    lengths
        (offset, value) of every string and sequence length, which together with `size` fix the layout.
    zeros
        Offsets of string terminators (CDR).
    """

    size: int
    places: Mapping[str, tuple[int, int]]
    lengths: tuple[tuple[int, int], ...]
    zeros: tuple[int, ...]


def leaf_fields(typestore: Any, msgtype: str) -> dict[str, str]:
    """List the fields of a message type: leaf path to primitive type, in message order.

    Parameters
    ----------
    typestore
        rosbags Typestore that holds the type.
    msgtype
        Normalised type name, ``"nav_msgs/msg/Odometry"``.

    Returns
    -------
    dict
        Fixed arrays appear once as ``name[36]``, sequences as ``name[]``; empty when a definition is missing.
    """
    try:
        return dict(_leaves(typestore, msgtype, "", 0))
    except (KeyError, LayoutError):
        return {}


def _leaves(typestore: Any, msgtype: str, prefix: str, depth: int) -> Iterator[tuple[str, str]]:
    if depth > MAX_DEPTH:
        raise LayoutError(f"{msgtype} is nested more than {MAX_DEPTH} deep")
    for name, desc in typestore.fielddefs[msgtype][1]:
        if name == EMPTY_MEMBER:
            continue
        kind, inner = desc
        path = prefix + name
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            (kind, inner), count = inner
            path += f"[{count}]" if desc[0] == Nodetype.ARRAY else "[]"
        if kind == Nodetype.BASE:
            yield path, inner[0]
        else:
            yield from _leaves(typestore, inner, path + ".", depth + 1)


def targets(typestore: Any, msgtype: str, paths: Sequence[str], where: str) -> tuple[Target, ...]:
    """Resolve wanted paths against the message type.

    Raises
    ------
    FerryIdError
        For a path that the type does not have, or that is not one number, truth value or string.
    """
    return tuple(_target(typestore, msgtype, path, where) for path in dict.fromkeys(paths))


def _target(typestore: Any, msgtype: str, path: str, where: str) -> Target:
    def fault(found: str, remedy: str) -> FerryIdError:
        return FerryIdError(f"{where}: no field {path!r} of {msgtype}, {found}. Fix: {remedy}")

    leaves = leaf_fields(typestore, msgtype)
    current, optional = msgtype, False
    steps: list[Step] = []
    parts = path.split(".")
    for position, part in enumerate(parts):
        match = re.fullmatch(r"(\w+)(?:\[([0-9]{1,10})\])?", part)
        fields = dict(typestore.fielddefs[current][1])
        if match is None or match[1] not in fields:
            shown = ", ".join(name for name in list(fields)[:8] if name != EMPTY_MEMBER)
            plain = {re.sub(r"\[\d*\]", "[0]", leaf) for leaf in leaves}
            raise fault(
                f"found {shown or 'an empty message'} in {current}",
                f"name one of its fields.{did_you_mean(path, plain)}",
            )
        name, index = match[1], None if match[2] is None else int(match[2])
        kind, inner = fields[name]
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            fixed = kind == Nodetype.ARRAY
            (kind, inner), count = inner
            if index is None:
                raise fault(f"found that {name} holds several values", f"name one of them, {name}[0]")
            if fixed and index >= count:
                raise fault(f"found an array of {count}", f"take an index from 0 to {count - 1}")
            optional = optional or not fixed
        elif index is not None:
            raise fault(f"found that {name} is one value", f"write {name} without an index")
        steps.append((name, index))
        last = position == len(parts) - 1
        if kind == Nodetype.BASE:
            primitive = inner[0]
            if not last:
                raise fault(f"found that {name} is a {primitive}", "end the path there")
            if primitive != "string" and primitive not in PRIMITIVES:
                raise fault(f"found the type {primitive}, which cannot be read", "map another field")
            return Target(path, tuple(steps), primitive, optional)
        current = inner
    inside = [re.sub(r"\[\d*\]", "[0]", leaf) for leaf in leaf_fields(typestore, current)]
    raise fault(
        f"found that it is a message of type {current}",
        f"name one value in it, such as {path}.{inside[0]}" if inside else "map another field",
    )


def stamp_path(typestore: Any, msgtype: str) -> str | None:
    """Return the path of the header stamp when the type is a Header or begins with one, else None."""
    if msgtype == HEADER_TYPE:
        return "stamp"
    fields = typestore.fielddefs[msgtype][1]
    if fields and fields[0][1] == (Nodetype.NAME, HEADER_TYPE):
        return f"{fields[0][0]}.stamp"
    return None


@dataclass
class Walk:
    """One walk of the schema over one sample; `run` gives its Layout."""

    typestore: Any
    data: bytes
    cdr: bool
    wanted: Mapping[Any, Any]
    most_steps: int = MAX_STEPS
    position: int = 0
    steps: int = 0
    places: dict[str, tuple[int, int]] = field(default_factory=dict)
    lengths: list[tuple[int, int]] = field(default_factory=list)
    zeros: list[int] = field(default_factory=list)

    def run(self, msgtype: str) -> Layout:
        """Walk the whole message.

        Raises
        ------
        LayoutError
            Where the sample does not fit its schema, or is not little-endian plain CDR.
        """
        size = len(self.data)
        self.count(msgtype)
        # CDR messages may carry up to three bytes of padding behind the last field.
        if not self.position <= size <= self.position + (3 if self.cdr else 0):
            raise LayoutError(f"{counted(size, 'byte')}, the schema takes {self.position}")
        if len(self.lengths) > MAX_CHECKS:
            raise LayoutError("too many lengths to check")
        return Layout(size, self.places, tuple(self.lengths), tuple(self.zeros))

    def count(self, msgtype: str) -> int:
        """Walk all fields and return how many values, strings and messages there are, arrays of numbers as one.

        Raises
        ------
        LayoutError
            For more than `most_steps`, and where the sample does not fit its schema or is not little-endian plain CDR.
        """
        if self.cdr:
            # Identifiers 0x0000 and 0x0001 are plain CDR; ROS2 has no other, and only the little-endian one is fast.
            if self.data[:2] != b"\x00\x01":
                raise LayoutError("not little-endian CDR")
            self.position = 4
        self._message(msgtype, self.wanted, 0)
        return self.steps

    def _align(self, size: int) -> None:
        if self.cdr:
            # The alignment counts from behind the four bytes of the encapsulation header.
            self.position += -(self.position - 4) % size

    def _take(self, size: int) -> int:
        start = self.position
        self.position += size
        if self.position > len(self.data):
            raise LayoutError("too short for its schema")
        return start

    def _length(self) -> int:
        self._align(4)
        start = self._take(4)
        value = int(struct.unpack_from("<I", self.data, start)[0])
        self.lengths.append((start, value))
        return value

    def _string(self) -> tuple[int, int]:
        length = self._length()
        start = self._take(length)
        if not self.cdr:
            return start, length
        if length == 0 or self.data[start + length - 1] != 0:
            raise LayoutError("string without its terminator")
        self.zeros.append(start + length - 1)
        return start, length - 1

    def _message(self, msgtype: str, wanted: Mapping[Any, Any], depth: int) -> None:
        if depth > MAX_DEPTH:
            raise LayoutError(f"{msgtype} is nested more than {MAX_DEPTH} deep")
        for name, (kind, inner) in self.typestore.fielddefs[msgtype][1]:
            if name == EMPTY_MEMBER and not self.cdr:
                continue
            below = wanted.get(name, {})
            if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                (kind, inner), count = inner[0], inner[1] if kind == Nodetype.ARRAY else self._length()
                self._elements(kind, inner, count, below, depth)
            else:
                self._one(kind, inner, below.get(None, {}), depth)

    def _one(self, kind: Nodetype, inner: Any, wanted: Any, depth: int) -> None:
        self.steps += 1
        if self.steps > self.most_steps:
            raise LayoutError("too many elements to walk")
        if kind == Nodetype.NAME:
            self._message(inner, wanted, depth + 1)
        elif inner[0] == "string":
            place = self._string()
            if wanted:
                self.places[wanted] = place
        else:
            size = SIZES.get(inner[0])
            if size is None:
                raise LayoutError(f"type {inner[0]}")
            self._align(size)
            start = self._take(size)
            if wanted:
                self.places[wanted] = start, size

    def _elements(self, kind: Nodetype, inner: Any, count: int, wanted: Mapping[Any, Any], depth: int) -> None:
        if kind == Nodetype.BASE and inner[0] in SIZES:
            size = SIZES[inner[0]]
            if count:
                self._align(size)
            start = self._take(size * count)
            for index, path in wanted.items():
                if index is not None and index < count:
                    self.places[path] = start + index * size, size
            return
        for index in range(count):
            self._one(kind, inner, wanted.get(index, {}), depth)


def tree(wanted: Sequence[Target]) -> dict[Any, Any]:
    """Arrange targets as nested mappings name → index (None for a single value) → what is below, or the path."""
    root: dict[Any, Any] = {}
    for target in wanted:
        node = root
        for name, index in target.steps[:-1]:
            node = node.setdefault(name, {}).setdefault(index, {})
        name, index = target.steps[-1]
        node.setdefault(name, {})[index] = target.path
    return root
