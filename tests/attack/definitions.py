"""Hostile message definitions in every schema language, and compressed zeros."""

from __future__ import annotations

import bz2
import json
from functools import cache
from random import Random
from typing import Any

import lz4.frame
import zstandard
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet

BAR = b"\n" + b"=" * 80 + b"\n"
ODD_NAMES = (
    "1a/msg/2b",
    "os/msg/system",
    "a/msg/__import__('os')",
    "class/msg/def",
    "",
    "/",
    "std_msgs",
    "a/b/c/d/e",
    "../../etc/msg/passwd",
    "x" * 70_000,
    "std_msgs/msg/Float64\x1b[2J",
    "numpy/msg/ndarray",
)
ODD_TYPES = (
    "float64[99999999999]",
    "float64[4294967296]",
    "float64[-1]",
    "float64[0]",
    "float64[]",
    "string<=99999999999",
    "float64[<=3]",
    "wstring",
    "time",
    "duration",
    "unknown_type",
    "builtin_interfaces/Time",
    "uint8[1000000000]",
    "self",
)


def hostile(random: Random, language: str, name: str, text: bytes) -> tuple[str, bytes, str]:
    """Return what was done to a definition, the definition, and the name of its type.

    Parameters
    ----------
    language
        ``"ros1msg"``, ``"ros2msg"``, ``"ros2idl"``, ``"protobuf"`` or ``"jsonschema"``.
    name, text
        The type and its definition before.
    """
    if random.random() < 0.15:
        other = random.choice(ODD_NAMES)
        return f"the type is called {other[:40]!r}", text, other
    if random.random() < 0.2:
        return _damaged(random, text, name)
    if language == "protobuf":
        return (*_protobuf(random, text, name), name)
    if language == "jsonschema":
        return (*_jsonschema(random, text), name)
    if language == "ros2idl":
        return (*_idl(random, name, text), name)
    return (*_msg(random, name, text), name)


def _damaged(random: Random, text: bytes, name: str) -> tuple[str, bytes, str]:
    at, size = random.randrange(len(text)), random.choice((1, 2, 10, 100))
    action = random.choice(("cut off", "deleted", "noise", "twice"))
    if action == "cut off":
        return f"cut off after {at} bytes", text[:at], name
    if action == "deleted":
        return f"{size} bytes deleted at {at}", text[:at] + text[at + size :], name
    if action == "noise":
        noise = random.randbytes(size)
        return f"{size} bytes of noise at {at}", text[:at] + noise + text[at + size :], name
    return "twice in a row", text + text, name


def _msg(random: Random, name: str, text: bytes) -> tuple[str, bytes]:
    """ROS 1 and ROS 2 message files."""
    package = name.split("/")[0]
    depth = random.choice((20, 30, 200, 3000))
    choice = random.randrange(9)
    if choice == 0:
        kind = random.choice(ODD_TYPES).replace("self", name)
        first, _, rest = text.partition(b"\n")
        return f"a field of type {kind}", f"{kind} odd\n".encode() + first + b"\n" + rest
    if choice == 1:
        return "it contains itself", f"{name} inner\n".encode() + text
    if choice == 2:
        return "a sequence of itself", f"{name}[] inner\n".encode() + text
    if choice == 3:
        parts = [f"{package}/L0 left\n".encode() + text.split(BAR)[0]]
        for level in range(depth):
            below = f"{package}/L{level + 1}" if level + 1 < depth else "float64"
            parts.append(f"MSG: {package}/L{level}\n{below} a\n{below} b\n".encode())
        return f"{depth} levels that each contain the next twice", BAR.join(parts + text.split(BAR)[1:])
    if choice == 4:
        parts = [f"{package}/L0 left\n".encode() + text.split(BAR)[0]]
        for level in range(depth):
            below = f"{package}/L{level + 1}[100]" if level + 1 < depth else "float64[100]"
            parts.append(f"MSG: {package}/L{level}\n{below} a\n".encode())
        return f"{depth} levels of arrays of 100", BAR.join(parts + text.split(BAR)[1:])
    if choice == 5:
        count = random.choice((1000, 20_000))
        return f"{count} more fields", b"".join(b"float64 more%d\n" % i for i in range(count)) + text
    if choice == 6:
        odd = random.choice(("class", "def", "1x", "x y", "__class__", "x;import os", "é", "self", "a.b", "x\x00y"))
        return f"a field called {odd!r}", f"float64 {odd}\n".encode() + text
    if choice == 7:
        value = random.choice(("1e999", "0x" + "f" * 5000, "9" * 6000, "nan", "'", "__import__('os')", ""))
        kind = random.choice(("int32", "float64", "string", "bool"))
        return f"a constant {kind} of {value[:20]!r}", f"{kind} ODD={value}\n".encode() + text
    lines = text.split(b"\n")
    place, other = random.randrange(len(lines)), random.randrange(len(lines))
    lines[place], lines[other] = lines[other], lines[place]
    return f"lines {place} and {other} swapped", b"\n".join(lines)


def _idl(random: Random, name: str, text: bytes) -> tuple[str, bytes]:
    """OMG IDL as ROS 2 has it."""
    members = b"struct "
    choice = random.randrange(7)
    depth = random.choice((50, 2000))
    constant = random.choice(
        ("1 << 34359738368", "1 / 0", "9" * 5000, "((((1" * 500, "2 ** 99999999", "'x'", "1 << -1", "(" * 3000)
    )
    if choice == 0:
        return f"a constant of {constant[:30]}", b"const long long ODD = " + constant.encode() + b";\n" + text
    if choice == 1:
        return f"{depth} nested modules", b"module a { " * depth + text + b" };" * depth
    if choice == 2:
        odd = b"sequence<" * depth + b"double" + b">" * depth + b" odd; "
        return f"{depth} nested sequences", text.replace(b"{ double", b"{ " + odd + b"double", 1)
    if choice == 3:
        chain = b"".join(b"typedef t%d t%d;\n" % (i + 1, i) for i in range(depth))
        return f"a chain of {depth} typedefs", chain + b"typedef double t%d;\n" % depth + text
    if choice == 4:
        size = random.choice((b"99999999999", b"-1", b"0", b"1 << 40", b"ODD"))
        return f"an array of {size.decode()}", text.replace(b"double ", b"double odd[" + size + b"]; double ", 1)
    if choice == 5:
        own = name.split("/")[-1].encode()
        return "it contains itself", text.replace(members + own + b" {", members + own + b" { " + own + b" odd;", 1)
    return "an unclosed comment", text.replace(b"struct", b"/* struct", 1)


def _protobuf(random: Random, text: bytes, name: str) -> tuple[str, bytes]:
    """Sets of file descriptors."""
    files = FileDescriptorSet.FromString(text)
    package, _, own = name.rpartition(".")
    file = next((each for each in files.file if each.package == package), files.file[0])
    message = next((each for each in file.message_type if each.name == own), file.message_type[0])
    depth = random.choice((15, 25, 200, 2000))
    choice = random.randrange(8)

    def member(where: Any, label: str, number: int, kind: str, repeated: bool = False) -> None:
        where.field.add(
            name=label,
            number=number,
            type="TYPE_MESSAGE",
            type_name=f".{package}.{kind}",
            label="LABEL_REPEATED" if repeated else "LABEL_OPTIONAL",
        )

    if choice == 0:
        member(message, "inner", 90, own, random.random() < 0.5)
        return "it contains itself", files.SerializeToString()
    if choice == 1:
        member(message, "left", 90, "L0")
        for level in range(depth):
            below = file.message_type.add(name=f"L{level}")
            if level + 1 < depth:
                for number, label in enumerate("abcd", 1):
                    member(below, label, number, f"L{level + 1}")
            else:
                below.field.add(name="a", number=1, type="TYPE_DOUBLE", label="LABEL_OPTIONAL")
        return f"{depth} levels that each contain the next four times", files.SerializeToString()
    if choice == 2:
        inner = message
        for level in range(min(depth, 90)):
            inner = inner.nested_type.add(name=f"N{level}")
        return "deeply nested types", files.SerializeToString()
    if choice == 3:
        changed = random.choice(message.field)
        changed.number = random.choice((0, 1, 19_000, 2**29, 2**31 - 1, -1))
        return f"field {changed.name} has number {changed.number}", files.SerializeToString()
    if choice == 4:
        changed = random.choice(message.field)
        changed.type_name, changed.type = ".no.Such", 11
        return f"field {changed.name} is of a type that is nowhere", files.SerializeToString()
    if choice == 5:
        file.dependency.append(random.choice((file.name, "missing.proto", "")))
        return f"it depends on {file.dependency[-1]!r}", files.SerializeToString()
    if choice == 6:
        count = random.choice((1000, 20_000))
        for number in range(count):
            message.field.add(name=f"more{number}", number=20_000 + number, type="TYPE_DOUBLE", label="LABEL_OPTIONAL")
        return f"{count} more fields", files.SerializeToString()
    for number in range(2000):
        files.file.append(FileDescriptorProto(name=f"f{number}.proto", dependency=[f"f{number + 1}.proto"]))
    return "a chain of 2000 files", files.SerializeToString()


def _jsonschema(random: Random, text: bytes) -> tuple[str, bytes]:
    choice = random.randrange(5)
    if choice == 0:
        return "100,000 brackets deep", b"[" * 100_000
    if choice == 1:
        deep: Any = {"type": "number"}
        for _ in range(200):
            deep = {"type": "object", "properties": {"a": deep}}
        return "200 objects deep", json.dumps(deep).encode()
    if choice == 2:
        return "it refers to itself", b'{"$ref": "#", "type": "object", "properties": {"data": {"$ref": "#"}}}'
    if choice == 3:
        return "types that are none", random.choice((b'{"type": 7}', b'{"type": null}', b'{"properties": []}', b"[]"))
    return "a number of 10,000 digits", b'{"type": "object", "maximum": ' + b"9" * 10_000 + b"}"


@cache
def zeros(codec: str) -> tuple[bytes, int]:
    """Return a compressed run of zeros, and its length: more than two gigabytes where that takes few bytes."""
    piece = bytes(1 << 24)
    count = {"zstd": 144, "lz4": 40, "bz2": 12}[codec]
    size = count * len(piece)
    if codec == "zstd":
        packer = zstandard.ZstdCompressor(level=1).compressobj(size=size)
        return b"".join([packer.compress(piece) for _ in range(count)] + [packer.flush()]), size
    if codec == "bz2":
        squeezer = bz2.BZ2Compressor(9)
        return b"".join([squeezer.compress(piece) for _ in range(count)] + [squeezer.flush()]), size
    frame = lz4.frame.LZ4FrameCompressor()
    return b"".join([frame.begin(size), *(frame.compress(piece) for _ in range(count)), frame.flush()]), size
