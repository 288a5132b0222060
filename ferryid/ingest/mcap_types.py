"""What the channels of an MCAP file carry: type, fields and decoder, from the schema in the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal

from mcap.records import Channel, Schema
from rosbags.typesys.msg import normalize_msgtype

from ferryid.errors import FerryIdError
from ferryid.ingest.bulk import Decoder, decoder_for, leaf_fields
from ferryid.ingest.definitions import DefinitionError, parse_definition, typestore_of
from ferryid.ingest.json_messages import JsonDecoder, sample_fields, schema_fields
from ferryid.ingest.layout import EMPTY_MEMBER
from ferryid.ingest.ros2_types import Definition, define

MESSAGE_ENCODINGS = ("ros1", "cdr", "protobuf", "json")
_SCHEMA_ENCODINGS = {
    "ros1": ("ros1msg",),
    "cdr": ("ros2msg", "ros2idl", "omgidl"),
    "protobuf": ("protobuf",),
    "json": ("jsonschema", ""),
}
_SERVICE = re.compile(rb"^---\s*$", re.MULTILINE)


class LazyFields(Mapping[str, str]):
    """Fields of a topic, read from its definition when first asked for: most topics of a log are never asked."""

    def __init__(self, load: Callable[[], Mapping[str, str]]) -> None:
        self._load = load
        self._fields: Mapping[str, str] | None = None

    def _loaded(self) -> Mapping[str, str]:
        if self._fields is None:
            self._fields = self._load()
        return self._fields

    def __getitem__(self, path: str) -> str:
        return self._loaded()[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._loaded())

    def __len__(self) -> int:
        return len(self._loaded())

    def __repr__(self) -> str:
        return repr(dict(self._loaded()))

    def __reduce__(self) -> tuple[type[dict[str, str]], tuple[dict[str, str]]]:
        return dict, (dict(self._loaded()),)


def type_name(channel: Channel, schema: Schema | None) -> str:
    """Return the name of a channel's message type, ROS types as ``package/msg/Name``."""
    if schema is None:
        return ""
    return _ros_name(schema.name) if channel.message_encoding in ("ros1", "cdr") else schema.name


@lru_cache(maxsize=4096)
def _ros_name(name: str) -> str:
    return str(normalize_msgtype(name)) if re.fullmatch(r"\w+/\w+|\w+/msg/\w+", name) else name


def problem(channel: Channel, schema: Schema | None) -> str:
    """Say why messages of this channel cannot be decoded; an empty string where they can."""
    encoding = channel.message_encoding
    if encoding not in MESSAGE_ENCODINGS:
        return f"message encoding {encoding!r} cannot be decoded"
    if schema is None:
        if encoding == "json":
            return ""
        return "its schema is not in the file" if channel.schema_id else "the channel has no schema"
    if not schema.data and (encoding == "protobuf" or (encoding == "cdr" and not schema.encoding)):
        if encoding == "protobuf" or _bundled(channel, schema).typestore is None:
            return "the schema holds no definition"
        return ""
    if schema.encoding not in _SCHEMA_ENCODINGS[encoding]:
        return f"schema encoding {schema.encoding!r} does not fit messages in {encoding}"
    if schema.encoding == "ros2msg" and _SERVICE.search(schema.data):
        return "the definition recorded is that of a service, not of its events"
    return ""


def remark(channel: Channel, schema: Schema | None) -> str:
    """Say what a user must know of a channel that can be decoded."""
    if channel.message_encoding == "cdr" and schema is not None and not schema.data:
        bundled = _bundled(channel, schema)
        return bundled.note if bundled.fields else ""
    return ""


def _bundled(channel: Channel, schema: Schema) -> Definition:
    """Return the definition that rosbags bundles, for a ROS2 type without a usable one in the file."""
    return define(type_name(channel, schema), None, channel.metadata.get("topic_type_hash", ""), "")


@lru_cache(maxsize=4096)
def _typestore(name: str, schema_encoding: str, definition: bytes) -> Any:
    """Return a rosbags Typestore that holds one schema alone, or the fault of that schema as a text."""
    try:
        store = typestore_of(parse_definition(definition.decode(), name, schema_encoding))
    except UnicodeDecodeError:
        return f"the definition of {name} is not UTF-8"
    except DefinitionError as error:
        return f"the definition of {name} {error}"
    return store if name in store.fielddefs else f"the definition of {name} describes other types"


def fields_of(channel: Channel, schema: Schema | None, first: Callable[[], bytes]) -> Mapping[str, str]:
    """Return the fields of a channel's messages; `first` gives one message, for JSON without a schema."""
    if problem(channel, schema):
        return {}
    name, definition = type_name(channel, schema), b"" if schema is None else schema.data
    encoding = channel.message_encoding
    if encoding == "protobuf":
        return LazyFields(lambda: _protobuf_fields(definition, name))
    if encoding == "json":
        return LazyFields(lambda: schema_fields(definition) or sample_fields(first()))
    return LazyFields(lambda: _ros_definition(channel, schema).fields)


def _protobuf_fields(definition: bytes, name: str) -> Mapping[str, str]:
    # The package of protobuf takes a tenth of a second to load.
    from ferryid.ingest.protobuf import protobuf_fields

    return protobuf_fields(definition, name)


def _ros_definition(channel: Channel, schema: Schema | None) -> Definition:
    """Return the definition in the file, or the one that rosbags bundles, with a note, where that cannot be used."""
    if schema is None:
        return Definition(None, {}, "the channel has no schema")
    name = type_name(channel, schema)
    bundled = _bundled(channel, schema) if not schema.data and channel.message_encoding == "cdr" else None
    if bundled is not None and bundled.fields:
        return bundled
    store = _typestore(name, schema.encoding, schema.data)
    if isinstance(store, str):
        bundled = _bundled(channel, schema)
        if channel.message_encoding == "cdr" and bundled.typestore is not None:
            return replace(bundled, note=f"{store}; {bundled.note}")
        return Definition(None, {}, store)
    fields = leaf_fields(store, name)
    members = [member for member, _ in store.fielddefs[name][1] if member != EMPTY_MEMBER]
    if members and not fields:
        return Definition(None, {}, f"the definition of {name} lacks a type that it is made of")
    return Definition(store, fields, "")


def decoder_of(
    channel: Channel, schema: Schema | None, paths: Sequence[str], capacity: int, where: str
) -> tuple[Decoder, str]:
    """Return a decoder for a channel's messages, and a note where another definition than the file's stands in.

    Raises
    ------
    FerryIdError
        Where they cannot be decoded, or for a path that they do not have.
    """
    said = f"{where}: {channel.topic}"
    fault = problem(channel, schema)
    if fault:
        raise FerryIdError(
            f"{said}: the messages cannot be decoded, {fault}. Fix: record the topic as "
            f"{', '.join(MESSAGE_ENCODINGS)} with its definition, or map another topic"
        )
    name, encoding = type_name(channel, schema), channel.message_encoding
    definition = b"" if schema is None else schema.data
    if encoding == "protobuf":
        from ferryid.ingest.protobuf import ProtobufDecoder

        return ProtobufDecoder(definition, name, channel.topic, paths, said), ""
    if encoding == "json":
        return JsonDecoder(channel.topic, paths, said), ""
    found = _ros_definition(channel, schema)
    if found.typestore is None:
        raise FerryIdError(
            f"{said}: the messages cannot be decoded, {found.note}. "
            "Fix: record again with valid definitions, or map another topic"
        )
    kind: Literal["ros1", "cdr"] = "ros1" if encoding == "ros1" else "cdr"
    decoder = decoder_for(kind, found.typestore, name, channel.topic, paths, capacity, where)
    return decoder, found.note
