"""The bulk decoder gives what rosbags' own decoder gives, whatever the schema, the lengths and the order."""

from __future__ import annotations

import itertools
import math
import re
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import bulk
from ferryid.ingest.bulk import decoder_for, leaf_fields

NUMBERS = ("bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
           "float32", "float64")  # fmt: skip
SERIAL = itertools.count()
LENGTHS = (0, 1, 3, 4, 9)
COUNT = 150


@st.composite
def definitions(draw: st.DrawFn, depth: int = 2) -> tuple[str, list[str]]:
    """Draw a message definition; returns its name and the text of it and of what it holds."""
    name = f"made_msgs/M{next(SERIAL)}"
    lines, below = [], []
    if draw(st.booleans()):
        lines.append("std_msgs/Header header")
    for index in range(draw(st.integers(1, 5))):
        kind = draw(st.sampled_from([*NUMBERS, "string", "string", "time", "duration", "nested"]))
        if kind == "nested":
            if depth == 0:
                kind = "string"
            else:
                kind, texts = draw(definitions(depth=depth - 1))
                below += texts
        shape = draw(st.sampled_from(["", "", "", "[2]", "[3]", "[]"]))
        lines.append(f"{kind}{shape} f{index}")
    return name, ["MSG: " + name + "\n" + "\n".join(lines) + "\n", *below]


def store_of(texts: list[str]) -> Any:
    store = get_typestore(Stores.ROS1_NOETIC)
    for text in reversed(texts):
        head, body = text.split("\n", 1)
        store.register(get_types_from_msg(body, head.removeprefix("MSG: ").replace("/", "/msg/")))
    return store


def value_of(store: Any, desc: Any, rng: np.random.Generator) -> Any:
    kind, inner = desc
    if kind == 1:
        if inner[0] == "string":
            return "".join(rng.choice(list("abcæ"), int(rng.choice(LENGTHS))))
        return number(inner[0], rng, 1)[0].item()
    if kind == 2:
        return message_of(store, inner, rng)
    sub, count = inner
    count = count if kind == 3 else int(rng.choice((0, 1, 2, 5)))
    if sub[0] == 1 and sub[1][0] != "string":
        return number(sub[1][0], rng, count)
    return [value_of(store, sub, rng) for _ in range(count)]


def number(kind: str, rng: np.random.Generator, count: int) -> Any:
    dtype = np.dtype({"bool": "?", "byte": "i1", "char": "u1"}.get(kind, kind))
    if kind == "bool":
        return rng.integers(0, 2, count).astype(bool)
    if dtype.kind == "f":
        return rng.choice([0.0, -1.5, math.nan, math.inf, rng.normal()], count).astype(dtype)
    info = np.iinfo(dtype)
    return rng.integers(info.min, info.max, count, dtype=dtype, endpoint=True)


def message_of(store: Any, name: str, rng: np.random.Generator) -> Any:
    return store.types[name](*(value_of(store, desc, rng) for _, desc in store.fielddefs[name][1]))


def scattered(raws: list[bytes], rng: np.random.Generator) -> tuple[bytes, np.ndarray, np.ndarray]:
    """Lay messages into one buffer in random order with gaps of noise; starts and sizes in message order."""
    starts = np.zeros(len(raws), np.int64)
    buffer = b""
    for index in rng.permutation(len(raws)):
        buffer += rng.bytes(int(rng.integers(0, 9)))
        starts[index] = len(buffer)
        buffer += raws[index]
    return buffer, starts, np.array([len(raw) for raw in raws], np.int64)


def element_paths(fields: dict[str, str]) -> list[str]:
    paths = []
    for path in fields:
        counts = [(0, 1, 4) if count == "" else range(int(count)) for count in re.findall(r"\[(\d*)\]", path)]
        blank = re.sub(r"\[\d*\]", "[{}]", path)
        paths += [blank.format(*picked) for picked in itertools.product(*counts)]
    return paths


def looked_up(message: Any, path: str) -> Any:
    """Evaluate a path on a decoded message; None where a sequence is too short."""
    for part in path.split("."):
        name, _, index = part.partition("[")
        message = getattr(message, name)
        if index:
            if int(index[:-1]) >= len(message):
                return None
            message = message[int(index[:-1])]
    return message


def assert_same(column: np.ndarray, expected: list[Any]) -> None:
    if column.dtype == object:
        assert column.tolist() == expected
    else:
        plain = [math.nan if value is None else value for value in expected]
        np.testing.assert_array_equal(column, np.array(plain, dtype=column.dtype))


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(definition=definitions(), seed=st.integers(0, 2**32 - 1), encoding=st.sampled_from(["ros1", "cdr"]))
def test_bulk_equals_the_ordinary_decoder(definition: Any, seed: int, encoding: str) -> None:
    name, texts = definition
    msgtype = name.replace("/", "/msg/")
    store, rng = store_of(texts), np.random.default_rng(seed)
    cdr = encoding == "cdr"
    kinds = [message_of(store, msgtype, rng) for _ in range(int(rng.integers(1, 5)))]
    # Mostly a few layouts that repeat, sometimes another: what a log looks like.
    messages = [
        kinds[rng.integers(len(kinds))] if rng.random() < 0.8 else message_of(store, msgtype, rng) for _ in range(COUNT)
    ]
    raws = [bytes((store.serialize_cdr if cdr else store.serialize_ros1)(one, msgtype)) for one in messages]
    decoded = [(store.deserialize_cdr if cdr else store.deserialize_ros1)(raw, msgtype) for raw in raws]

    paths = element_paths(leaf_fields(store, msgtype))
    wanted = [paths[index] for index in rng.permutation(len(paths))[: int(rng.integers(1, 12))]]
    decoder = decoder_for(encoding, store, msgtype, "/t", wanted, int(rng.integers(1, 60)))
    cuts = [0, *sorted(rng.integers(0, COUNT, 2).tolist()), COUNT]
    for first, last in itertools.pairwise(cuts):
        buffer, starts, sizes = scattered(raws[first:last], rng)
        decoder.add(buffer, starts, sizes, np.arange(first, last))
    series = decoder.finish()

    assert decoder.losses("x") == ()
    assert series.receive_ns.tolist() == list(range(COUNT))
    assert list(series.columns) == wanted
    for path in wanted:
        assert_same(series.columns[path], [looked_up(one, path) for one in decoded])
    stamps = [one.header.stamp for one in decoded] if "header.stamp.sec" in leaf_fields(store, msgtype) else None
    if stamps is None or texts[0].split("\n")[1] != "std_msgs/Header header":
        assert series.stamp_ns is None
    else:
        assert series.stamp_ns is not None
        assert series.stamp_ns.tolist() == [stamp.sec * 10**9 + stamp.nanosec for stamp in stamps]


@pytest.fixture
def decodes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Sizes of the messages that went through rosbags' decoder."""
    seen: list[int] = []
    values = bulk._Unpacker.values

    def counted(self: Any, data: bytes) -> Any:
        seen.append(len(data))
        return values(self, data)

    monkeypatch.setattr(bulk._Unpacker, "values", counted)
    return seen


def decode(encoding: Any, store: Any, msgtype: str, wanted: list[str], raws: list[bytes]) -> tuple[Any, Any]:
    decoder = decoder_for(encoding, store, msgtype, "/t", wanted, len(raws))
    sizes = np.array([len(raw) for raw in raws], np.int64)
    decoder.add(b"".join(raws), np.cumsum(sizes) - sizes, sizes, np.arange(len(raws)) * 1000)
    return decoder.finish(), decoder.losses("log.bag")


def odometry(store: Any, frame: str, x: float) -> Any:
    rng = np.random.default_rng(0)
    message = message_of(store, "nav_msgs/msg/Odometry", rng)
    message.header.frame_id, message.child_frame_id, message.pose.pose.position.x = frame, "base", x
    return message


@pytest.mark.parametrize("encoding", ["ros1", "cdr"])
def test_rosbags_decodes_one_sample_of_each_layout_and_no_more(encoding: str, decodes: list[int]) -> None:
    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    write = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    # The two strings trade lengths, so that both layouts have one total size.
    frames = [("odom", "base_link"), ("odometry_", "link")]
    pool = []
    for index in range(15):
        message = odometry(store, "", float(index))
        message.header.frame_id, message.child_frame_id = frames[index % 3 == 0]
        pool.append(bytes(write(message, "nav_msgs/msg/Odometry")))
    assert len({len(raw) for raw in pool}) == 1
    expected = [index % 15 for index in range(6000)]
    raws = [pool[index] for index in expected]
    wanted = ["pose.pose.position.x", "header.frame_id", "twist.covariance[35]"]
    series, losses = decode(encoding, store, "nav_msgs/msg/Odometry", wanted, raws)
    assert losses == ()
    assert len(decodes) == 2
    assert series.columns["pose.pose.position.x"].tolist() == expected
    assert series.columns["header.frame_id"].tolist() == [frames[index % 3 == 0][0] for index in expected]


@pytest.mark.parametrize("encoding", ["ros1", "cdr"])
def test_pieces_of_messages_give_what_whole_ones_do(encoding: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    write = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    frames = [("odom", "base_link"), ("odometry_", "link")]

    def message(index: int, other: bool) -> bytes:
        one = odometry(store, "", float(index))
        one.header.frame_id, one.child_frame_id = frames[other]
        one.twist.twist.angular.z = -float(index)
        raw = bytes(write(one, "nav_msgs/msg/Odometry"))
        # No UTF-8.
        return raw.replace(b"odom", b"od\xffm") if index == 701 else raw

    # The first call shows one layout, the second brings the other of the same total size.
    raws = [message(index, index >= 200 and index % 7 == 0) for index in range(3000)]
    size = len(raws[0])
    wanted = ["pose.pose.position.x", "header.frame_id", "twist.twist.angular.z"]
    copied: list[int] = []
    gathered = bulk.Fixed.gathered

    def counted(self: Any, buffer: Any, starts: Any) -> Any:
        copied.append(len(starts))
        return gathered(self, buffer, starts)

    monkeypatch.setattr(bulk.Fixed, "gathered", counted)
    decoder = decoder_for(encoding, store, "nav_msgs/msg/Odometry", "/t", wanted, len(raws))
    for first, last in ((0, 200), (200, 2900), (2900, 3000)):
        starts = np.arange(last - first) * size
        decoder.add(b"".join(raws[first:last]), starts, np.full(last - first, size), np.arange(first, last))
    series = decoder.finish()
    assert copied == [2048, 2700 - 2048]
    kept = [index for index in range(3000) if index != 701]
    assert [loss.messages for loss in decoder.losses("x")] == [1]
    assert series.receive_ns.tolist() == kept
    assert series.columns["pose.pose.position.x"].tolist() == [float(index) for index in kept]
    assert series.columns["twist.twist.angular.z"].tolist() == [-float(index) for index in kept]
    assert series.columns["header.frame_id"].tolist() == [frames[i >= 200 and i % 7 == 0][0] for i in kept]


def test_cdr_worked_by_hand(decodes: list[int]) -> None:
    # float64 after uint8: seven bytes of padding counted from behind the encapsulation header; then a string of
    # length 3 with its terminator, two bytes to the next float32.
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("uint8 a\nfloat64 b\nstring c\nfloat32 d\n", "p/msg/Hand"))
    raw = b"\0\1\0\0" + b"\7" + bytes(7) + struct.pack("<d", 2.5) + b"\4\0\0\0abc\0" + struct.pack("<f", -1.0)
    series, losses = decode("cdr", store, "p/msg/Hand", ["a", "b", "c", "d"], [raw, raw])
    assert losses == ()
    assert [column.tolist() for column in series.columns.values()] == [[7, 7], [2.5, 2.5], ["abc", "abc"], [-1.0, -1.0]]
    assert series.columns["a"].dtype == np.uint8
    assert series.columns["d"].dtype == np.float32
    assert len(decodes) == 1


def test_big_endian_cdr_is_decoded_slowly_but_right(decodes: list[int]) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    point = store.types["geometry_msgs/msg/Point"](1.5, -2.0, 3.0)
    little, big = (
        bytes(store.serialize_cdr(point, "geometry_msgs/msg/Point", little_endian=one)) for one in (True, False)
    )
    series, losses = decode("cdr", store, "geometry_msgs/msg/Point", ["y"], [little, big, little])
    assert losses == ()
    assert series.columns["y"].tolist() == [-2.0, -2.0, -2.0]
    assert len(decodes) >= 2


@pytest.mark.parametrize("identifier", range(6, 12))
def test_xcdr2_is_counted_not_misread(identifier: int) -> None:
    # XCDR2 aligns a float64 to 4, so reading it as plain CDR would give wrong numbers.
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("uint8 a\nfloat64 b\n", "p/msg/Two"))
    raw = bytes([0, identifier, 0, 0]) + b"\7\0\0\0" + struct.pack("<d", 2.5) + bytes(4)
    plain = bytes(store.serialize_cdr(store.types["p/msg/Two"](7, 2.5), "p/msg/Two"))
    series, losses = decode("cdr", store, "p/msg/Two", ["b"], [plain, raw, raw, plain])
    assert series.columns["b"].tolist() == [2.5, 2.5]
    assert [loss.messages for loss in losses] == [2]


def test_corrupt_messages_are_left_out_counted_and_dated() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    good = bytes(store.serialize_ros1(odometry(store, "odom", 1.0), "nav_msgs/msg/Odometry"))
    swollen = good[:12] + b"\xff\xff\xff\x7f" + good[16:]
    raws = [good, good[:-8], swollen, good, good + b"x", b"", good[:3], good]
    series, (loss,) = decode("ros1", store, "nav_msgs/msg/Odometry", ["pose.pose.position.x"], raws)
    assert series.receive_ns.tolist() == [0, 3000, 7000]
    assert series.columns["pose.pose.position.x"].tolist() == [1.0, 1.0, 1.0]
    assert (loss.file, loss.topic, loss.messages) == ("log.bag", "/t", 5)
    assert (loss.start_ns, loss.end_ns) == (1000, 6000)


def test_a_message_that_ends_behind_the_buffer_is_corrupt() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    raw = bytes(store.serialize_ros1(store.types["std_msgs/msg/Float64"](4.0), "std_msgs/msg/Float64"))
    decoder = decoder_for("ros1", store, "std_msgs/msg/Float64", "/t", ["data"], 2)
    decoder.add(raw, np.array([0, 4]), np.array([8, 8]), np.array([1, 2]))
    decoder.add(raw, np.array([9]), np.array([8]), np.array([3]))
    assert decoder.finish().columns["data"].tolist() == [4.0]
    assert decoder.losses("f")[0].messages == 2


def test_text_that_is_not_utf8_is_corrupt() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    raws = [struct.pack("<I", 2) + text for text in (b"ab", b"\xff\xfe", b"cd")]
    series, (loss,) = decode("ros1", store, "std_msgs/msg/String", ["data"], raws)
    assert series.columns["data"].tolist() == ["ab", "cd"]
    assert loss.messages == 1


def test_a_log_of_ever_new_lengths_is_still_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bulk, "MAX_GROUPS", 5)
    monkeypatch.setattr(bulk, "MAX_LAYOUTS", 3)
    store = get_typestore(Stores.ROS1_NOETIC)
    texts = ["x" * (index % 40) for index in range(400)]
    raws = [struct.pack("<I", len(text)) + text.encode() for text in texts]
    series, losses = decode("ros1", store, "std_msgs/msg/String", ["data"], raws)
    assert losses == ()
    assert series.columns["data"].tolist() == texts


def test_messages_without_content_keep_their_times() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    series, losses = decode("ros1", store, "std_msgs/msg/Empty", [], [b"", b""])
    assert series.receive_ns.tolist() == [0, 1000]
    assert (series.stamp_ns, dict(series.columns), losses) == (None, {}, ())


def test_fields_are_listed_in_message_order() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    assert list(leaf_fields(store, "sensor_msgs/msg/JointState").items()) == [
        ("header.seq", "uint32"),
        ("header.stamp.sec", "int32"),
        ("header.stamp.nanosec", "uint32"),
        ("header.frame_id", "string"),
        ("name[]", "string"),
        ("position[]", "float64"),
        ("velocity[]", "float64"),
        ("effort[]", "float64"),
    ]
    assert leaf_fields(store, "nobody/msg/Knows") == {}


@pytest.mark.parametrize(
    ("path", "says"),
    [
        ("pose.pose.position.xx", 'Did you mean "pose.pose.position.x"'),
        ("pose.pose", "name one value in it, such as pose.pose.position.x"),
        ("pose.covariance", "name one of them, covariance[0]"),
        ("pose.covariance[36]", "an index from 0 to 35"),
        ("pose.pose.position.x[0]", "without an index"),
        ("pose.pose.position.x.y", "end the path there"),
        ("", "name one of its fields"),
    ],
)
def test_a_wrong_field_is_one_clear_line(path: str, says: str) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    with pytest.raises(FerryIdError) as caught:
        decoder_for("ros1", store, "nav_msgs/msg/Odometry", "/odom", [path], 1, where="a.bag")
    message = str(caught.value)
    assert message.startswith("a.bag: /odom: ")
    assert says in message
    assert "Fix: " in message
    assert "\n" not in message
