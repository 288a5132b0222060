"""The MCAP reader held against the mcap package: same messages, same values, and nothing lost unsaid."""

from __future__ import annotations

import io
import shutil
import struct
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros1.decoder import DecoderFactory as Ros1Factory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from rosbags.typesys import Stores, get_typestore

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.formats.mcap import FORMAT
from ferryid.ingest.mcap_reader import McapLog, open_mcap

STORES = {"ros1": get_typestore(Stores.ROS1_NOETIC), "cdr": get_typestore(Stores.ROS2_HUMBLE)}
POINT = "geometry_msgs/msg/PointStamped"
NUMBER = "std_msgs/msg/Float64"
IMAGE = "sensor_msgs/msg/CompressedImage"
PATHS = {"/point": ("point.x", "header.frame_id"), "/number": ("data",)}
T0 = 1_700_000_000_000_000_000


@dataclass(frozen=True)
class Sample:
    """One message of a test log."""

    topic: str
    time_ns: int
    value: float
    frame: str = ""


def serialized(sample: Sample, encoding: str) -> bytes:
    store = STORES[encoding]
    types = store.types
    message: Any
    if sample.topic == "/number":
        message, name = types[NUMBER](sample.value), NUMBER
    else:
        time = types["builtin_interfaces/msg/Time"](sample.time_ns // 10**9, sample.time_ns % 10**9)
        header_type = types["std_msgs/msg/Header"]
        header = header_type(0, time, sample.frame) if encoding == "ros1" else header_type(time, sample.frame)
        if sample.topic == "/image":
            pixels = np.random.default_rng(sample.time_ns).integers(0, 256, int(sample.value), dtype=np.uint8)
            message, name = types[IMAGE](header, "jpeg", pixels), IMAGE
        else:
            message = types[POINT](header, types["geometry_msgs/msg/Point"](sample.value, 0.0, -1.0))
            name = POINT
    serialize = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    return bytes(serialize(message, name))


def written(samples: list[Sample], encoding: str = "cdr", **options: Any) -> bytes:
    """Write a log with the mcap package."""
    options.setdefault("compression", CompressionType.NONE)
    output = io.BytesIO()
    writer = Writer(output, **options)
    writer.start(profile="ros1" if encoding == "ros1" else "ros2", library="test")
    channels = {}
    for topic, name in (("/point", POINT), ("/number", NUMBER), ("/image", IMAGE)):
        if any(sample.topic == topic for sample in samples):
            channels[topic] = writer.register_channel(topic, encoding, schema_of(writer, name, encoding))
    for number, sample in enumerate(samples):
        data = serialized(sample, encoding)
        writer.add_message(channels[sample.topic], sample.time_ns, data, sample.time_ns, number)
    writer.finish()
    return output.getvalue()


def schema_of(writer: Writer, name: str, encoding: str) -> int:
    version = 1 if encoding == "ros1" else 2
    text = STORES[encoding].generate_msgdef(name, ros_version=version)[0]
    shown = name.replace("/msg/", "/") if encoding == "ros1" else name
    return writer.register_schema(shown, "ros1msg" if encoding == "ros1" else "ros2msg", text.encode())


def opened(content: bytes) -> McapLog:
    return McapLog(Path("log.mcap"), content)


def plain_log(count: int = 60, **options: Any) -> tuple[list[Sample], bytes]:
    samples = [
        Sample("/point" if number % 3 else "/number", T0 + number * 10_000_000, float(number), "map")
        for number in range(count)
    ]
    return samples, written(samples, **options)


def values(log: McapLog, topic: str, **options: Any) -> list[float]:
    path = PATHS[topic][0]
    return [float(value) for value in log.read({topic: [path]}, **options)[topic].columns[path]]


def expected(samples: list[Sample], topic: str) -> list[float]:
    return [sample.value for sample in samples if sample.topic == topic]


def said(log: McapLog) -> str:
    return " | ".join(loss.what for loss in log.losses)


samples_strategy = st.lists(
    st.builds(
        Sample,
        topic=st.sampled_from(["/point", "/number"]),
        time_ns=st.integers(0, 10**12).map(lambda offset: T0 + offset),
        value=st.floats(allow_nan=False),
        frame=st.text(max_size=9),
    ),
    min_size=1,
    max_size=40,
)
layouts = st.fixed_dictionaries(
    {
        "chunk_size": st.sampled_from([1, 200, 1000, 1 << 20]),
        "compression": st.sampled_from(list(CompressionType)),
        "use_chunking": st.booleans(),
        "use_statistics": st.booleans(),
        "use_summary_offsets": st.booleans(),
        "enable_crcs": st.booleans(),
        "enable_data_crcs": st.booleans(),
        "repeat_channels": st.booleans(),
        "repeat_schemas": st.booleans(),
        "index_types": st.sampled_from(
            [
                IndexType.ALL,
                IndexType.NONE,
                IndexType.CHUNK,
                IndexType.MESSAGE,
                IndexType.ALL ^ IndexType.MESSAGE,
            ]
        ),
    }
)


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(samples_strategy, layouts, st.sampled_from(["ros1", "cdr"]), st.booleans())
def test_same_answer_as_the_mcap_package(
    samples: list[Sample], layout: dict[str, Any], encoding: str, verify: bool
) -> None:
    content = written(samples, encoding, **layout)
    factory = Ros1Factory() if encoding == "ros1" else Ros2Factory()
    theirs: dict[str, list[Any]] = {topic: [] for topic in PATHS}
    schemas, channels, messages = {}, {}, []
    for record in StreamReader(io.BytesIO(content)).records:
        kind = type(record).__name__
        if kind == "Schema":
            schemas[record.id] = record
        elif kind == "Channel":
            channels[record.id] = record
        elif kind == "Message":
            messages.append(record)
    for message in messages:
        channel = channels[message.channel_id]
        decode = factory.decoder_for(channel.message_encoding, schemas[channel.schema_id])
        assert decode is not None
        theirs[channel.topic].append((message.log_time, decode(message.data)))

    log = opened(content)
    present = {topic: PATHS[topic] for topic in PATHS if theirs[topic]}
    series = log.read(present, verify=verify)
    assert log.losses == ()
    assert {topic.name: topic.count for topic in log.topics} == {topic: len(theirs[topic]) for topic in present}
    for topic in log.topics:
        times = [time for time, _ in theirs[topic.name]]
        assert (topic.start_ns, topic.end_ns) == (min(times), max(times))
        ours = series[topic.name]
        assert ours.receive_ns.tolist() == times
        if topic.name == "/number":
            assert ours.columns["data"].tolist() == [message.data for _, message in theirs["/number"]]
            assert ours.stamp_ns is None
        else:
            decoded = [message for _, message in theirs["/point"]]
            assert ours.columns["point.x"].tolist() == [message.point.x for message in decoded]
            assert ours.columns["header.frame_id"].tolist() == [message.header.frame_id for message in decoded]
            assert ours.stamp_ns is not None
            assert ours.stamp_ns.tolist() == times


@pytest.mark.slow
@settings(max_examples=120, deadline=None)
@given(
    st.data(),
    st.sampled_from(list(CompressionType)),
    st.booleans(),
    st.sampled_from([1, 400, 1500]),
)
def test_a_file_cut_anywhere_yields_every_intact_message(
    data: st.DataObject, compression: CompressionType, chunked: bool, chunk_size: int
) -> None:
    samples, content = plain_log(compression=compression, use_chunking=chunked, chunk_size=chunk_size)
    cut = data.draw(st.integers(9, len(content) - 1))
    part = content[:cut]
    log = opened(part)
    found = {topic.name: values(log, topic.name) for topic in log.topics}
    complete = in_whole_chunks(content, cut)
    for topic in PATHS:
        got, whole = found.get(topic, []), expected(samples, topic)
        assert got == whole[: len(got)]
        assert len(got) >= complete[topic]
        if not chunked or compression == CompressionType.NONE:
            intact = [
                record_bytes(sample, number) in part for number, sample in enumerate(samples) if sample.topic == topic
            ]
            assert len(got) == sum(intact)
    assert log.losses
    missing = len(samples) - sum(len(got) for got in found.values())
    assert missing == 0 or any(loss.messages is None for loss in log.losses)


def in_whole_chunks(content: bytes, cut: int) -> Counter[str]:
    """Count the messages per topic in the chunks that end before the cut, with the mcap package."""
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    ends = sorted(chunk.chunk_start_offset + chunk.chunk_length for chunk in summary.chunk_indexes)
    chunks = [
        record for record in StreamReader(io.BytesIO(content), emit_chunks=True).records if isinstance(record, Chunk)
    ]
    return Counter(
        summary.channels[message.channel_id].topic
        for end, chunk in zip(ends, chunks, strict=True)
        if end <= cut
        for message in breakup_chunk(chunk)
        if isinstance(message, Message)
    )


def record_bytes(sample: Sample, number: int) -> bytes:
    builder = RecordBuilder()
    channel = 1 if sample.topic == "/point" else 2
    Message(channel, sample.time_ns, serialized(sample, "cdr"), sample.time_ns, number).write(builder)
    return builder.end()


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(st.data(), st.sampled_from(list(CompressionType)), st.sampled_from([400, 1500]), st.booleans())
def test_a_flipped_byte_costs_at_most_its_chunk_and_is_told(
    data: st.DataObject, compression: CompressionType, chunk_size: int, verify: bool
) -> None:
    samples, content = plain_log(compression=compression, chunk_size=chunk_size)
    damaged = bytearray(content)
    place = data.draw(st.integers(8, len(content) - 1))
    damaged[place] ^= data.draw(st.integers(1, 255))
    log = opened(bytes(damaged))
    present = {topic.name for topic in log.topics}
    assert present == set(PATHS)
    series = log.read({topic: [PATHS[topic][0]] for topic in PATHS}, verify=verify)
    missing = 0
    for topic in PATHS:
        whole = expected(samples, topic)
        got = series[topic].columns[PATHS[topic][0]].tolist()
        assert not Counter(got) - Counter(whole)
        assert got == sorted(got)
        missing += len(whole) - len(got)
    chunks = StreamReader(io.BytesIO(content), emit_chunks=True).records
    largest = max(len(breakup_chunk(chunk)) for chunk in chunks if isinstance(chunk, Chunk))
    assert missing <= largest
    told = sum(loss.messages or 0 for loss in log.losses)
    assert told == missing or any(loss.messages is None for loss in log.losses)


def test_a_message_turned_into_the_end_of_the_data_is_told() -> None:
    samples, content = plain_log(use_chunking=False, enable_data_crcs=True)
    damaged = bytearray(content)
    first = record_bytes(samples[0], 0)
    place = content.index(first) + len(first)
    assert damaged[place] == 0x05
    damaged[place] = 0x0F
    log = opened(bytes(damaged))
    for topic in PATHS:
        values(log, topic, verify=True)
    assert log.losses


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_flipped_byte_outside_chunks_costs_one_message(data: st.DataObject) -> None:
    samples, content = plain_log(use_chunking=False, enable_data_crcs=True)
    end = content.index(bytes([0x0F]) + (4).to_bytes(8, "little"))
    start = content.index(record_bytes(samples[0], 0))
    damaged = bytearray(content)
    place = data.draw(st.integers(start, end - 1))
    damaged[place] ^= data.draw(st.integers(1, 255))
    log = opened(bytes(damaged))
    wrong = 0
    for topic in PATHS:
        got, whole = Counter(values(log, topic, verify=True)), Counter(expected(samples, topic))
        wrong += sum((whole - got).values())
        assert log.losses
    begins = [content.index(record_bytes(sample, number)) for number, sample in enumerate(samples)]
    within = place - max(begin for begin in begins if begin <= place)
    # A wrong length may by chance lead to the start of a later record, over whole messages; all else costs one.
    assert wrong <= 1 or 1 <= within <= 8


def image_log(compression: CompressionType) -> tuple[list[Sample], bytes]:
    """Small messages, and behind them in every chunk an image that closes it."""
    samples = []
    for number in range(12):
        time = T0 + number * 100_000_000
        samples += [
            Sample("/point", time, float(number), "map"),
            Sample("/image", time + 1, 300_000.0),
        ]
    return samples, written(samples, compression=compression, chunk_size=100_000)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_only_what_is_wanted_is_read(compression: CompressionType) -> None:
    samples, content = image_log(compression)
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    damaged = bytearray(content)
    chunk = summary.chunk_indexes[3]
    late = chunk.chunk_start_offset + chunk.chunk_length - 20_000
    damaged[late : late + 1000] = bytes(1000)
    log = opened(bytes(damaged))
    assert values(log, "/point") == expected(samples, "/point")
    assert log.losses == ()
    # Reading all of it finds the damage, and the messages of that chunk cannot be trusted any more.
    assert values(log, "/point", verify=True) == [float(n) for n in range(12) if n != 3]
    assert {(loss.topic, loss.messages) for loss in log.losses} == {("/point", 1), ("/image", 1)}
    assert all(loss.start_ns is not None and abs(loss.start_ns - T0 - 300_000_000) <= 1 for loss in log.losses)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_wanted_images_larger_than_a_batch(compression: CompressionType) -> None:
    samples = [Sample("/point", T0, 1.0), Sample("/image", T0 + 1, 6e6), Sample("/point", T0 + 2, 2.0)]
    log = opened(written(samples, compression=compression, chunk_size=1 << 23))
    series = log.read({"/image": ["data[5999999]"], "/point": ["point.x"]})
    pixels = np.random.default_rng(T0 + 1).integers(0, 256, 6_000_000, dtype=np.uint8)
    assert series["/image"].columns["data[5999999]"].tolist() == [pixels[-1]]
    assert series["/point"].columns["point.x"].tolist() == [1.0, 2.0]


def test_a_bad_chunk_is_told_with_its_time_and_count() -> None:
    samples, content = plain_log(chunk_size=1500)
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    damaged = bytearray(content)
    chunk = summary.chunk_indexes[1]
    damaged[chunk.chunk_start_offset + chunk.chunk_length - 3] ^= 0xFF
    log = opened(bytes(damaged))
    got = values(log, "/point")
    (loss,) = log.losses
    assert loss.topic == "/point"
    assert loss.messages == len(expected(samples, "/point")) - len(got) > 0
    assert loss.start_ns is not None
    assert loss.end_ns is not None
    assert chunk.message_start_time <= loss.start_ns <= loss.end_ns <= chunk.message_end_time
    assert "checksum" in loss.what


def test_neighbouring_bad_chunks_are_one_loss() -> None:
    _, content = plain_log(chunk_size=400, compression=CompressionType.ZSTD, enable_crcs=False)
    log = opened(content.replace(b"\x04\x00\x00\x00zstd", b"\x04\x00\x00\x00zstx"))
    assert values(log, "/point") == []
    (loss,) = log.losses
    assert (loss.topic, loss.messages) == ("/point", 40)
    assert "unknown compression 'zstx'" in loss.what


def test_a_damaged_message_index_is_replaced_by_a_walk() -> None:
    samples, content = plain_log(chunk_size=1500, compression=CompressionType.LZ4)
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    damaged = bytearray(content)
    place = summary.chunk_indexes[2].message_index_offsets[1]
    damaged[place + 15 + 8] ^= 0x01
    log = opened(bytes(damaged))
    assert values(log, "/point") == expected(samples, "/point")
    (loss,) = log.losses
    assert loss.messages == 0
    assert "walked" in loss.what


def test_an_index_in_order_of_time_gives_the_order_of_the_file() -> None:
    samples, content = plain_log(chunk_size=1500)
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    swapped = bytearray(content)
    first = summary.chunk_indexes[0].message_index_offsets[1] + 15
    swapped[first : first + 32] = content[first + 16 : first + 32] + content[first : first + 16]
    log = opened(bytes(swapped))
    assert values(log, "/point") == expected(samples, "/point")
    assert log.losses == ()


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_file_cut_between_the_message_indexes_of_a_chunk(compression: CompressionType) -> None:
    samples, content = plain_log(chunk_size=1500, compression=compression)
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[1]
    places = sorted(chunk.message_index_offsets.values())
    assert len(places) == 2
    complete = in_whole_chunks(content, places[1])
    for cut in (places[0], places[1], places[1] + 5):
        log = opened(content[:cut])
        for topic in PATHS:
            assert values(log, topic) == expected(samples, topic)[: complete[topic]]
        assert "without its end record" in said(log)


def test_a_wrong_time_in_a_message_without_checksum_is_told() -> None:
    samples, content = plain_log(enable_crcs=False)
    damaged = bytearray(content)
    damaged[content.index(record_bytes(samples[4], 4)) + 15] ^= 1
    log = opened(bytes(damaged))
    assert len(values(log, "/point")) == len(expected(samples, "/point"))
    assert "disagree" in said(log)


@pytest.mark.parametrize("change", [-30, -1, 1, 30, 100])
def test_a_wrong_length_outside_chunks_costs_its_message_only(change: int) -> None:
    samples, content = plain_log(use_chunking=False)
    damaged = bytearray(content)
    damaged[content.index(record_bytes(samples[4], 4)) + 1] += change
    log = opened(bytes(damaged))
    assert values(log, "/number") == expected(samples, "/number")
    assert values(log, "/point") == [value for value in expected(samples, "/point") if value != samples[4].value]
    told = [loss for loss in log.losses if " damaged byte" in loss.what]
    # One that is too short still counts as a message, and as one that its decoder refuses.
    before = samples[3 if change > 0 else 4]
    assert [(loss.start_ns, loss.end_ns) for loss in told] == [(before.time_ns, samples[5].time_ns)]
    assert change > 0 or [loss.messages for loss in log.losses if loss.topic == "/point"] == [1]


def test_definitions_in_a_damaged_summary_are_not_believed() -> None:
    samples, content = plain_log(compression=CompressionType.ZSTD)
    place = content.rindex(b"geometry_msgs/Point\nfloat64 x")
    damaged = content[:place] + b"f" + content[place + 1 :]
    log = opened(damaged)
    assert values(log, "/point") == expected(samples, "/point")
    (loss,) = log.losses
    assert loss.messages == 0
    assert "summary is wrong" in loss.what


@pytest.mark.parametrize("compression", list(CompressionType))
def test_small_chunks_are_always_checked(compression: CompressionType) -> None:
    samples = [Sample("/number", T0, 1.0), Sample("/image", T0 + 1, 20_000.0)]
    content = written(samples, compression=compression)
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    damaged = bytearray(content)
    (chunk,) = summary.chunk_indexes
    damaged[chunk.chunk_start_offset + chunk.chunk_length - 100] ^= 1
    log = opened(bytes(damaged))
    assert values(log, "/number") == []
    (loss,) = log.losses
    assert (loss.topic, loss.messages) == ("/number", 1)


def test_statistics_that_count_more_than_the_file_holds() -> None:
    samples, content = plain_log(enable_crcs=False)
    # channel_message_counts of channel 1: (u16 id, u64 count)
    damaged = content.replace(
        (1).to_bytes(2, "little") + (40).to_bytes(8, "little"),
        (1).to_bytes(2, "little") + (43).to_bytes(8, "little"),
    )
    log = opened(damaged)
    assert values(log, "/point") == expected(samples, "/point")
    (loss,) = log.losses
    # The statistics contradict themselves, and nothing in the file is damaged.
    assert loss.messages == 0
    assert "cannot be true (60 messages, 63 when added up by channel)" in loss.what
    # message_count in front of schema_count and channel_count
    log = opened(damaged.replace(struct.pack("<QHI", 60, 2, 2), struct.pack("<QHI", 63, 2, 2)))
    assert values(log, "/point") == expected(samples, "/point")
    (loss,) = log.losses
    assert (loss.topic, loss.messages) == ("/point", None)
    assert "3 messages more" in loss.what


def several_channels(second: str) -> bytes:
    output = io.BytesIO()
    writer = Writer(output, chunk_size=300, compression=CompressionType.ZSTD)
    writer.start("ros2", "test")
    ids = [
        writer.register_channel("/a", "cdr", schema_of(writer, NUMBER, "cdr"), {"from": "one"}),
        writer.register_channel("/a", "cdr", schema_of(writer, second, "cdr"), {"from": "two"}),
    ]
    store = STORES["cdr"]
    for number in range(20):
        name = (NUMBER, second)[number % 2]
        message = store.types[name](float(number) if "Float" in name else number)
        data = bytes(store.serialize_cdr(message, name))
        writer.add_message(ids[number % 2], T0 + number, data, T0 + number)
    writer.finish()
    return output.getvalue()


def test_channels_of_one_topic_merge_in_file_order() -> None:
    log = opened(several_channels(NUMBER))
    (topic,) = log.topics
    assert (topic.count, topic.note) == (20, "")
    assert log.read({"/a": ["data"]})["/a"].columns["data"].tolist() == [float(number) for number in range(20)]


def test_two_definitions_on_one_topic() -> None:
    log = opened(several_channels("std_msgs/msg/Float32"))
    (topic,) = log.topics
    assert topic.count == 20
    assert "2 different definitions on one topic" in topic.note
    assert "std_msgs/msg/Float32" in topic.note
    series = log.read({"/a": ["data"]})["/a"]
    assert series.columns["data"].tolist() == [float(number) for number in range(20)]
    assert log.losses == ()

    store = STORES["cdr"]
    header = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](1, 2), "x")
    output = io.BytesIO()
    writer = Writer(output)
    writer.start("ros2", "test")
    one = writer.register_channel("/a", "cdr", schema_of(writer, NUMBER, "cdr"))
    two = writer.register_channel("/a", "cdr", schema_of(writer, "std_msgs/msg/Header", "cdr"), {"k": "v"})
    writer.add_message(one, T0, bytes(store.serialize_cdr(store.types[NUMBER](4.0), NUMBER)), T0)
    writer.add_message(two, T0, bytes(store.serialize_cdr(header, "std_msgs/msg/Header")), T0)
    writer.finish()
    log = opened(output.getvalue())
    assert log.read({"/a": ["data"]})["/a"].columns["data"].tolist() == [4.0]
    (loss,) = log.losses
    assert (loss.topic, loss.messages) == ("/a", 1)
    assert "std_msgs/msg/Header" in loss.what


def channel_log(encoding: str, schema: tuple[str, str, bytes] | None, messages: list[bytes]) -> McapLog:
    output = io.BytesIO()
    writer = Writer(output, compression=CompressionType.NONE)
    writer.start("", "test")
    schema_id = writer.register_schema(*schema) if schema else 0
    channel = writer.register_channel("/a", encoding, schema_id)
    for number, message in enumerate(messages):
        writer.add_message(channel, T0 + number, message, T0 + number)
    writer.finish()
    return opened(output.getvalue())


@pytest.mark.parametrize(
    ("encoding", "schema", "note"),
    [
        ("cbor", None, "encoding 'cbor' cannot be decoded"),
        ("cdr", None, "no schema"),
        ("cdr", ("some_msgs/msg/Thing", "", b""), "no definition"),
        ("cdr", ("a/msg/B", "protobuf", b"x"), "does not fit"),
        ("cdr", ("a/srv/B_Event", "ros2msg", b"int64 a\n---\nint64 b\n"), "of a service"),
        ("protobuf", ("a.B", "protobuf", b""), "no definition"),
    ],
)
def test_channels_that_cannot_be_decoded_are_listed(
    encoding: str, schema: tuple[str, str, bytes] | None, note: str
) -> None:
    log = channel_log(encoding, schema, [b"12345678"] * 3)
    (topic,) = log.topics
    assert (topic.count, topic.start_ns, topic.end_ns) == (3, T0, T0 + 2)
    assert note in topic.note
    with pytest.raises(FerryIdError, match=r"cannot be decoded.*Fix: "):
        log.read({"/a": ["x"]})


@pytest.mark.parametrize("text", [b"float64 data[", b"float64 data\nother_msgs/Thing more\n", b"\xff\xfe"])
def test_a_definition_that_is_no_definition(text: bytes) -> None:
    log = channel_log("cdr", ("a_msgs/msg/B", "ros2msg", text), [b"\0\1\0\0" + bytes(8)])
    assert dict(log.topics[0].fields) == {}
    with pytest.raises(FerryIdError, match=r"a_msgs/msg/B.*Fix: "):
        log.read({"/a": ["data"]})


def test_a_type_without_definition_takes_the_bundled_one_and_says_so() -> None:
    store = STORES["cdr"]
    data = bytes(store.serialize_cdr(store.types[NUMBER](2.5), NUMBER))
    log = channel_log("cdr", (NUMBER, "", b""), [data])
    assert "stands in" in log.topics[0].note
    assert log.read({"/a": ["data"]})["/a"].columns["data"].tolist() == [2.5]


IDL = """module boat_msgs {
  module msg {
    struct Speed {
      boat_msgs::msg::Unit unit;
      double value;
      sequence<float> more;
    };
  };
};
"""
UNIT = """module boat_msgs {
  module msg {
    struct Unit {
      int32 code;
    };
  };
};
"""


@pytest.mark.parametrize("headed", [True, False])
def test_idl_definitions(headed: bool) -> None:
    line = "=" * 80 + "\nIDL: "
    first = f"{line}boat_msgs/msg/Speed\n" if headed else ""
    text = f"{first}{IDL}{line}boat_msgs/msg/Unit\n{UNIT}"
    data = b"\0\1\0\0" + np.int32(7).tobytes() + bytes(4) + np.float64(1.5).tobytes()
    data += np.uint32(2).tobytes() + np.array([3, 4], "<f4").tobytes()
    log = channel_log("cdr", ("boat_msgs/msg/Speed", "ros2idl", text.encode()), [data])
    assert dict(log.topics[0].fields) == {"unit.code": "int32", "value": "float64", "more[]": "float32"}
    columns = log.read({"/a": ["unit.code", "value", "more[1]", "more[2]"]})["/a"].columns
    assert [columns[path].tolist() for path in ("unit.code", "value", "more[1]")] == [[7], [1.5], [4.0]]
    assert np.isnan(columns["more[2]"]).all()


def test_wrong_topic_and_field() -> None:
    _, content = plain_log()
    with pytest.raises(FerryIdError, match=r'no topic /pont.*Did you mean "/point"'):
        opened(content).read({"/pont": []})
    with pytest.raises(FerryIdError, match=r"log.mcap: /point: no field 'point.q'"):
        opened(content).read({"/point": ["point.q"]})


def test_no_fields_wanted_gives_times() -> None:
    samples, content = plain_log()
    series = opened(content).read({"/point": []})["/point"]
    assert series.columns == {}
    times = [sample.time_ns for sample in samples if sample.topic == "/point"]
    assert series.receive_ns.tolist() == times
    assert series.stamp_ns is not None
    assert series.stamp_ns.tolist() == times


def test_empty_and_foreign_files(tmp_path: Path) -> None:
    empty = io.BytesIO()
    writer = Writer(empty)
    writer.start()
    writer.finish()
    log = opened(empty.getvalue())
    assert (log.topics, log.losses) == ((), ())
    log = opened(empty.getvalue()[:8])
    assert log.topics == ()
    assert "without its end record" in said(log)
    foreign = tmp_path / "a.mcap"
    foreign.write_bytes(b"\x89MCAP1\r\nxxxxxxx")
    with pytest.raises(FerryIdError, match=r"not an MCAP file.*Fix: "):
        open_mcap(foreign)


def test_opening_by_content(tmp_path: Path) -> None:
    samples, content = plain_log()
    path = tmp_path / "trial"
    path.write_bytes(content)
    assert FORMAT.matches(path, content[:64])
    assert not FORMAT.matches(path, b"#ROSBAG V2.0\n")
    reader = open_log(path)
    assert reader.paths == (path,)
    assert len(reader.read({"/number": ["data"]})["/number"].receive_ns) == len(expected(samples, "/number"))


@pytest.mark.slow
def test_conformance_files(shared_data: Any) -> None:
    """Every published MCAP file: the same messages as the mcap package gives, every checksum right."""
    files = sorted(shared_data("conformance").rglob("*.mcap"))
    assert files
    for file in files:
        with file.open("rb") as stream:
            counts = Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())
        log = open_mcap(file)
        assert {topic.name: topic.count for topic in log.topics if topic.count} == counts
        wanted = {topic.name: [] for topic in log.topics if not topic.note}
        for name, series in log.read(wanted, verify=True).items():
            assert len(series.receive_ns) == counts[name]
        assert log.losses == ()


def test_a_real_file_cut_in_the_middle(shared_data: Any, tmp_path: Path) -> None:
    source = shared_data("conformance/MichaelGrupp+evo/test/data/nav2_turtlebot.mcap")
    cut = tmp_path / "cut.mcap"
    shutil.copyfile(source, cut)
    with cut.open("r+b") as file:
        file.truncate(source.stat().st_size // 2)
    whole = open_mcap(source).read({"/odom": ["pose.pose.position.x"]})["/odom"]
    log = open_mcap(cut)
    part = log.read({"/odom": ["pose.pose.position.x"]})["/odom"]
    count = len(part.receive_ns)
    assert 0 < count < len(whole.receive_ns)
    path = "pose.pose.position.x"
    assert part.columns[path].tolist() == whole.columns[path][:count].tolist()
    assert log.losses
