"""Definitions of message types: nothing that a log holds is run, and a small one costs little to read."""

from __future__ import annotations

import builtins
import io
import time
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from mcap.writer import Writer
from rosbags.rosbag1 import Writer as Writer1
from rosbags.typesys import Stores, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import definitions, open_log
from ferryid.ingest.definitions import DefinitionError, parse_definition, typestore_of
from ferryid.ingest.layout import leaf_fields
from ferryid.ingest.mcap_reader import McapLog
from ferryid.ingest.protobuf import message_class, protobuf_fields
from ferryid.ingest.ros2_types import RecordedText, define

T0 = 1_700_000_000_000_000_000
LINE = "=" * 80 + "\n"
POINT = ("geometry_msgs/msg/Point", "ros2msg", b"float64 x\nfloat64 y\nfloat64 z\n")
POINT_DATA = b"\x00\x01\x00\x00" + np.arange(3.0).tobytes()
SMALL_BYTES = 64 << 20
MESSAGE_ENCODING = {"ros1msg": "ros1", "ros2msg": "cdr", "ros2idl": "cdr", "protobuf": "protobuf"}


@contextmanager
def cheap(*, traced: bool = True) -> Iterator[None]:
    """What is done inside needs little processor time and, where it is traced (which takes time too), memory."""
    if traced:
        tracemalloc.start()
    began = time.process_time()
    try:
        yield
        assert time.process_time() - began < 5
        assert not traced or tracemalloc.get_traced_memory()[1] < SMALL_BYTES
    finally:
        tracemalloc.stop()


def idl(constants: str = "", members: str = "double x;") -> str:
    return f"module ferry {{ module msg {{ {constants} struct State {{ {members} }}; }}; }};"


def nested(member: str, levels: int, leaf: str) -> str:
    """A chain of types; `member` is the text of each, in which # is the next type."""
    texts = [member.replace("#", f"Level{level + 1}") for level in range(levels)] + [leaf]
    return texts[0] + "".join(f"{LINE}MSG: ferry/Level{level}\n{text}" for level, text in enumerate(texts) if level)


def log_of(schema: tuple[str, str, bytes], messages: list[bytes], encoding: str = "") -> McapLog:
    """A log with the messages on /a and as many points on /point."""
    output = io.BytesIO()
    writer = Writer(output)
    writer.start("", "test")
    encoding = encoding or MESSAGE_ENCODING[schema[1]]
    channel = writer.register_channel("/a", encoding, writer.register_schema(*schema))
    point = writer.register_channel("/point", "cdr", writer.register_schema(*POINT))
    for number, message in enumerate(messages):
        writer.add_message(channel, T0 + number, message, T0 + number)
        writer.add_message(point, T0 + number, POINT_DATA, T0 + number)
    writer.finish()
    return McapLog(Path("log.mcap"), output.getvalue())


def refusal(schema: tuple[str, str, bytes]) -> str:
    """Return why /a cannot be read, of a log in which everything else can."""
    log = log_of(schema, [bytes(100)] * 3)
    assert dict(log.topics[0].fields) == {}
    assert log.read({"/point": ["y"]})["/point"].columns["y"].tolist() == [1.0] * 3
    with pytest.raises(FerryIdError, match=r"^log\.mcap: /a: .* Fix: ") as caught:
        log.read({"/a": []})
    return str(caught.value)


IDL_BOMBS = {
    "shift": idl("const long long A = 1 << 34359738368;"),
    "product": idl("const long long A = 4294967295; const long long B = A * A; const long long C = B * B;"),
    "sum of truth values": idl(
        "const boolean A = (TRUE << TRUE) << (TRUE << TRUE); const long B = A << A; const long C = B << B;"
        "const long D = C << C;"
    ),
    "digits": idl(f"const long long A = {'9' * 5000};"),
    "brackets": idl(f"const long A = {'(' * 2000}1{')' * 2000};"),
    "array": idl(members="double x[2147483648];"),
    "array of strings": idl(members="string x[100000];"),
    "open comment": idl("/*" + " *" * 100_000),
    "types": idl("".join(f"const long A{k} = 1;" for k in range(definitions.MAX_TYPES + 1))),
}
MSG_BOMBS = {
    "shared twice": nested("# a\n# b\n", 35, "float64 x\n"),
    "shared ten times": nested("".join(f"#[] f{k}\n" for k in range(10)), 12, "float64 x\n"),
    "arrays in arrays": nested("#[100] a\n", 6, "float64 x\n"),
    "array": "float64[2147483648] a\n",
    "array of strings": "string[2147483648] a\n",
    "recursive": "State s\n",
    "recursive sequence": "State[] s\n",
    "long names": nested(f"# {'a' * 4000}\n# {'b' * 4000}\n", 14, "float64 x\n"),
    "deep": nested("#[] a\n", 200, "float64 x\n"),
    "hexadecimal": f"int64 X=0x{'f' * 300_000}\nfloat64 x\n",
    "large": "float64 x\n" * 30_000,
}


@pytest.mark.parametrize("text", IDL_BOMBS.values(), ids=IDL_BOMBS)
def test_an_idl_definition_that_grows_is_refused(text: str) -> None:
    with cheap(), pytest.raises(DefinitionError):
        parse_definition(text, "ferry/msg/State", "ros2idl")


@pytest.mark.parametrize("encoding", ["ros1msg", "ros2msg"])
@pytest.mark.parametrize("text", MSG_BOMBS.values(), ids=MSG_BOMBS)
def test_a_msg_definition_that_grows_is_refused(text: str, encoding: str) -> None:
    with cheap(), pytest.raises(DefinitionError):
        parse_definition(text, "ferry/msg/State", encoding)


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("ros1msg", MSG_BOMBS["shared ten times"]),
        ("ros2msg", MSG_BOMBS["shared twice"]),
        ("ros2idl", IDL_BOMBS["shift"]),
    ],
)
def test_the_other_topics_of_a_log_are_read(encoding: str, text: str) -> None:
    with cheap(traced=False):
        assert "the messages cannot be decoded, the definition of ferry/msg/State" in refusal(
            ("ferry/msg/State", encoding, text.encode())
        )
    if encoding != "ros1msg":
        note = define("ferry/msg/State", RecordedText(encoding, text), "", "").note
        assert note.startswith("cannot be decoded: the log's definition ")


@pytest.mark.slow
def test_a_definition_costs_no_more_than_its_text() -> None:
    long_texts = [
        ("ros2idl", idl(f"const long A = {'(' * 12}1{')' * 12};")),
        ("ros2idl", idl(members=f"{'sequence<' * 25}double{'>' * 25} x;")),
        ("ros2idl", idl(members='@unit(value="m") ' * 15_000 + "double x;")),
        ("ros2idl", idl(members="@a " * 80_000 + "double x;")),
        ("ros2msg", "float64 x\n" + "\n" * 250_000),
        ("ros2msg", "float64 x\n" + "  # comment\n" * 20_000),
        ("ros2msg", "".join(f"float64 x{k}\n" for k in range(2000))),
    ]
    for encoding, text in long_texts:
        with cheap(traced=False):
            assert "ferry/msg/State" in parse_definition(text, "ferry/msg/State", encoding)


def test_constants_and_expressions_are_as_rosbags_evaluates_them() -> None:
    text = idl(
        "module State_Constants { const long N = 2 + 3 * (4 - 1) << 1; const double G = 9.81; const boolean B = TRUE; };",
        "double x[State_Constants::N]; long y[-(2 - 5) & 7];",
    )
    store = typestore_of(parse_definition(text, "ferry/msg/State", "ros2idl"))
    assert leaf_fields(store, "ferry/msg/State") == {"x[22]": "float64", "y[3]": "int32"}
    assert [value for *_, value in store.fielddefs["ferry/msg/State"][0]] == [22, 9.81, 1]


def test_annotations_change_nothing_of_a_definition() -> None:
    plain = idl('const string S = "@key(1)";', "double x; long y; // @id(7)\n double z;")
    text = idl(
        '@verbatim (language="comment", text="a ) \\" @b") const string S = "@key(1)";',
        "@key double x; @id(3) @range(min=(1 + 2), max=4) long y; // @id(7)\n @ a::unit(value=')') /* @c */ double z;",
    )
    assert "@verbatim" in text
    assert parse_definition(text, "ferry/msg/State", "ros2idl") == parse_definition(plain, "ferry/msg/State", "ros2idl")


@pytest.mark.parametrize("text", ["'\\", '"', "/*", "@", "@a(", "@a::", "(", "@a /*", '@a("'])
def test_what_never_ends_in_a_definition_costs_no_more_than_its_text(text: str) -> None:
    with cheap(traced=False), pytest.raises(DefinitionError):
        parse_definition(idl(text * (200_000 // len(text))), "ferry/msg/State", "ros2idl")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("x/msg/Y:\n    import os", "float64 x\n"),
        ('x/msg/Y"""\nPWNED = 1\n"""', "float64 x\n"),
        ("1a/msg/2b", "float64 x\n"),
        ("", "float64 x\n"),
        ("x/msg/é", "float64 x\n"),
        ("x/msg/Y", "1a/2b x\n"),
        ("x/msg/Y", f"float64 x\n{LINE}MSG: 1a/2b\nfloat64 y\n"),
        ("a/b/msg/Y", f"float64 x\n{LINE}MSG: a__b/Y\nfloat64 y\n"),
        ("x/msg/Y", "float64 __debug__\n"),
        ("x/msg/Y", "float64 x\nfloat64 x\n"),
        ("x/msg/Y", "float64 class\nfloat64 class_\n"),
    ],
)
def test_names_that_are_not_of_ros_reach_no_generated_code(
    name: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Modules that are imported meanwhile would be empty.
    typestore_of(parse_definition("float64 x\n", "warm/msg/Up", "ros1msg"))
    define("warm/msg/Up", RecordedText("ros2msg", "float64 x\n"), "", "")
    for store in Stores:
        get_typestore(store)
    # The decoder of the log's other topic is generated once.
    assert refusal(("x/msg/Y", "ros2msg", b"what is this"))
    ran: list[Any] = []
    monkeypatch.setattr(builtins, "exec", lambda *code: ran.append(code))
    for encoding in ("ros1msg", "ros2msg"):
        with pytest.raises(DefinitionError):
            typestore_of(parse_definition(text, name, encoding))
        assert "cannot be decoded" in refusal((name, encoding, text.encode()))
    assert define(name, RecordedText("ros2msg", text), "", "").typestore is None
    assert ran == []


def test_a_type_outside_any_package_may_not_stand_in_for_what_the_generated_code_uses() -> None:
    for name in ("dataclass", "T", "FIELDDEFS", "class"):
        with pytest.raises(DefinitionError):
            parse_definition(f"struct {name} {{ double x; }}; struct State {{ double x; }};", "State", "ros2idl")
    text = "struct State { double x; };"
    assert leaf_fields(typestore_of(parse_definition(text, "State", "ros2idl")), "State") == {"x": "float64"}


@pytest.mark.parametrize("constant", ["float64 X=1e999", f"int64 X=0x{'f' * 5000}", "string X=')\nimport os"])
def test_constants_and_defaults_are_no_code(constant: str) -> None:
    text = f'{constant}\nfloat64 x 1e999\nstring s "\'); import os"\nfloat64[] y [1e999, 2]\n'
    try:
        store = typestore_of(parse_definition(text, "x/msg/Y", "ros2msg"))
    except DefinitionError:
        return
    assert leaf_fields(store, "x/msg/Y") == {"x": "float64", "s": "string", "y[]": "float64"}


def test_types_that_rosbags_cannot_decode_are_refused_before_a_message_is() -> None:
    for member in ("wstring x;", "wchar x;", "long double x;", "double a; sequence<wstring> x;"):
        assert "cannot be decoded" in refusal(("ferry/msg/State", "ros2idl", idl(members=member).encode()))


def test_a_sequence_of_nothing_is_refused() -> None:
    """Four bytes would be four thousand million elements."""
    for element in ("Empty", "Nothing"):
        text = f"{element}[] a\n{LINE}MSG: ferry/Empty\n{LINE}MSG: ferry/Nothing\nuint8[0] none\n"
        with cheap(), pytest.raises(DefinitionError, match="elements without content"):
            parse_definition(text, "ferry/msg/State", "ros1msg")
    with cheap():
        log = log_of(("ferry/msg/State", "ros2msg", text.encode()), [b"\x00\x01\x00\x00\xff\xff\xff\xff"] * 3)
        with pytest.raises(FerryIdError, match="elements without content"):
            log.read({"/a": []})


def test_a_message_of_a_million_messages_is_corrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ferryid.ingest.bulk.COUNTED_BYTES", 1000)
    monkeypatch.setattr("ferryid.ingest.bulk.MAX_VALUES", 30_000)
    text = f"Empty[] a\nfloat64 x\n{LINE}MSG: ferry/Empty\n"
    few, many = (b"\x00\x01\x00\x00" + count.to_bytes(4, "little") + bytes(count) + bytes(12) for count in (8, 40_000))
    log = log_of(("ferry/msg/State", "ros2msg", text.encode()), [few, many, few])
    assert log.read({"/a": ["x"]})["/a"].columns["x"].tolist() == [0.0, 0.0]
    assert [loss.messages for loss in log.losses] == [1]


def descriptors(*types: dict[str, str], syntax: str = "proto3") -> bytes:
    """Protobuf definitions of State, T1, T2, ...: name of a field to the number of the type, or its primitive."""
    file = FileDescriptorProto(name="a.proto", package="nav", syntax=syntax)
    names = ["State", *(f"T{number}" for number in range(1, len(types)))]
    for name, fields in zip(names, types, strict=True):
        message = file.message_type.add(name=name)
        for number, (field, kind) in enumerate(fields.items(), 1):
            inner = f".nav.{names[int(kind)]}" if kind.isdigit() else None
            kind = "message" if inner else kind
            message.field.add(
                name=field, number=number, type=f"TYPE_{kind.upper()}", type_name=inner, label="LABEL_OPTIONAL"
            )
    return FileDescriptorSet(file=[file]).SerializeToString()


@pytest.mark.slow
def test_protobuf_types_that_share_their_parts_are_listed_within_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(definitions, "MAX_FIELDS", 1000)
    chain = [{f"f{k}": str(level + 1) for k in range(3)} for level in range(30)]
    mutual = [{f"f{k}": str(k) for k in range(12)} for _ in range(12)]
    long = [{"a" * 30_000: str(level + 1)} for level in range(30)]
    for types in ([*chain, {"x": "double"}], [*chain, {}], mutual, [*long, {f"x{k}": "double" for k in range(200)}]):
        with cheap():
            assert protobuf_fields(descriptors(*types), "nav.State") == {}
    tree = descriptors({"x": "double", "left": "0", "right": "0"})
    assert protobuf_fields(tree, "nav.State") == {"x": "float64"}


def test_protobuf_definitions_are_bounded() -> None:
    with pytest.raises(DefinitionError, match="larger than"):
        message_class(bytes((16 << 20) + 1), "nav.State")
    assert "nav.State is larger than" in refusal(("nav.State", "protobuf", bytes((16 << 20) + 1)))


def test_protobuf_fields_may_have_the_names_of_methods() -> None:
    definition = descriptors(dict.fromkeys(["ParseFromString", "HasField", "DESCRIPTOR"], "double"), syntax="proto2")
    message = message_class(definition, "nav.State")(HasField=2.5)
    log = log_of(("nav.State", "protobuf", definition), [message.SerializeToString()])
    columns = log.read({"/a": ["ParseFromString", "HasField"]})["/a"].columns
    assert columns["HasField"].tolist() == [2.5]
    assert np.isnan(columns["ParseFromString"]).all()


def test_protobuf_messages_that_cannot_be_are_counted() -> None:
    definition = descriptors({"name": "string", "stamp": "1"}, {"seconds": "int64", "nanos": "int32"}, syntax="proto2")
    messages = [b"\x0a\x01a", b"\x0a\x02\xff\xfe", b"\x0b", b"\xff" * 12, b"\x0a\xff\xff\xff\xff\x0f"]
    log = log_of(("nav.State", "protobuf", definition), messages)
    assert log.read({"/a": ["name"]})["/a"].columns["name"].tolist() == ["a"]
    assert [loss.messages for loss in log.losses] == [4]


def test_an_incomplete_definition_of_a_ros1_bag_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    with Writer1(path) as writer:
        for topic, text in (("/missing", "Nobody x\n"), ("/shared", MSG_BOMBS["shared twice"])):
            connection = writer.add_connection(topic, f"ferry/msg/{topic[1:]}", msgdef=text, md5sum="0" * 32)
            writer.write(connection, T0, bytes(8))
    log = open_log(path)
    assert ["cannot be read" in topic.note for topic in log.topics] == [True, True]
    for topic, found in (("/missing", "incomplete definition"), ("/shared", "holds more than 20000 messages")):
        with pytest.raises(FerryIdError, match=rf"{found}.* Fix: "):
            log.read({topic: []})


def test_protobuf_messages_over_the_bound_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ferryid.ingest.protobuf.MAX_MESSAGE_BYTES", 1000)
    definition = descriptors({"name": "string"})
    log = log_of(("nav.State", "protobuf", definition), [b"\x0a\x01a" * 100, b"\x0a\x01a" * 400])
    assert log.read({"/a": ["name"]})["/a"].columns["name"].tolist() == ["a"]
    assert [loss.messages for loss in log.losses] == [1]
