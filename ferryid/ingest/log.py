"""What every reader of a log returns: topics, series of columns, and what was lost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from ferryid.errors import one_line
from ferryid.types import Nanoseconds

Column = NDArray[Any]


@dataclass(frozen=True)
class Topic:
    """One topic of a log as its index (or its header row) describes it, before anything is decoded.

    Attributes
    ----------
    name
        Topic name with its leading slash; ``"table"`` for a log that is one wide table.
    type
        Message type (``"nav_msgs/msg/Odometry"``), or ``"table"``.
    encoding
        ``"ros1"``, ``"cdr"``, ``"protobuf"``, ``"json"``, ``"ulog"``, ``"dataflash"`` or ``"table"``.
    count
        Number of messages (rows).
    start_ns, end_ns
        First and last receive time [ns], None when the topic is empty, or no time of it agrees with those of the others.
    fields
        Leaf path to primitive type, in message order: ``{"pose.position.x": "float64"}``. Elements of arrays are
        addressed as ``name[3]``; a fixed array is listed once as ``name[36]`` with its length, a sequence
        as ``name[]``, where not `lists_elements`. Empty when the definition could not be read.
    note
        What a user must know of this topic (``"receive times only: no header"``), or an empty string.
    """

    name: str
    type: str
    encoding: str
    count: int
    start_ns: int | None
    end_ns: int | None
    fields: Mapping[str, str]
    note: str = ""

    @property
    def lists_elements(self) -> bool:
        """True where every element of an array is a field of its own (``q[0]``, ``q[1]``), or there are no arrays."""
        return self.encoding in ("table", "ulog", "dataflash")


@dataclass(frozen=True)
class Loss:
    """Something of a file that could not be read: where it was, and how much.

    ``messages`` and the times [ns] are None where the damage hides them. ``lost_ns`` is the length of several lost stretches
    between those times [ns], None where it is one. ``what`` is one plain sentence; what it quotes of the file is escaped.
    """

    file: str
    what: str
    topic: str | None = None
    messages: int | None = None
    start_ns: int | None = None
    end_ns: int | None = None
    lost_ns: int | None = None

    def __post_init__(self) -> None:
        for name in ("file", "what"):
            object.__setattr__(self, name, one_line(getattr(self, name)))
        if self.topic is not None:
            object.__setattr__(self, "topic", one_line(self.topic))

    @property
    def costs_messages(self) -> bool:
        """False where no message is lost: what was wrong was repaired, and is a remark."""
        return self.messages != 0

    @property
    def length_ns(self) -> int | None:
        """Length of what is lost [ns], None where it is not known."""
        if self.start_ns is None or self.end_ns is None:
            return None
        return self.end_ns - self.start_ns if self.lost_ns is None else self.lost_ns

    @property
    def seconds(self) -> float | None:
        """Length of what is lost [s], None where it is not known."""
        return None if self.length_ns is None else self.length_ns * 1e-9


@dataclass(frozen=True)
class Series:
    """The wanted columns of one topic, in the order in which the file holds them; nothing repaired yet.

    Attributes
    ----------
    topic
        Topic name.
    receive_ns
        Receive (recorder) time of every message, int64 nanoseconds since 1970, shape (n,).
    stamp_ns
        Header stamp of every message, int64 nanoseconds, shape (n,); None for a type without a header.
    columns
        Field path to values, shape (n,), in the file's own type (floats, integers, booleans or strings).
        A message that lacks a wanted element of a sequence has NaN there.
    time_column
        Column of a table that `receive_ns` was read from; an empty string for messages, which a recorder received.
    """

    topic: str
    receive_ns: Nanoseconds
    stamp_ns: Nanoseconds | None
    columns: Mapping[str, Column]
    time_column: str = ""


@dataclass(frozen=True)
class TableLayout:
    """How to read a text, CSV or Parquet table; a vessel profile states it under ``[table]``.

    Attributes
    ----------
    time
        Column that holds the time; an empty string takes the first column that looks like one.
    time_unit
        ``"s"``, ``"ms"``, ``"us"``, ``"ns"`` or ``"datetime"``.
    stamp
        Columns of the sender's stamp, ``()`` where there is none; two columns are seconds and nanoseconds.
    columns
        Names for the columns of a file without a header row; ``()`` reads them from the file.
    skip_rows
        Lines before the first row (or before the header row).
    separator
        ``","``, ``";"``, a tab, or ``"whitespace"``.
    encoding
        Text encoding.
    """

    time: str = ""
    time_unit: str = "s"
    stamp: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    skip_rows: int = 0
    separator: str = ","
    encoding: str = "utf-8"


class Reader(Protocol):
    """A log opened by the module of its format. Opening reads the index, never the messages."""

    paths: tuple[Path, ...]
    topics: tuple[Topic, ...]
    losses: tuple[Loss, ...]
    """What is known to be lost so far; complete only after `read`."""

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics and nothing else.

        Parameters
        ----------
        wanted
            Topic name to field paths; no paths decode times and header stamps only.
        verify
            Read the whole file and check every checksum, also of what is not wanted.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have, with the nearest name.
        """
        ...


@dataclass(frozen=True)
class Format:
    """One log format: how to recognise it and how to open it. Every module in `formats` exports one as FORMAT.

    Attributes
    ----------
    name
        Short name for messages: ``"ROS1 bag"``.
    matches
        ``matches(path, head)`` tells from the path (a file or a folder) and its first 64 bytes (empty for a folder)
        whether this format takes it.
    open
        ``open(path, layout)`` returns a Reader, or raises FerryIdError.
    order
        Formats are asked in ascending order; those that recognise content come before those that go by the name.
    suffixes
        How the names of its files usually end, in lower case; empty for a folder.
    parts
        True where files in one folder whose names end so are the parts of one recording.
    """

    name: str
    matches: Any
    open: Any
    order: int = 50
    suffixes: tuple[str, ...] = ()
    parts: bool = False
