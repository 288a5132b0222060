"""Protobuf messages into columns, with the definitions that the log carries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError, Message
from google.protobuf.message_factory import GetMessageClass
from numpy.typing import NDArray

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.definitions import DefinitionError, FieldList
from ferryid.ingest.log import Loss, Series
from ferryid.ingest.row_columns import INT64, NS_PER_S, RowColumns, Step, path_steps
from ferryid.types import Nanoseconds

TIMESTAMP = "google.protobuf.Timestamp"
# The package's own Descriptor and that of its C implementation have no common type.
Descriptor = Any
STAMP_PATHS = ("header.stamp", "header.timestamp", "timestamp", "stamp")
"""Where a sender's time may stand, if the field is a google.protobuf.Timestamp."""
_TYPES = {
    FieldDescriptor.TYPE_DOUBLE: "float64",
    FieldDescriptor.TYPE_FLOAT: "float32",
    FieldDescriptor.TYPE_INT64: "int64",
    FieldDescriptor.TYPE_UINT64: "uint64",
    FieldDescriptor.TYPE_INT32: "int32",
    FieldDescriptor.TYPE_FIXED64: "uint64",
    FieldDescriptor.TYPE_FIXED32: "uint32",
    FieldDescriptor.TYPE_BOOL: "bool",
    FieldDescriptor.TYPE_STRING: "string",
    FieldDescriptor.TYPE_UINT32: "uint32",
    FieldDescriptor.TYPE_ENUM: "int32",
    FieldDescriptor.TYPE_SFIXED32: "int32",
    FieldDescriptor.TYPE_SFIXED64: "int64",
    FieldDescriptor.TYPE_SINT32: "int32",
    FieldDescriptor.TYPE_SINT64: "int64",
}


MAX_DEFINITION_BYTES = 16 << 20
"""Descriptors of one schema; they need about ten times as much memory."""
MAX_MESSAGE_BYTES = 32 << 20
"""One message; decoded it needs up to thirty times as much memory."""
MAX_NESTED = 100
"""Messages nested in one another, as deep as protobuf itself decodes them."""
_INTEGERS = frozenset({FieldDescriptor.TYPE_INT64, FieldDescriptor.TYPE_INT32})


@lru_cache(maxsize=1024)
def message_class(definition: bytes, name: str) -> type[Message]:
    """Build the class of a message from the FileDescriptorSet in its schema.

    Raises
    ------
    DefinitionError
        Where the set is damaged, incomplete, too large or lacks the message.
    """
    if len(definition) > MAX_DEFINITION_BYTES:
        raise DefinitionError(f"is larger than {MAX_DEFINITION_BYTES >> 20} MiB")
    try:
        files = {file.name: file for file in FileDescriptorSet.FromString(definition).file}
        pool = DescriptorPool()
        added: set[str] = set()

        def add(file_name: str) -> None:
            if file_name in added:
                return
            added.add(file_name)
            for needed in files[file_name].dependency:
                add(needed)
            pool.Add(files[file_name])

        for file_name in files:
            add(file_name)
        made: type[Message] = GetMessageClass(pool.FindMessageTypeByName(name))
    except (DecodeError, KeyError, TypeError, ValueError, RecursionError, MemoryError) as error:
        raise DefinitionError(f"cannot be used ({error})") from error
    return made


def protobuf_fields(definition: bytes, name: str) -> dict[str, str]:
    """List the fields of a message, as `Topic.fields` has them.

    Empty where the definition cannot be used, or has more fields than can be listed.
    """
    try:
        return _listed(message_class(definition, name).DESCRIPTOR)
    except DefinitionError:
        return {}


@lru_cache(maxsize=1024)
def _listed(descriptor: Descriptor) -> dict[str, str]:
    found = FieldList()
    try:
        return found.collect(_leaves(descriptor, "", (), found))
    except DefinitionError:
        return {}


def _leaves(descriptor: Descriptor, prefix: str, above: tuple[str, ...], found: FieldList) -> Iterator[tuple[str, str]]:
    if descriptor.full_name in above:
        return
    if len(above) > MAX_NESTED:
        raise DefinitionError(f"is nested more than {MAX_NESTED} deep")
    for field in descriptor.fields:
        found.visit()
        inner = field.message_type
        if inner is not None and inner.GetOptions().map_entry:
            continue
        path = prefix + field.name + ("[]" if field.is_repeated else "")
        if inner is not None:
            yield from _leaves(inner, path + ".", (*above, descriptor.full_name), found)
        elif field.type == FieldDescriptor.TYPE_BYTES:
            yield path + "[]", "uint8"
        else:
            yield path, _TYPES[field.type]


class ProtobufDecoder:
    """Decoder of one topic of protobuf messages.

    A field that a message does not carry has its protobuf default, unless the definition lets a reader tell that it is
    absent (a sub-message or an ``optional`` field without a default of its own): then it is NaN.

    Parameters
    ----------
    definition, name
        FileDescriptorSet and full name of the message.
    topic
        Name for the Series.
    paths
        Wanted leaf fields.
    where
        File and topic that an error begins with.

    Raises
    ------
    FerryIdError
        For a definition that cannot be used, and for a path that the message does not have.
    """

    def __init__(self, definition: bytes, name: str, topic: str, paths: Sequence[str], where: str) -> None:
        try:
            self._class = message_class(definition, name)
        except DefinitionError as error:
            raise FerryIdError(
                f"{where}: the protobuf definition of {name} {error}, its fields were asked for. "
                "Fix: record again with definitions, or map another topic"
            ) from error
        descriptor = self._class.DESCRIPTOR
        resolved = {path: _resolve(descriptor, path, where) for path in dict.fromkeys(paths)}
        self._wanted = {path: getter for path, (getter, _) in resolved.items()}
        self._stamp = next((path_steps(path) for path in STAMP_PATHS if _is_timestamp(descriptor, path)), None)
        self._rows = RowColumns(topic, paths, {path: primitive for path, (_, primitive) in resolved.items()})

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the messages that lie in `buffer` at `starts` with `sizes` [bytes]; the buffer is not kept."""
        view = memoryview(buffer).cast("B")
        # Methods of the class: a field may have the name of one.
        parse: Any = self._class.ParseFromString
        for start, size, time in zip(starts.tolist(), sizes.tolist(), receive_ns.tolist(), strict=True):
            message = self._class()
            try:
                if size > MAX_MESSAGE_BYTES:
                    raise DecodeError(f"larger than {MAX_MESSAGE_BYTES} bytes")
                parse(message, bytes(view[start : start + size]))
                values = {path: _value(message, steps) for path, steps in self._wanted.items()}
                stamp_ns = self._stamp_ns(message)
            except (DecodeError, MemoryError, UnicodeDecodeError):
                self._rows.corrupt(time)
                continue
            self._rows.row(time, stamp_ns, values)

    def _stamp_ns(self, message: Any) -> int | None:
        if self._stamp is None:
            return None
        for name in self._stamp:
            if not type(message).HasField(message, name):
                return None
            message = getattr(message, str(name))
        stamp_ns = int(message.seconds) * NS_PER_S + int(message.nanos)
        if not INT64.min <= stamp_ns <= INT64.max:
            raise DecodeError(f"a time of {stamp_ns} ns")
        return stamp_ns

    def finish(self) -> Series:
        """Return the columns of every message that could be decoded."""
        return self._rows.series()

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return the messages that could not be decoded."""
        return self._rows.losses(file)


_Getter = tuple[tuple[Step, bool], ...]


def _value(message: Any, steps: _Getter) -> Any:
    for step, tells_absence in steps:
        if isinstance(step, int):
            if step >= len(message):
                return None
            message = message[step]
        elif tells_absence and not type(message).HasField(message, step):
            return None
        else:
            message = getattr(message, step)
    if isinstance(message, bytes):
        # What the package returns for a string that is not UTF-8; of a field of bytes, single ones are taken.
        raise DecodeError("a string is not UTF-8")
    return message


def _is_timestamp(descriptor: Descriptor, path: str) -> bool:
    for name in path.split("."):
        field = descriptor.fields_by_name.get(name)
        if field is None or field.is_repeated or field.message_type is None:
            return False
        descriptor = field.message_type
    fields = [descriptor.fields_by_name.get(name) for name in ("seconds", "nanos")]
    plain = all(field is not None and not field.is_repeated and field.type in _INTEGERS for field in fields)
    return plain and bool(descriptor.full_name == TIMESTAMP)


def _resolve(descriptor: Descriptor, path: str, where: str) -> tuple[_Getter, str]:
    """Return the steps to a leaf and its primitive type; FerryIdError where there is no such leaf."""

    def fault(found: str) -> FerryIdError:
        leaves = [leaf.replace("[]", "[0]") for leaf in _listed(root)]
        return FerryIdError(
            f"{where}: no field {path!r} of {root.full_name}, found {found}. "
            f"Fix: name one of its fields.{did_you_mean(path, leaves)}"
        )

    root = descriptor
    steps = path_steps(path)
    if steps is None:
        raise fault("that it is not a path")
    getter: list[tuple[Step, bool]] = []
    here: Descriptor | None = descriptor
    primitive = ""
    lists = 0
    for step in steps:
        if isinstance(step, int):
            if not lists:
                raise fault(f"that {getter[-1][0]} holds one value")
            lists -= 1
            getter.append((step, False))
            continue
        if lists:
            raise fault(f"that {getter[-1][0]} holds several values")
        field = None if here is None else here.fields_by_name.get(step)
        if field is None or here is None:
            shown = "no fields" if here is None else ", ".join(entry.name for entry in here.fields[:8])
            raise fault(shown or "an empty message")
        tells = field.has_presence and not (field.message_type is None and field.has_default_value)
        getter.append((step, tells))
        is_bytes = field.type == FieldDescriptor.TYPE_BYTES
        lists = int(field.is_repeated) + int(is_bytes)
        here = field.message_type
        primitive = "uint8" if is_bytes else _TYPES.get(field.type, "")
    if lists:
        raise fault("that it holds several values")
    if here is not None:
        raise fault(f"that it is a message of type {here.full_name}")
    return tuple(getter), primitive
