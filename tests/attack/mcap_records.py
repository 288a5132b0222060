"""MCAP files as records: written by the mcap package, taken apart and put together again."""

from __future__ import annotations

import io
import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import lz4.frame
import zstandard
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_protobuf.decoder import DecoderFactory as ProtobufFactory
from mcap_ros1.decoder import DecoderFactory as Ros1Factory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory

from tests.attack.case import Rows
from tests.attack.logs import STORES, TYPES, WANTED, leaf, messages, rows, serialized

NAME = "log.mcap"
MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, SUMMARY_OFFSET, DATA_END = 11, 14, 15
OPCODES = {
    1: "header",
    2: "footer",
    3: "schema",
    4: "channel",
    5: "message",
    6: "chunk",
    7: "message index",
    8: "chunk index",
    11: "statistics",
    14: "summary offset",
    15: "data end",
}
# Fields of a record's content: name, place, bytes. Those behind texts and lists are found by `_numbers`.
FIELDS = {
    FOOTER: (("summary_start", 0, 8), ("summary_offset_start", 8, 8), ("summary_crc", 16, 4)),
    SCHEMA: (("id", 0, 2), ("name length", 2, 4)),
    CHANNEL: (("id", 0, 2), ("schema_id", 2, 2), ("topic length", 4, 4)),
    MESSAGE: (("channel_id", 0, 2), ("sequence", 2, 4), ("log_time", 6, 8), ("publish_time", 14, 8)),
    CHUNK: (
        ("message_start_time", 0, 8),
        ("message_end_time", 8, 8),
        ("uncompressed_size", 16, 8),
        ("uncompressed_crc", 24, 4),
        ("compression length", 28, 4),
    ),
    MESSAGE_INDEX: (("channel_id", 0, 2), ("entries length", 2, 4), ("first time", 6, 8), ("first offset", 14, 8)),
    CHUNK_INDEX: (
        ("message_start_time", 0, 8),
        ("message_end_time", 8, 8),
        ("chunk_start_offset", 16, 8),
        ("chunk_length", 24, 8),
        ("offsets length", 32, 4),
        ("first channel", 36, 2),
        ("first offset", 38, 8),
    ),
    STATISTICS: (
        ("message_count", 0, 8),
        ("schema_count", 8, 2),
        ("channel_count", 10, 4),
        ("attachment_count", 14, 4),
        ("metadata_count", 18, 4),
        ("chunk_count", 22, 4),
        ("message_start_time", 26, 8),
        ("message_end_time", 34, 8),
        ("counts length", 42, 4),
        ("first channel", 46, 2),
        ("first count", 48, 8),
        ("second channel", 56, 2),
        ("second count", 58, 8),
    ),
    SUMMARY_OFFSET: (("group_opcode", 0, 1), ("group_start", 1, 8), ("group_length", 9, 8)),
    DATA_END: (("data_section_crc", 0, 4),),
    HEADER: (("profile length", 0, 4),),
}
IDL = {
    "std_msgs/msg/Float64": b"module std_msgs { module msg { struct Float64 { double data; }; }; };\n",
    "geometry_msgs/msg/PointStamped": (
        b"=" * 80 + b"\nIDL: geometry_msgs/msg/PointStamped\n"
        b"module geometry_msgs { module msg { struct PointStamped { std_msgs::msg::Header header; "
        b"geometry_msgs::msg::Point point; }; }; };\n" + b"=" * 80 + b"\nIDL: geometry_msgs/msg/Point\n"
        b"module geometry_msgs { module msg { struct Point { double x; double y; double z; }; }; };\n"
        + b"="
        * 80
        + b"\nIDL: std_msgs/msg/Header\n"
        b"module std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };\n"
        + b"="
        * 80
        + b"\nIDL: builtin_interfaces/msg/Time\n"
        b"module builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };\n"
    ),
}


def _protobuf() -> FileDescriptorSet:
    file = FileDescriptorProto(name="nav.proto", package="nav", syntax="proto3")
    point = file.message_type.add(name="Point")
    for number, name in enumerate("xyz", 1):
        point.field.add(name=name, number=number, type="TYPE_DOUBLE", label="LABEL_OPTIONAL")
    stamped = file.message_type.add(name="Position")
    stamped.field.add(name="point", number=1, type="TYPE_MESSAGE", type_name=".nav.Point", label="LABEL_OPTIONAL")
    speed = file.message_type.add(name="Speed")
    speed.field.add(name="data", number=1, type="TYPE_DOUBLE", label="LABEL_OPTIONAL")
    return FileDescriptorSet(file=[file])


PROTOBUF = _protobuf()
_POOL = descriptor_pool.DescriptorPool()
_POOL.Add(PROTOBUF.file[0])
NAMES = {"/position": "nav.Position", "/speed": "nav.Speed"}
ENCODINGS = ("ros1msg", "ros2msg", "ros2idl", "protobuf", "jsonschema")


@dataclass(frozen=True)
class Layout:
    """How the file is written."""

    encoding: str = "ros2msg"
    compression: CompressionType = CompressionType.NONE
    chunks: bool = True
    crcs: bool = True
    index: bool = True
    summary: bool = True
    """Without, the file ends where the power was lost."""

    @property
    def name(self) -> str:
        """For the table."""
        parts = [self.encoding, self.compression.name.lower() if self.chunks else "no chunks"]
        parts += [] if self.crcs else ["no CRC"]
        parts += [] if self.index else ["no message index"]
        parts += [] if self.summary else ["not closed"]
        return ", ".join(parts)


def written(layout: Layout) -> bytes:
    """Write the messages with the mcap package."""
    output = io.BytesIO()
    writer = Writer(
        output,
        chunk_size=1500,
        compression=layout.compression,
        use_chunking=layout.chunks,
        enable_crcs=layout.crcs,
        enable_data_crcs=layout.crcs,
        index_types=IndexType.ALL if layout.index else IndexType.ALL ^ IndexType.MESSAGE,
    )
    writer.start({"ros1msg": "ros1", "ros2msg": "ros2", "ros2idl": "ros2"}.get(layout.encoding, ""), "attack")
    channels = {}
    for topic in TYPES:
        name, schema, encoding = schema_of(topic, layout.encoding)
        number = writer.register_schema(name, layout.encoding, schema)
        channels[topic] = writer.register_channel(topic, encoding, number)
    for number, (topic, time, value) in enumerate(messages()):
        writer.add_message(channels[topic], time, payload(topic, time, value, layout.encoding), time, number)
    writer.finish()
    return output.getvalue()


def schema_of(topic: str, language: str) -> tuple[str, bytes, str]:
    """Name, definition and message encoding of a topic's type."""
    kind = TYPES[topic]
    if language == "ros2idl":
        return kind, IDL[kind], "cdr"
    if language in ("ros1msg", "ros2msg"):
        encoding = "ros1" if language == "ros1msg" else "cdr"
        text = STORES[encoding].generate_msgdef(kind, ros_version=1 if encoding == "ros1" else 2)[0]
        return kind.replace("/msg/", "/") if encoding == "ros1" else kind, text.encode(), encoding
    if language == "protobuf":
        return NAMES[topic], PROTOBUF.SerializeToString(), "protobuf"
    point = {"type": "object", "properties": {name: {"type": "number"} for name in "xyz"}}
    members = {"data": {"type": "number"}} if topic == "/speed" else {"point": point}
    return NAMES[topic], json.dumps({"type": "object", "properties": members}).encode(), "json"


def payload(topic: str, time_ns: int, value: float, language: str) -> bytes:
    """Serialise one message."""
    if language in ("ros1msg", "ros2msg", "ros2idl"):
        return serialized(topic, time_ns, value, "ros1" if language == "ros1msg" else "cdr")
    y = -1.0 / (abs(value) + 1)
    if language == "jsonschema":
        made: Any = {"data": value} if topic == "/speed" else {"point": {"x": value, "y": y, "z": 0.0}}
        return json.dumps(made).encode()
    message = message_factory.GetMessageClass(_POOL.FindMessageTypeByName(NAMES[topic]))()
    if topic == "/speed":
        message.data = value  # type: ignore[attr-defined]
    else:
        message.point.x, message.point.y, message.point.z = value, y, 0.0  # type: ignore[attr-defined]
    return bytes(message.SerializeToString())


def truth_of(content: bytes, language: str) -> dict[str, Rows]:
    if language == "jsonschema":
        found = NonSeekingReader(io.BytesIO(content)).iter_messages()
        decoded = ((channel.topic, message.log_time, json.loads(message.data)) for _, channel, message in found)
    elif language == "ros2idl":
        found = NonSeekingReader(io.BytesIO(content)).iter_messages()
        store = STORES["cdr"]
        decoded = (
            (channel.topic, message.log_time, store.deserialize_cdr(message.data, TYPES[channel.topic]))
            for _, channel, message in found
        )
    else:
        reader = NonSeekingReader(
            io.BytesIO(content), decoder_factories=[Ros1Factory(), Ros2Factory(), ProtobufFactory()]
        )
        decoded = ((ch.topic, message.log_time, made) for _, ch, message, made in reader.iter_decoded_messages())
    return rows((topic, time, leaf(made, WANTED[topic][0])) for topic, time, made in decoded)


Record = tuple[int, bytes, bytes]
"""Opcode, content, and the whole record."""


def walk(content: bytes, at: int, end: int) -> Iterator[Record]:
    while at + 9 <= end:
        op, size = struct.unpack_from("<BQ", content, at)
        yield op, content[at + 9 : at + 9 + size], content[at : at + 9 + size]
        at += 9 + size


def parsed(content: bytes) -> list[Record]:
    end = len(content) - (len(MAGIC) if content.endswith(MAGIC) else 0)
    return list(walk(content, len(MAGIC), end))


def places_of(content: bytes) -> list[int]:
    places, at = [], len(MAGIC)
    for _, _, whole in parsed(content):
        places.append(at)
        at += len(whole)
    return places


def record(op: int, content: bytes) -> Record:
    """Return a record of this content."""
    return op, content, struct.pack("<BQ", op, len(content)) + content


def joined(records: list[Record], closed: bool, *, fitted: bool = False) -> bytes:
    """Return the file; fitted: offsets of chunks and of the summary point to where they are now, checksums are right."""
    if not fitted:
        return MAGIC + b"".join(whole for _, _, whole in records) + (MAGIC if closed else b"")
    made = bytearray(MAGIC)
    chunks: list[tuple[int, int]] = []
    summary = offsets = 0
    after_data = False
    for op, content, whole in records:
        if op == CHUNK:
            chunks.append((len(made), len(whole)))
        if op == CHUNK_INDEX and chunks:
            place, length = chunks.pop(0)
            # The index entries behind the chunk follow it at the distance they had.
            (old,) = struct.unpack_from("<Q", content, 16)
            (size,) = struct.unpack_from("<L", content, 32)
            entries = bytearray(content[36 : 36 + size])
            for entry in range(0, size - size % 10, 10):
                (at,) = struct.unpack_from("<Q", entries, entry + 2)
                (was,) = struct.unpack_from("<Q", content, 24)
                struct.pack_into("<Q", entries, entry + 2, (at - old - was + place + length) & (2**64 - 1))
            fixed = content[:16] + struct.pack("<QQ", place, length) + content[32:36] + entries + content[36 + size :]
            whole = record(op, fixed)[2]
        if op == DATA_END:
            crc = zlib.crc32(made) if any(content) else 0
            whole = record(op, struct.pack("<L", crc))[2]
            made += whole
            summary, after_data = len(made), True
            continue
        if after_data and op == SUMMARY_OFFSET and not offsets:
            offsets = len(made)
        if op == FOOTER:
            head = struct.pack("<QQ", summary, offsets)
            start = bytes(made[summary:]) + struct.pack("<BQ", FOOTER, 20) + head
            crc = zlib.crc32(start) if any(content[16:20]) else 0
            whole = record(op, head + struct.pack("<L", crc))[2]
        made += whole
    return bytes(made) + (MAGIC if closed else b"")


def with_checksums(records: list[Record], closed: bool) -> bytes:
    """Join with the checksums of data and summary right, and all else as it is."""
    made, summary = bytearray(MAGIC), 0
    for op, content, whole in records:
        if op == DATA_END and any(content):
            whole = record(op, struct.pack("<L", zlib.crc32(made)))[2]
        if op == FOOTER and len(content) == 20 and any(content[16:]):
            start = bytes(made[summary:]) + whole[:25]
            whole = record(op, content[:16] + struct.pack("<L", zlib.crc32(start)))[2]
        made += whole
        if op == DATA_END:
            summary = len(made)
    return bytes(made) + (MAGIC if closed else b"")


def chunk_of(content: bytes) -> tuple[str, bytes, bytes]:
    """Compression, unpacked records and fixed fields of a chunk."""
    (size,) = struct.unpack_from("<L", content, 28)
    codec = content[32 : 32 + size].decode()
    data = content[40 + size :]
    if codec == "zstd":
        data = zstandard.ZstdDecompressor().decompressobj().decompress(data)
    elif codec == "lz4":
        data = lz4.frame.decompress(data)
    return codec, data, content[:28]


def chunk_record(codec: str, plain: bytes, head: bytes, crc: int, packed: bytes | None = None) -> Record:
    if packed is None:
        packed = plain
        if codec == "zstd":
            packed = zstandard.ZstdCompressor().compress(plain)
        elif codec == "lz4":
            packed = lz4.frame.compress(plain)
    fixed = head[:16] + struct.pack("<QLL", len(plain), crc, len(codec)) + codec.encode()
    return record(CHUNK, fixed + struct.pack("<Q", len(packed)) + packed)
