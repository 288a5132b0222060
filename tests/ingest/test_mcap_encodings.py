"""Protobuf and JSON messages: the same values as Google's and Python's own decoders give."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from ferryid.errors import FerryIdError
from ferryid.ingest.mcap_reader import McapLog

T0 = 1_700_000_000_000_000_000
NUMERIC = {
    "double": "float64",
    "float": "float32",
    "int64": "int64",
    "uint64": "uint64",
    "int32": "int32",
    "fixed64": "uint64",
    "fixed32": "uint32",
    "bool": "bool",
    "uint32": "uint32",
    "sfixed32": "int32",
    "sfixed64": "int64",
    "sint32": "int32",
    "sint64": "int64",
}


def definition() -> FileDescriptorSet:
    """A message with every kind of field: nav.State."""
    file = FileDescriptorProto(name="nav.proto", package="nav", syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")
    point = file.message_type.add(name="Point")
    for number, name in enumerate("xy", 1):
        point.field.add(name=name, number=number, type="TYPE_DOUBLE", label="LABEL_OPTIONAL")
    state = file.message_type.add(name="State")

    def add(name: str, kind: str, repeated: bool = False, inner: str = "") -> FieldDescriptorProto:
        return state.field.add(
            name=name,
            number=len(state.field) + 1,
            type=f"TYPE_{kind.upper()}",
            type_name=inner or None,
            label="LABEL_REPEATED" if repeated else "LABEL_OPTIONAL",
        )

    add("stamp", "message", inner=".google.protobuf.Timestamp")
    for kind in NUMERIC:
        add(f"a_{kind}", kind)
    add("name", "string")
    add("raw", "bytes")
    add("position", "message", inner=".nav.Point")
    add("track", "message", repeated=True, inner=".nav.Point")
    add("values", "float", repeated=True)
    choice = add("maybe", "double")
    choice.proto3_optional = True
    choice.oneof_index = 0
    state.oneof_decl.add(name="_maybe")
    timestamp = FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(timestamp)
    return FileDescriptorSet(file=[file, timestamp])


SET = definition()
POOL = descriptor_pool.DescriptorPool()
for each in reversed(SET.file):
    POOL.Add(each)
STATE: Any = message_factory.GetMessageClass(POOL.FindMessageTypeByName("nav.State"))


def log_of(encoding: str, schema: tuple[str, str, bytes] | None, messages: list[bytes]) -> tuple[bytes, McapLog]:
    output = io.BytesIO()
    writer = Writer(output, chunk_size=300)
    writer.start("", "test")
    schema_id = writer.register_schema(*schema) if schema else 0
    channel = writer.register_channel("/a", encoding, schema_id)
    for number, message in enumerate(messages):
        writer.add_message(channel, T0 + number, message, T0 + number)
    writer.finish()
    return output.getvalue(), McapLog(Path("log.mcap"), output.getvalue())


def protobuf_log(messages: list[bytes]) -> tuple[bytes, McapLog]:
    return log_of("protobuf", ("nav.State", "protobuf", SET.SerializeToString()), messages)


@st.composite
def states(draw: st.DrawFn) -> Any:
    ranges = {"uint32": (0, 2**32 - 1), "uint64": (0, 2**64 - 1), "int32": (-(2**31), 2**31 - 1)}
    state = STATE()
    state.stamp.FromNanoseconds(draw(st.integers(0, 2 * 10**18)))
    for kind, primitive in NUMERIC.items():
        if not draw(st.booleans()):
            continue
        if kind in ("double", "float"):
            value: Any = draw(st.floats(width=32 if kind == "float" else 64, allow_nan=False))
        elif kind == "bool":
            value = draw(st.booleans())
        else:
            value = draw(st.integers(*ranges.get(primitive, (-(2**63), 2**63 - 1))))
        setattr(state, f"a_{kind}", value)
    state.name = draw(st.text(max_size=5))
    state.raw = draw(st.binary(max_size=3))
    if draw(st.booleans()):
        state.position.x = draw(st.floats(allow_nan=False))
    for _ in range(draw(st.integers(0, 3))):
        state.track.add(x=draw(st.floats(-9, 9)))
    state.values.extend(draw(st.lists(st.floats(-9, 9, width=32), max_size=3)))
    if draw(st.booleans()):
        state.maybe = 1.5
    return state


PATHS = ["name", "raw[1]", "position.x", "position.y", "track[1].x", "values[0]", "maybe"]
PATHS += [f"a_{kind}" for kind in NUMERIC]


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.lists(states(), min_size=1, max_size=12))
def test_protobuf_gives_what_google_gives(messages: list[Any]) -> None:
    content, log = protobuf_log([message.SerializeToString() for message in messages])
    decoded = [
        message
        for *_, message in make_reader(
            io.BytesIO(content), decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages()
    ]
    series = log.read({"/a": PATHS})["/a"]
    assert log.losses == ()
    assert series.stamp_ns is not None
    assert series.stamp_ns.tolist() == [message.stamp.ToNanoseconds() for message in decoded]
    columns = series.columns
    for kind, primitive in NUMERIC.items():
        assert columns[f"a_{kind}"].dtype == np.dtype(primitive)
        assert columns[f"a_{kind}"].tolist() == [getattr(message, f"a_{kind}") for message in decoded]
    assert columns["name"].tolist() == [message.name for message in decoded]

    def same(path: str, wanted: list[float | None]) -> None:
        values = [None if math.isnan(value) else value for value in columns[path].tolist()]
        assert values == wanted

    same("raw[1]", [message.raw[1] if len(message.raw) > 1 else None for message in decoded])
    same("position.x", [message.position.x if message.HasField("position") else None for message in decoded])
    same("position.y", [message.position.y if message.HasField("position") else None for message in decoded])
    same("track[1].x", [message.track[1].x if len(message.track) > 1 else None for message in decoded])
    same("values[0]", [message.values[0] if message.values else None for message in decoded])
    same("maybe", [message.maybe if message.HasField("maybe") else None for message in decoded])


def test_protobuf_fields_are_listed() -> None:
    _, log = protobuf_log([])
    fields = dict(log.topics[0].fields)
    assert fields["stamp.seconds"] == "int64"
    assert fields["position.x"] == "float64"
    assert fields["track[].y"] == "float64"
    assert fields["values[]"] == "float32"
    assert fields["raw[]"] == "uint8"
    assert {fields[f"a_{kind}"] for kind in NUMERIC} == set(NUMERIC.values())


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ("positon.x", 'Did you mean "position.x"'),
        ("position", "a message of type nav.Point"),
        ("values", "holds several values"),
        ("name[0]", "holds one value"),
        ("name.x", "no fields"),
        ("a..b", "not a path"),
    ],
)
def test_protobuf_wrong_fields(path: str, found: str) -> None:
    _, log = protobuf_log([STATE(name="x").SerializeToString()])
    with pytest.raises(FerryIdError, match=found):
        log.read({"/a": [path]})


def test_corrupt_protobuf_messages_are_counted() -> None:
    good = STATE(a_double=1.0).SerializeToString()
    _, log = protobuf_log([good, b"\xff\xff\xff", good])
    assert log.read({"/a": ["a_double"]})["/a"].columns["a_double"].tolist() == [1.0, 1.0]
    (loss,) = log.losses
    assert (loss.topic, loss.messages, loss.start_ns) == ("/a", 1, T0 + 1)


def test_a_protobuf_definition_that_cannot_be_used() -> None:
    for data in (b"\xff\xff", FileDescriptorSet(file=SET.file[:1]).SerializeToString()):
        _, log = log_of("protobuf", ("nav.State", "protobuf", data), [b""])
        assert dict(log.topics[0].fields) == {}
        with pytest.raises(FerryIdError, match=r"definition of nav.State cannot be used.*Fix: "):
            log.read({"/a": ["name"]})


JSON_SCHEMA = {
    "type": "object",
    "properties": {
        "header": {"type": "object", "properties": {"stamp": {"type": "object"}}},
        "speed": {"type": ["number", "null"]},
        "on": {"type": "boolean"},
        "mode": {"type": "string"},
        "gains": {"type": "array", "items": {"type": "integer"}},
    },
}
leaves = st.fixed_dictionaries(
    {},
    optional={
        "speed": st.one_of(st.none(), st.floats(allow_nan=False, allow_infinity=False)),
        "gains": st.lists(st.integers(-(2**40), 2**40), max_size=3),
        "inner": st.fixed_dictionaries({"a.b": st.integers(0, 5), "c": st.text(max_size=4)}),
    },
)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.lists(leaves, max_size=12), st.booleans())
def test_json_gives_what_python_gives(messages: list[dict[str, Any]], described: bool) -> None:
    full = {"speed": 1.5, "gains": [1, 2], "inner": {"c": "x"}}
    messages = [full, *messages]
    schema = ("Thing", "jsonschema", json.dumps(JSON_SCHEMA).encode()) if described else None
    _, log = log_of("json", schema, [json.dumps(message).encode() for message in messages])
    columns = log.read({"/a": ["speed", "gains[1]", "inner.c"]})["/a"].columns
    for path, wanted in {
        "speed": [message.get("speed") for message in messages],
        "gains[1]": [message.get("gains", [])[1:2] for message in messages],
    }.items():
        flat = [value[0] if isinstance(value, list) and value else value for value in wanted]
        values = [None if math.isnan(value) else value for value in columns[path].tolist()]
        assert values == [None if value in (None, []) else value for value in flat]
    assert columns["inner.c"].tolist() == [message.get("inner", {}).get("c") for message in messages]
    assert log.losses == ()


def test_json_fields_from_schema_or_from_the_first_message() -> None:
    message = {
        "speed": 1,
        "on": True,
        "mode": "auto",
        "gains": [3],
        "header": {"stamp": {"sec": 5, "nsec": 6}},
    }
    data = json.dumps(message).encode()
    _, log = log_of("json", ("Thing", "jsonschema", json.dumps(JSON_SCHEMA).encode()), [data])
    assert dict(log.topics[0].fields) == {
        "speed": "float64",
        "on": "bool",
        "mode": "string",
        "gains[]": "int64",
    }
    _, log = log_of("json", None, [data])
    fields = dict(log.topics[0].fields)
    assert {name: fields[name] for name in ("speed", "on", "mode", "gains[]")} == {
        "speed": "float64",
        "on": "bool",
        "mode": "string",
        "gains[]": "float64",
    }
    series = log.read({"/a": ["on", "speed"]})["/a"]
    assert series.stamp_ns is not None
    assert series.stamp_ns.tolist() == [5_000_000_006]
    assert series.columns["on"].dtype == np.bool_


def test_numbers_that_json_lacks() -> None:
    messages = [b'{"v": 1.0}', b'{"v": NaN}', b'{"v": "NaN"}', b'{"v": "-Infinity"}']
    _, log = log_of("json", None, messages)
    values = log.read({"/a": ["v"]})["/a"].columns["v"]
    assert values.dtype == np.float64
    np.testing.assert_array_equal(values, [1.0, np.nan, np.nan, -np.inf])


def test_bad_json() -> None:
    _, log = log_of("json", None, [b'{"v": 1}', b"{", b"\xff", b'{"v": 2}'])
    assert log.read({"/a": ["v"]})["/a"].columns["v"].tolist() == [1, 2]
    (loss,) = log.losses
    assert (loss.topic, loss.messages) == ("/a", 2)
    with pytest.raises(FerryIdError, match=r'no JSON message has a value at \'w.v\'.*Fix: .*Did you mean "v"'):
        log.read({"/a": ["w.v"]})


def json_log(messages: list[bytes], schema: bytes = b"") -> McapLog:
    return log_of("json", ("State", "jsonschema", schema) if schema else None, messages)[1]


@pytest.mark.parametrize(
    "bad",
    [
        b"[" * 100_000,
        b'{"x":' * 50_000 + b"1" + b"}" * 50_000,
        b'{"x": ' + b"9" * 5000 + b"}",
        b'{"x": 1, "stamp": {"sec": 99999999999999, "nanosec": 0}}',
        b'{"x": 1, "stamp": {"sec": -9223372036854775808, "nanosec": -9223372036854775808}}',
        b'{"x": "\xff"}',
        b"",
    ],
)
def test_json_messages_that_cannot_be_are_counted(bad: bytes) -> None:
    log = json_log([b'{"x": 1}', bad, b'{"x": 2, "x": 3}'])
    assert log.read({"/a": ["x"]})["/a"].columns["x"].tolist() == [1, 3]
    assert [loss.messages for loss in log.losses] == [1]


def test_json_messages_over_the_bound_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ferryid.ingest.json_messages.MAX_MESSAGE_BYTES", 1000)
    log = json_log([b'{"x": 1}', b'{"x": 2, "y": [' + b"[]," * 400 + b"0]}"])
    assert log.read({"/a": ["x"]})["/a"].columns["x"].tolist() == [1]
    assert [loss.messages for loss in log.losses] == [1]


def test_json_integers_beyond_floats_are_infinite() -> None:
    digits = b"1" + b"0" * 400
    log = json_log([b'{"x": ' + number + b"}" for number in (digits, b"-" + digits, b"null", b"1e400", b"2")])
    assert repr(log.read({"/a": ["x"]})["/a"].columns["x"].tolist()) == "[inf, -inf, nan, inf, 2.0]"


def test_json_texts_can_be_written_down() -> None:
    log = json_log([b'{"x": "\\ud800", "\\udfff": 1, "\xc3\xa6": 2}'])
    assert [*log.topics[0].fields] == ["x", "?", "æ"]
    assert log.read({"/a": ["x"]})["/a"].columns["x"].tolist() == ["?"]


@pytest.mark.parametrize(
    "schema",
    [
        b'{"type": {"a": 1}}',
        b'{"type": [["number"], {}]}',
        b'{"properties": {"x": {"type": [{}]}, "y": {"items": 1, "type": "array"}}}',
        b'{"properties":{"x":' * 5000 + b"1" + b"}}" * 5000,
        b"\xff",
        b"[" * 100_000,
        b'{"properties": {' + b",".join(b'"x%d": {"type": "number"}' % k for k in range(50_001)) + b"}}",
    ],
)
def test_json_schemas_that_declare_nothing_usable_leave_the_messages(schema: bytes) -> None:
    log = json_log([b'{"x": 1.5}'], schema)
    assert dict(log.topics[0].fields) == {"x": "float64"}
    assert log.read({"/a": ["x"]})["/a"].columns["x"].tolist() == [1.5]


def test_long_names_in_json_are_listed_within_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ferryid.ingest.definitions.MAX_FIELD_TEXT", 100_000)
    message = json.dumps({"a" * 10_000: {f"x{k}": k for k in range(50)}, "x": 1}).encode()
    log = json_log([message])
    assert dict(log.topics[0].fields) == {}
    assert log.read({"/a": ["x"]})["/a"].columns["x"].tolist() == [1]


def test_protobuf_times_beyond_the_range_are_counted() -> None:
    messages = []
    for seconds in (1, 9_223_372_037, -9_223_372_037):
        state = STATE(a_double=1.5)
        state.stamp.seconds = seconds
        messages.append(state.SerializeToString())
    _, log = protobuf_log(messages)
    assert log.read({"/a": ["a_double"]})["/a"].columns["a_double"].tolist() == [1.5]
    assert [loss.messages for loss in log.losses] == [2]


def test_a_timestamp_that_the_log_defines_otherwise_is_no_time() -> None:
    file = FileDescriptorProto(name="a.proto", package="google.protobuf", syntax="proto3")
    stamp = file.message_type.add(name="Timestamp")
    stamp.field.add(name="seconds", number=1, type="TYPE_STRING", label="LABEL_OPTIONAL")
    state = file.message_type.add(name="State")
    state.field.add(
        name="stamp", number=1, type="TYPE_MESSAGE", type_name=".google.protobuf.Timestamp", label="LABEL_OPTIONAL"
    )
    definition = FileDescriptorSet(file=[file]).SerializeToString()
    _, log = log_of("protobuf", ("google.protobuf.State", "protobuf", definition), [b"\x0a\x03\x0a\x01a"])
    series = log.read({"/a": ["stamp.seconds"]})["/a"]
    assert series.stamp_ns is None
    assert series.columns["stamp.seconds"].tolist() == ["a"]
