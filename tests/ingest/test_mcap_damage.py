"""Damaged and hostile MCAP files: what is returned and what is reported lost add up to what was written."""

from __future__ import annotations

import struct
from pathlib import Path

import lz4.frame
import pytest
import zstandard

from ferryid.errors import FerryIdError
from ferryid.ingest import mcap_index
from ferryid.ingest.mcap_reader import McapLog
from tests.ingest.mcap_records import (
    COUNT,
    DATA_END,
    DEFINITIONS,
    HEAD,
    MAGIC,
    PER_CHUNK,
    T0,
    accounted,
    channel,
    chunk,
    chunk_records,
    footer,
    message,
    message_index,
    read,
    record,
    statistics,
    text,
    with_summary,
    without_summary,
)

ALL = [float(number) for number in range(COUNT)]
STATISTICS = struct.Struct("<QHIIIIQQI")
COMPRESSIONS = ["", "zstd", "lz4"]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("verify", [False, True])
def test_files_written_by_record_are_sound(compression: str, verify: bool) -> None:
    assert read(with_summary(chunk_records(compression)), verify=verify) == (ALL, ())
    got, losses = read(without_summary(chunk_records(compression)), verify=verify)
    assert got == ALL
    assert all("end" in loss.what for loss in losses)


@pytest.mark.slow
@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_flipped_bit_in_either_size_of_a_chunk_loses_nothing(compression: str) -> None:
    chunks = chunk_records(compression)
    content = without_summary(chunks)
    offset = content.index(chunks[1][0])
    for place in (offset + 1, offset + 41 + len(compression)):
        for bit in range(12):
            damaged = bytearray(content)
            damaged[place + bit // 8] ^= 1 << bit % 8
            got, losses = accounted(bytes(damaged))
            assert got == ALL
            assert any("two different sizes" in loss.what for loss in losses)


def with_another_value(one: bytes, number: int) -> bytes:
    """Return a chunk that is not compressed with another value in one of its messages, and its checksum as it was."""
    value = struct.pack("<d", number)
    assert one.count(value) == 1
    return one.replace(value, struct.pack("<d", 1000 + number))


UNCOMPRESSED_SIZE, CRC, COMPRESSED_SIZE = slice(25, 33), slice(33, 37), slice(41, 49)


@pytest.mark.parametrize("verify", [False, True])
@pytest.mark.parametrize(
    "zeroed", [[COMPRESSED_SIZE], [UNCOMPRESSED_SIZE, COMPRESSED_SIZE], [CRC], [CRC, COMPRESSED_SIZE]]
)
def test_no_zero_in_the_header_of_a_chunk_lets_its_messages_escape_its_checksum(
    zeroed: list[slice], verify: bool
) -> None:
    chunks = chunk_records("")
    damaged = bytearray(with_another_value(chunks[1][0], PER_CHUNK + 4))
    for place in zeroed:
        damaged[place] = bytes(place.stop - place.start)
    chunks[1] = bytes(damaged), chunks[1][1]
    got, losses = accounted(without_summary(chunks), verify=verify)
    assert got == [value for value in ALL if not PER_CHUNK <= value < 2 * PER_CHUNK]
    assert sum(loss.messages or 0 for loss in losses) == PER_CHUNK


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_file_of_which_few_chunks_have_a_checksum_is_read_whole(compression: str) -> None:
    # A tool that rescues a file copies the chunks that are sound and writes the others anew.
    chunks = [*chunk_records(compression, crc=False)[:3], chunk_records(compression)[3]]
    got, losses = accounted(without_summary(chunks))
    assert (got, len(losses)) == (ALL, 2)


@pytest.mark.parametrize("summary", [True, False])
@pytest.mark.parametrize("change", ["replaced", "added", "dropped"])
def test_index_entries_that_name_a_message_twice_or_leave_one_out(summary: bool, change: str) -> None:
    chunks = chunk_records("zstd")
    entries = list(chunks[2][1])
    if change == "replaced":
        entries[4] = entries[5]
    elif change == "added":
        entries.insert(4, entries[4])
    else:
        del entries[4]
    chunks[2] = chunks[2][0], entries
    got, losses = accounted(with_summary(chunks) if summary else without_summary(chunks))
    assert got == ALL
    assert any("walked" in loss.what for loss in losses)


@pytest.mark.parametrize("place", [1, 3])
@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_message_cut_out_of_a_chunk_of_a_file_that_was_not_closed_is_missed(compression: str, place: int) -> None:
    chunks = chunk_records(compression)
    first = place * PER_CHUNK
    rest = b"".join(message(number) for number in range(first, first + PER_CHUNK) if number != first + 4)
    chunks[place] = chunk(rest, compression, start=T0 + first), chunks[place][1]
    got, losses = accounted(without_summary(chunks))
    assert got == [number for number in ALL if number != first + 4]
    assert any("message index" in loss.what and loss.messages is None for loss in losses)


@pytest.mark.parametrize("summary", [True, False])
def test_a_message_index_that_is_there_twice_or_not_at_all(summary: bool) -> None:
    chunks = chunk_records()
    content = with_summary(chunks) if summary else without_summary(chunks)
    index = message_index(chunks[1][1])
    for changed in (content.replace(index, 2 * index), content.replace(index, b"")):
        got, losses = accounted(changed)
        assert got == ALL
        assert losses


@pytest.mark.parametrize("summary", [True, False])
def test_a_chunk_that_is_there_twice_is_read_once(summary: bool) -> None:
    chunks = chunk_records()
    chunks.insert(3, chunks[1])
    got, losses = accounted(with_summary(chunks) if summary else without_summary(chunks))
    assert got == ALL
    assert any("twice, byte for byte" in loss.what for loss in losses)


@pytest.mark.parametrize("opcode", [*range(1, 16), 0x25, 0x85])
def test_a_message_turned_into_another_record_is_reported(opcode: int) -> None:
    parts = [message(number) for number in range(COUNT)]
    parts[20] = bytes([opcode]) + parts[20][1:]
    if opcode != 5:
        got, losses = accounted(HEAD + b"".join(parts) + DATA_END + footer(0))
        assert got == [value for value in ALL if value != 20]
        assert losses


def test_the_end_of_the_data_is_where_no_message_follows() -> None:
    parts = [message(number) for number in range(COUNT)]
    got, losses = accounted(HEAD + b"".join([*parts[:20], DATA_END, *parts[20:]]))
    assert got == ALL
    assert any("misplaced" in loss.what for loss in losses)


def test_a_message_that_is_there_twice_is_read_once() -> None:
    parts = [message(number) for number in range(COUNT)]
    got, losses = accounted(HEAD + b"".join([*parts[:20], *parts[10:]]) + DATA_END + footer(0))
    assert got == ALL
    assert any("10 messages are in the file twice" in loss.what for loss in losses)


@pytest.mark.parametrize("listed", [[0, 1, 3], [0, 1, 1, 3], [0, 1, 3, 3]])
def test_a_chunk_that_the_summary_leaves_out_is_found(listed: list[int]) -> None:
    for stated in (None, statistics(chunks=len(listed)), statistics(COUNT - PER_CHUNK, chunks=len(listed)), b""):
        got, _ = accounted(with_summary(chunk_records("lz4"), listed=listed, stated=stated))
        assert got == ALL


def test_a_chunk_cut_out_of_a_finished_file_is_missed() -> None:
    chunks = chunk_records("zstd")
    content = with_summary(chunks)
    cut = chunks[1][0] + message_index(chunks[1][1])
    got, losses = accounted(content.replace(cut, b""))
    assert got == [value for value in ALL if not PER_CHUNK <= value < 2 * PER_CHUNK]
    assert any(f"count {PER_CHUNK} messages more" in loss.what for loss in losses)
    assert any(f"{len(cut)} bytes before" in loss.what for loss in losses)


def test_messages_are_counted_once_as_they_are_found() -> None:
    chunks = chunk_records("zstd")
    cut = chunks[1][0] + message_index(chunks[1][1])
    log = McapLog(Path("log.mcap"), with_summary(chunks).replace(cut, b""))
    (topic,) = log.topics
    assert topic.count == COUNT - PER_CHUNK
    for wanted in ({}, {"/a": ["data"]}):
        log.read(wanted)
        missing = [loss.messages for loss in log.losses if "messages more than are in it" in loss.what]
        assert missing == [PER_CHUNK]


def test_damaged_chunks_far_apart_are_as_long_as_they_are() -> None:
    chunks = chunk_records("")
    for number in (0, 3):
        one = bytearray(chunks[number][0])
        one[-1] ^= 1
        chunks[number] = bytes(one), chunks[number][1]
    _, losses = accounted(with_summary(chunks), verify=True)
    (loss,) = (loss for loss in losses if loss.topic == "/a")
    assert (loss.messages, loss.start_ns, loss.end_ns) == (2 * PER_CHUNK, T0, T0 + COUNT - 1)
    assert loss.seconds == pytest.approx(2 * (PER_CHUNK - 1) * 1e-9)


@pytest.mark.parametrize("stated", [2**60, 2**63, 2**64 - 1, COUNT + 5, COUNT - 5, 0])
def test_statistics_that_lie_cost_neither_memory_nor_messages(stated: int) -> None:
    for lie in (statistics(stated), statistics(COUNT, stated), statistics(stated, COUNT), statistics(chunks=77)):
        got, losses = accounted(with_summary(chunk_records("zstd"), stated=lie))
        assert got == ALL
        assert losses or lie == statistics(chunks=77)


@pytest.mark.parametrize("time_ns", [2**63, 2**64 - 1])
@pytest.mark.parametrize("verify", [False, True])
def test_times_that_cannot_be_represented_are_reported(time_ns: int, verify: bool) -> None:
    parts = [message(0), message(1, time_ns=time_ns), message(2)]
    entries = [(T0, 0), (time_ns, len(parts[0])), (T0 + 2, len(parts[0]) + len(parts[1]))]
    one = chunk(b"".join(parts), "zstd", start=time_ns - 200)
    far = bytearray(one)
    far[17:25] = struct.pack("<Q", time_ns)
    stated = statistics(3, chunks=1)
    chunked = [[(made, entries)] for made in (one, bytes(far))]
    files = [HEAD + b"".join(parts), *map(without_summary, chunked)]
    for content in (*files, *(with_summary(chunks, stated=stated) for chunks in chunked)):
        got, losses = accounted(content, written=3, verify=verify)
        assert got == [0.0, 2.0]
        assert [loss.messages for loss in losses if "cannot be represented, were left out" in loss.what] == [1]
        (topic,) = McapLog(Path("log.mcap"), content).topics
        assert (topic.start_ns, topic.end_ns) == (T0, T0 + 2)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("stated", [0, 100, 500, 1 << 20, 3 << 30, 1 << 63, (1 << 64) - 1])
def test_a_chunk_that_states_a_wrong_size_is_reported(compression: str, stated: int) -> None:
    content = b"".join(message(number) for number in range(COUNT))
    for crc in (True, False):
        _, losses = accounted(HEAD + chunk(content, compression, size=stated, crc=crc) + DATA_END + footer(0))
        assert any("a chunk" in loss.what and loss.messages is None for loss in losses)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_an_honest_chunk_is_read_however_well_it_is_compressed(compression: str) -> None:
    image = record(5, struct.pack("<HIQQ", 2, 9, T0, T0) + bytes(8 << 20))
    content = b"".join([channel(2, "/image"), *[message(number) for number in range(COUNT)], image])
    assert accounted(HEAD + chunk(content, compression) + DATA_END + footer(0)) == (ALL, ())


@pytest.mark.parametrize("compress", [zstandard.compress, lz4.frame.compress])
def test_a_chunk_of_more_messages_than_bytes_is_refused(compress: object) -> None:
    compression = "zstd" if compress is zstandard.compress else "lz4"
    bomb = chunk(message(0, data=b"") * 1_000_000, compression)
    got, losses = read(HEAD + chunk(message(1)) + bomb + DATA_END + footer(0))
    assert got == [1.0]
    (loss,) = losses
    assert (loss.messages, "more records than it has bytes" in loss.what) == (None, True)


def test_all_chunks_of_a_file_together_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ferryid.ingest.mcap_recovery.MAX_EXPANDED", 0)
    monkeypatch.setattr("ferryid.ingest.mcap_recovery.MAX_RATIO", 0)
    got, losses = accounted(with_summary(chunk_records("zstd")))
    assert got == []
    assert sum(loss.messages or 0 for loss in losses) == COUNT


def test_a_channel_that_is_defined_twice_is_reported() -> None:
    content = HEAD + message(0) + channel(1, "/b") + message(1)
    _, losses = read(content)
    assert any("channel 1 is defined as '/a'" in loss.what and "'/b'" in loss.what for loss in losses)
    renamed = with_summary(chunk_records(), definitions=DEFINITIONS + channel(1, "/b"))
    assert McapLog(Path("log.mcap"), renamed).losses == ()
    chunks = chunk_records()
    first = channel() + b"".join(message(number) for number in range(PER_CHUNK))
    entries = [(time, place + len(channel())) for time, place in chunks[0][1]]
    chunks[0] = chunk(first, "zstd", start=T0), entries
    (loss,) = McapLog(Path("log.mcap"), with_summary(chunks, definitions=DEFINITIONS + channel(1, "/b"))).losses
    assert loss.messages is None
    assert "channel 1 is defined as '/b'" in loss.what


@pytest.mark.parametrize("wrong_first", [True, False])
def test_of_definitions_that_contradict_each_other_that_of_more_records_stands(wrong_first: bool) -> None:
    right, wrong = channel(1, "/a"), channel(1, "/b")
    assert right in HEAD
    definitions = [wrong, right, right] if wrong_first else [right, right, wrong]
    got, losses = read(HEAD.replace(right, b"".join(definitions)) + message(0) + DATA_END + footer(0))
    assert got == [0.0]
    assert any("is defined as" in loss.what for loss in losses)


@pytest.mark.parametrize("wrong_first", [True, False])
def test_a_summary_with_a_wrong_id_does_not_lend_messages_to_another_topic(wrong_first: bool) -> None:
    """The summary has the id of another topic, beside the right definition, which the first chunk has as well."""
    chunks = chunk_records("zstd")
    first = channel(1, "/a") + b"".join(message(number) for number in range(PER_CHUNK))
    chunks[0] = chunk(first, "zstd", start=T0), [(time, place + len(channel(1, "/a"))) for time, place in chunks[0][1]]
    both = [channel(1, "/b"), channel(1, "/a")]
    definitions = DEFINITIONS + b"".join(both if wrong_first else both[::-1])
    got, losses = read(with_summary(chunks, definitions=definitions))
    assert got == ALL
    assert any("is defined as" in loss.what for loss in losses)


@pytest.mark.parametrize("cut", [30, 50, 100])
def test_a_message_made_of_the_ends_of_two_is_none(cut: int) -> None:
    """Bytes are missing in a chunk that is not compressed, from within the value of its fourth message on."""
    one = chunk(b"".join(message(number) for number in range(PER_CHUNK)), "", start=T0, crc=False)
    place = one.index(message(4)) - 4
    content = HEAD + one[:place] + one[place + cut :] + DATA_END + footer(0) + MAGIC
    got, losses = read(content)
    assert got == [0.0, 1.0, 2.0]
    assert any(loss.messages is None for loss in losses)


@pytest.mark.parametrize("opcode", [3, 4, 8, 9, 11, 12])
@pytest.mark.parametrize("length", [0, 4, 2**31, 2**63, 2**64 - 1])
def test_records_of_absurd_length_hide_nothing_behind_them(opcode: int, length: int) -> None:
    parts = [message(number) for number in range(COUNT)]
    for damaged in (struct.pack("<BQ", opcode, length) + b"\xff" * 40, record(opcode, b"\xff" * 70)):
        got, losses = accounted(HEAD + b"".join([*parts[:30], damaged, *parts[30:]]) + DATA_END + footer(0))
        assert got == ALL
        assert any(loss.messages is None for loss in losses)


@pytest.mark.parametrize("move", [-1000, -13, -1, 1, 9, 60])
def test_a_footer_that_points_elsewhere_loses_nothing(move: int) -> None:
    content = with_summary(chunk_records("zstd"))
    (start,) = struct.unpack_from("<Q", content, len(content) - 28)
    for crc in (content[-12:-8], bytes(4)):
        got, losses = accounted(content[:-28] + struct.pack("<Q", start + move) + content[-20:-12] + crc + content[-8:])
        assert got == ALL
        assert losses or move == -13


def test_many_damaged_places_are_reported_together() -> None:
    parts = [message(number) + bytes(12) for number in range(400)]
    _, losses = read(HEAD + b"".join(part + message(0) * 3 for part in parts))
    assert len(losses) < 10
    assert any("places" in loss.what for loss in losses)


def test_a_definition_longer_than_its_record_is_no_definition() -> None:
    bad = record(4, struct.pack("<HH", 2, 1) + struct.pack("<I", 2**31) + text("cdr") + bytes(4))
    got, losses = accounted(HEAD + bad + b"".join(message(number) for number in range(COUNT)))
    assert got == ALL
    assert any("1 damaged, unknown or misplaced record " in loss.what for loss in losses)


def test_a_summary_that_lists_a_chunk_behind_the_file_is_not_believed() -> None:
    content = with_summary(chunk_records())
    # A ChunkIndex record: start and end time, offset of the chunk, its length, message index offsets.
    start = content.rindex(struct.pack("<QQ", T0 + 45, T0 + 145))
    (offset,) = struct.unpack_from("<Q", content, start + 16)
    damaged = bytearray(content)
    for place in (start + 16, start + 38):
        moved = struct.unpack_from("<Q", content, place)[0] + 10 * len(content)
        damaged[place : place + 8] = struct.pack("<Q", moved)
    damaged[-12:-8] = bytes(4)
    assert offset < len(content)
    got, losses = accounted(bytes(damaged))
    assert got == ALL
    assert losses


@pytest.mark.parametrize("summary", [True, False])
def test_a_message_index_turned_into_a_message_is_no_message(summary: bool) -> None:
    chunks = chunk_records()
    content = with_summary(chunks) if summary else without_summary(chunks)
    index = message_index(chunks[1][1])
    got, losses = accounted(content.replace(index, b"\x05" + index[1:]))
    assert got == ALL
    assert losses


def test_a_message_named_twice_in_a_chunk_that_cannot_be_read_is_lost_once() -> None:
    chunks = chunk_records("zstd")
    entries = [chunks[1][1][0], *chunks[1][1]]
    chunks[1] = chunks[1][0][:-9] + bytes(9), entries
    got, losses = accounted(without_summary(chunks))
    assert len(got) == COUNT - PER_CHUNK
    assert PER_CHUNK in [loss.messages for loss in losses]


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_statistics_of_well_compressed_chunks_without_an_index_are_believed(compression: str) -> None:
    still = b"\0\1\0\0" + bytes(8)
    inside = b"".join(message(number, time_ns=T0 + number // 20, data=still) for number in range(2000))
    data = HEAD + chunk(inside, compression) + DATA_END
    summary = DEFINITIONS + channel() + statistics(2000, chunks=1)
    got, losses = read(data + summary + footer(len(data), summary, crc=True))
    assert (len(got), losses) == (2000, ())


def unchunked(numbers: range, key: int = 1) -> bytes:
    """Return a finished file of messages outside chunks."""
    head = MAGIC + record(1, text("ros2") + text("test")) + DEFINITIONS + channel(key)
    data = head + b"".join(message(number, key) for number in numbers) + DATA_END
    summary = DEFINITIONS + channel(key) + record(11, STATISTICS.pack(len(numbers), 1, 1, 0, 0, 0, T0, T0 + COUNT, 0))
    return data + summary + footer(len(data), summary, crc=True)


def test_more_channels_than_any_vessel_records_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    channels = b"".join(channel(key, f"/a{key}") for key in range(12))
    for content in (
        HEAD + channels,
        HEAD + chunk(channels, "zstd"),
        with_summary([], definitions=DEFINITIONS + channels),
    ):
        McapLog(Path("log.mcap"), content)
        with monkeypatch.context() as patch:
            patch.setattr(mcap_index, "MAX_CHANNELS", 10)
            with pytest.raises(FerryIdError, match=r"log.mcap: .* more than 10 channels.* Fix: "):
                McapLog(Path("log.mcap"), content)


def test_the_records_that_chunks_hold_are_bounded_for_the_whole_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_index, "SPARE_RECORDS", 1000)
    chunks = [chunk(message(number) + message(99) * 400, "zstd") for number in range(30)]
    log = McapLog(Path("log.mcap"), HEAD + b"".join(chunks) + DATA_END + footer(0))
    assert 2 <= log.topics[0].count < 20
    assert any("more records than it has bytes in the file" in loss.what for loss in log.losses)


@pytest.mark.slow
def test_small_chunks_are_read_some_at_a_time() -> None:
    chunks = [chunk(message(number), "lz4", start=T0 + number) for number in range(500)]
    log = McapLog(Path("log.mcap"), HEAD + b"".join(chunks) + DATA_END + footer(0))
    assert log.read({"/a": ["data"]})["/a"].columns["data"].tolist() == list(range(500))
    assert sum(1 for _ in log._loaded([1], False)) < 5


@pytest.mark.parametrize(("cut", "short"), [(0, 0), (30, 0), (0, 30), (90, 0), (0, 90)])
def test_a_log_behind_another_is_read(cut: int, short: int) -> None:
    first, second = unchunked(range(40)), unchunked(range(40, COUNT))
    got, losses = accounted(first[: len(first) - cut] + second[: len(second) - short])
    assert got == ALL
    assert any(loss.messages is None for loss in losses)


@pytest.mark.parametrize("cut", [0, 30, 90])
@pytest.mark.parametrize("behind", [unchunked(range(40, COUNT), key=7), bytes(5000)])
def test_what_stands_behind_a_log_and_is_not_read_is_reported(cut: int, behind: bytes) -> None:
    first = unchunked(range(40))
    first = first[: len(first) - cut] if behind[0] else first
    for verify in (False, True):
        got, losses = read(first + behind, verify=verify)
        assert got[:40] == ALL[:40]
        assert any(loss.messages is None for loss in losses)


def test_a_copied_stretch_that_ends_the_data_hides_no_message() -> None:
    content = unchunked(range(COUNT))
    end = content.index(DATA_END)
    stretch = content[end - 300 : end + 60]
    for place in range(len(HEAD), end, 97):
        got, losses = read(content[:place] + stretch + content[place:])
        assert set(ALL) <= set(got) or any(loss.messages is None for loss in losses)


def test_an_intact_log_outside_chunks_has_no_loss() -> None:
    assert read(unchunked(range(COUNT))) == (ALL, ())
