"""ROS1 bags whose records contradict each other: every message is returned or reported lost, and none twice."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import lz4.frame
import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log, rosbag1_chunks, rosbag1_recovery
from ferryid.ingest.rosbag1_chunks import Allowance, decompressed
from ferryid.ingest.rosbag1_messages import Messages
from ferryid.ingest.rosbag1_records import (
    CHUNK,
    CHUNK_INFO,
    CONNECTION,
    INDEX,
    MESSAGE,
    Chunk,
    RecordError,
    Records,
    connection_of,
)
from tests.ingest.test_rosbag1 import COMPRESSIONS, COUNT, START, WANTED, assert_rows_are_right, write_bag

ALL = COUNT * 3 // 2


class Raw(NamedTuple):
    """One record, to be changed and written again."""

    fields: dict[bytes, bytes]
    data: bytes

    @property
    def op(self) -> int:
        return self.fields[b"op"][0]

    def packed(self) -> bytes:
        pairs = (name + b"=" + value for name, value in self.fields.items())
        header = b"".join(struct.pack("<I", len(pair)) + pair for pair in pairs)
        return struct.pack("<I", len(header)) + header + struct.pack("<I", len(self.data)) + self.data


def parsed(bag: bytes) -> list[Raw]:
    """List the records of a whole bag."""
    records, position, found = Records(bag), 13, []
    while position < len(bag):
        record = records.at(position)
        found.append(Raw(dict(record.fields), bag[record.start : record.end]))
        position = record.end
    return found


@pytest.fixture(scope="module", params=COMPRESSIONS)
def whole(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """An undamaged bag of each compression."""
    return write_bag(tmp_path_factory.mktemp("whole") / "a.bag", request.param).read_bytes()


def places(records: list[Raw], op: int) -> list[int]:
    return [place for place, record in enumerate(records) if record.op == op]


def read_changed(
    path: Path, whole: bytes, change: Callable[[list[Raw]], Any], *, verify: bool = False
) -> tuple[int, Any]:
    """Change the list of records of a bag and read it: number of rows and the reader."""
    records = parsed(whole)
    change(records)
    path.write_bytes(b"#ROSBAG V2.0\n" + b"".join(record.packed() for record in records))
    reader = open_log(path)
    series = reader.read(WANTED, verify=verify)
    assert_rows_are_right(series)
    times = np.concatenate([one.receive_ns for one in series.values()])
    assert len(np.unique(times)) == len(times)
    return len(times), reader


def change_field(op: int, which: int, name: bytes, value: bytes) -> Callable[[list[Raw]], None]:
    def change(records: list[Raw]) -> None:
        records[places(records, op)[which]].fields[name] = value

    return change


def change_entry(row: int, other: int, columns: slice) -> Callable[[list[Raw]], None]:
    """Overwrite part of one entry of the sixth index record by that of another."""

    def change(records: list[Raw]) -> None:
        place = places(records, INDEX)[5]
        entries = np.frombuffer(records[place].data, "<u4").reshape(-1, 3).copy()
        entries[row, columns] = entries[other, columns]
        records[place] = records[place]._replace(data=entries.tobytes())

    return change


def repeat(op: int, which: int) -> Callable[[list[Raw]], None]:
    def change(records: list[Raw]) -> None:
        place = places(records, op)[which]
        records.insert(place + 1, records[place])

    return change


def drop(op: int, which: int) -> Callable[[list[Raw]], None]:
    def change(records: list[Raw]) -> None:
        del records[places(records, op)[which]]

    return change


def move(op: int, which: int, to: int) -> Callable[[list[Raw]], None]:
    def change(records: list[Raw]) -> None:
        place = places(records, op)
        records.insert(place[to], records.pop(place[which]))

    return change


WHOLE = {
    "count of an index record": change_field(INDEX, 4, b"count", b"\1\0\0\0"),
    "connection of an index record": change_field(INDEX, 4, b"conn", b"\1\0\0\0"),
    "unknown connection of an index record": change_field(INDEX, 4, b"conn", b"\7\0\0\0"),
    "index record twice": repeat(INDEX, 4),
    "index record missing": drop(INDEX, 4),
    "index record elsewhere": move(INDEX, 4, 9),
    "index entry twice": change_entry(3, 4, slice(None)),
    "place of an index entry twice": change_entry(3, 4, slice(2, 3)),
    "count of the chunk information": change_field(CHUNK_INFO, 3, b"count", b"\1\0\0\0"),
    "place in the chunk information": change_field(CHUNK_INFO, 3, b"chunk_pos", b"\1\2\3\4\5\6\7\x88"),
    "chunk information twice": repeat(CHUNK_INFO, 3),
    "chunk information missing": drop(CHUNK_INFO, 3),
    "number of chunks": change_field(3, 0, b"chunk_count", b"\2\0\0\0"),
    "number of connections": change_field(3, 0, b"conn_count", b"\1\0\0\0"),
    "place of the index": change_field(3, 0, b"index_pos", b"\xff" * 8),
    "number of a connection": change_field(CONNECTION, -1, b"conn", b"\0\0\0\0"),
    "chunk twice": repeat(CHUNK, 3),
    "chunk elsewhere": move(CHUNK, 3, 6),
    "size of a chunk too small": change_field(CHUNK, 3, b"size", b"\1\0\0\0"),
    "size of a chunk too large": change_field(CHUNK, 3, b"size", b"\xff" * 4),
}


@pytest.mark.parametrize("damage", WHOLE)
def test_a_damaged_index_costs_no_message_and_is_reported(tmp_path: Path, whole: bytes, damage: str) -> None:
    rows, reader = read_changed(tmp_path / "a.bag", whole, WHOLE[damage], verify=True)
    assert rows == ALL
    assert reader.losses
    assert [loss.messages for loss in reader.losses] == [0] * len(reader.losses)


@pytest.mark.parametrize("damage", ["count of an index record", "connection of an index record", "index record twice"])
def test_a_damaged_index_costs_no_message_without_verify_either(tmp_path: Path, whole: bytes, damage: str) -> None:
    assert read_changed(tmp_path / "a.bag", whole, WHOLE[damage])[0] == ALL


def test_a_chunk_that_is_gone_is_counted_by_its_chunk_information(tmp_path: Path, whole: bytes) -> None:
    rows, reader = read_changed(tmp_path / "a.bag", whole, drop(CHUNK, 3))
    assert rows < ALL
    assert rows + sum(loss.messages for loss in reader.losses) == ALL


@pytest.mark.parametrize("length", [0, 50, 9000, 0xFFFFFFFF])
def test_a_chunk_of_wrong_length_costs_no_message(tmp_path: Path, whole: bytes, length: int) -> None:
    path, bag, records = tmp_path / "a.bag", bytearray(whole), parsed(whole)
    place = 13 + sum(len(record.packed()) for record in records[: places(records, CHUNK)[3]])
    at = place + 4 + struct.unpack_from("<I", bag, place)[0]
    bag[at : at + 4] = struct.pack("<I", length)
    path.write_bytes(bag)
    reader = open_log(path)
    series = reader.read(WANTED)
    assert_rows_are_right(series)
    assert sum(len(one.receive_ns) for one in series.values()) == ALL
    assert reader.losses


def test_verify_counts_lost_messages_of_topics_that_nobody_wants(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none")
    bag = bytearray(path.read_bytes())
    place = bag.index(struct.pack("<d", 300.0)) - 30
    bag[place : place + 8] = b"\xff" * 8
    path.write_bytes(bag)
    reader = open_log(path)
    reader.read({"/force": []})
    assert reader.losses == ()
    reader.read({"/force": []}, verify=True)
    assert [loss.messages for loss in reader.losses] == [1]


@pytest.mark.parametrize("time", [b"\xff" * 8, bytes(8), b"\xff" * 4 + bytes(4)])
def test_nonsense_times_of_the_index_cost_no_message_but_their_own(tmp_path: Path, whole: bytes, time: bytes) -> None:
    def change(records: list[Raw]) -> None:
        place = places(records, INDEX)[5]
        records[place] = records[place]._replace(data=time + records[place].data[8:])

    rows, reader = read_changed(tmp_path / "a.bag", whole, change)
    assert rows + sum(loss.messages for loss in reader.losses) == ALL
    assert reader.losses


def test_a_connection_without_a_part_of_its_definition_is_refused_in_one_line(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.bag", "none", count=3)
    path.write_bytes(path.read_bytes().replace(b"MSG: std_msgs/Header", b"MSG: std_msgs/HeadeR"))
    reader = open_log(path)
    with pytest.raises(FerryIdError, match="Fix: "):
        reader.read({"/force": []})


def stored_chunk(compression: str, content: bytes, size: int) -> tuple[bytes, Chunk]:
    data = {"lz4": lz4.frame.compress, "bz2": bz2.compress}[compression](content)
    return data, Chunk(0, 0, len(data), compression, size)


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("compression", ["lz4", "bz2"])
def test_a_chunk_expands_to_its_allowance_at_most(
    monkeypatch: pytest.MonkeyPatch, compression: str, exact: bool
) -> None:
    monkeypatch.setattr(rosbag1_chunks, "FREE_CHUNK", 1000)
    monkeypatch.setattr(rosbag1_chunks, "MAX_CHUNK", 100_000)
    for size in (0, 10**6, 2**32 - 1):
        data, chunk = stored_chunk(compression, bytes(10**6), size)
        content = decompressed(data, chunk, Allowance(10**9, 10**6, 100_000), exact=exact)
        assert len(content.buffer) <= min(100_000, 1000 + 255 * len(data))
        assert not content.whole
        assert "more than" in content.fault


def test_all_chunks_together_expand_to_the_allowance_of_the_file() -> None:
    allowance = Allowance(25_000, 10**6)
    data, chunk = stored_chunk("bz2", bytes(10_000), 10_000)
    sizes = [len(decompressed(data, chunk, allowance, exact=True).buffer) for _ in range(4)]
    assert sizes == [10_000, 10_000, 5000, 0]


@pytest.mark.parametrize("compression", ["lz4", "bz2"])
@pytest.mark.parametrize("size", [0, 10, 4_000_000_000])
def test_a_wrong_stated_size_costs_nothing_of_the_content(compression: str, size: int) -> None:
    data, chunk = stored_chunk(compression, bytes(range(256)) * 40, size)
    content = decompressed(data, chunk, Allowance.of_file(len(data)), exact=True)
    assert bytes(content.buffer) == bytes(range(256)) * 40
    assert content.whole
    assert "size" in content.fault


def test_a_message_that_reaches_past_the_end_of_a_short_chunk_is_not_found() -> None:
    messages = Messages()
    fields = {b"op": b"\2", b"conn": bytes(4), b"time": struct.pack("<II", START // 10**9, 0)}
    whole = Raw(fields, b"x" * 8).packed()
    entry = np.array([[START // 10**9, 0, 0]], np.uint32)
    assert messages.locate(whole, entry, np.zeros(1, np.int64))[2] is None
    assert messages.locate(whole[:20], entry, np.zeros(1, np.int64))[2] is not None


def test_a_connection_record_of_absurd_length_is_no_connection() -> None:
    data = Raw({b"op": b"\7", b"conn": bytes(4), b"topic": b"/a"}, bytes(5 << 20)).packed()
    with pytest.raises(RecordError, match="bytes"):
        connection_of(data, Records(data).at(0))


def test_more_connections_than_any_recorder_writes_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_bag(tmp_path / "a.bag", "none", count=3)
    path.write_bytes(path.read_bytes()[:-1])
    monkeypatch.setattr(rosbag1_recovery, "MAX_CONNECTIONS", 1)
    with pytest.raises(FerryIdError, match="more than 1 connections"):
        open_log(path)


def test_a_walk_ends_at_more_records_than_a_recorder_writes(
    tmp_path: Path, whole: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unclosed(records: list[Raw]) -> None:
        del records[places(records, CHUNK_INFO)[0] :]
        records[:] = [record for record in records if record.op != INDEX]

    walked = 40
    monkeypatch.setattr(rosbag1_chunks.Allowance, "of_file", classmethod(lambda cls, size: cls(1 << 30, walked)))
    count, reader = read_changed(tmp_path / "a.bag", whole, unclosed)
    assert count < walked
    assert any(rosbag1_recovery.EXCESS in loss.what and loss.messages is None for loss in reader.losses)


def test_a_first_chunk_whose_record_is_damaged_is_reported_without_chunk_information_too(
    tmp_path: Path, whole: bytes
) -> None:
    def change(records: list[Raw]) -> None:
        records[places(records, CHUNK)[0]].fields[b"op"] = b"\x55"
        del records[places(records, CHUNK_INFO)[0]]

    rows, reader = read_changed(tmp_path / "a.bag", whole, change)
    assert rows < ALL
    assert None in [loss.messages for loss in reader.losses]


def rewritten_chunk(change: Callable[[bytes], bytes]) -> Callable[[list[Raw]], None]:
    """Change the stored bytes of the second chunk, whatever its compression."""

    def edit(records: list[Raw]) -> None:
        place = places(records, CHUNK)[1]
        records[place] = records[place]._replace(data=change(records[place].data))

    return edit


@pytest.mark.parametrize("verify", [False, True])
def test_a_message_cut_out_of_a_chunk_that_index_and_chunk_information_count_is_lost(
    tmp_path: Path, verify: bool
) -> None:
    def cut(records: list[Raw]) -> None:
        place = places(records, CHUNK)[1]
        inside = Records(content := lz4.frame.decompress(records[place].data))
        messages, position = [], 0
        while position < len(content):
            record = inside.at(position)
            messages.append(content[position : record.end])
            position = record.end
        data = b"".join([*messages[:-2], messages[-1]])
        records[place].fields[b"size"] = struct.pack("<I", len(data))
        records[place] = records[place]._replace(data=lz4.frame.compress(data, content_checksum=True))

    whole = write_bag(tmp_path / "whole.bag", "lz4").read_bytes()
    count, reader = read_changed(tmp_path / "b.bag", whole, cut, verify=verify)
    assert count + sum(loss.messages or 0 for loss in reader.losses) == ALL


@pytest.mark.parametrize("verify", [False, True])
@pytest.mark.parametrize("fault", ["contentChecksum", "frameSize_wrong"])
def test_nothing_is_believed_of_a_chunk_that_decompresses_to_what_its_frame_contradicts(
    tmp_path: Path, fault: str, verify: bool
) -> None:
    def damage(stored: bytes) -> bytes:
        # A literal, or the length of a match; where one stands hangs on the compressor, so that it is searched.
        for place in range(len(stored) - 9, 15, -1):
            for bit in range(8):
                damaged = stored[:place] + bytes([stored[place] ^ 1 << bit]) + stored[place + 1 :]
                try:
                    lz4.frame.decompress(damaged)
                except RuntimeError as error:
                    if fault in str(error):
                        return damaged
        pytest.fail("no byte of the chunk can be damaged alone")

    def recompress(stored: bytes) -> bytes:
        return damage(lz4.frame.compress(lz4.frame.decompress(stored), content_checksum=True))

    whole = write_bag(tmp_path / "whole.bag", "lz4").read_bytes()
    (held,) = read_changed(tmp_path / "a.bag", whole, drop(CHUNK, 1))[:1]
    count, reader = read_changed(tmp_path / "b.bag", whole, rewritten_chunk(recompress), verify=verify)
    assert count == held < ALL
    assert count + sum(loss.messages or 0 for loss in reader.losses) == ALL
    assert any("its checksum" in loss.what or fault in loss.what for loss in reader.losses)


def test_a_damaged_time_is_no_repair_where_the_index_means_the_connection_record_before_the_message(
    tmp_path: Path,
) -> None:
    def change(records: list[Raw]) -> None:
        chunk = places(records, CHUNK)[0]
        content = bytearray(records[chunk].data)
        inside = Records(bytes(content))
        message = inside.at(0)
        while message.op == CONNECTION:
            message = inside.at(message.end)
        index = next(
            place for place in places(records, INDEX) if records[place].fields[b"conn"] == message.fields[b"conn"]
        )
        entries = np.frombuffer(records[index].data, "<u4").reshape(-1, 3).copy()
        assert entries[0, 2] == message.position > 0
        entries[0, 2] = 0
        records[index] = records[index]._replace(data=entries.tobytes())
        time = content.index(b"time=", message.position) + 5
        content[time + 4] ^= 4
        records[chunk] = records[chunk]._replace(data=bytes(content))

    whole = write_bag(tmp_path / "whole.bag", "none").read_bytes()
    count, reader = read_changed(tmp_path / "b.bag", whole, change)
    assert count == ALL - 1
    assert [loss.messages for loss in reader.losses if loss.messages] == [1]


def never_closed(whole: bytes, change: Callable[[list[Raw]], Any] = lambda records: None) -> bytes:
    """Return what a recorder leaves that lost its power, changed: chunks and index records, and nothing that counts them."""
    records = parsed(whole)
    del records[places(records, CHUNK)[-1] + 3 :]
    records[0].fields[b"index_pos"] = bytes(8)
    change(records)
    return b"#ROSBAG V2.0\n" + b"".join(record.packed() for record in records)


def rows_and_reader(path: Path, content: bytes, *, verify: bool = False) -> tuple[int, Any]:
    path.write_bytes(content)
    reader = open_log(path)
    series = reader.read(WANTED, verify=verify)
    assert_rows_are_right(series)
    return sum(len(one.receive_ns) for one in series.values()), reader


@pytest.mark.parametrize("left", [-1, -2, -3, -4])
def test_a_bag_that_was_not_closed_may_lack_messages_at_its_end(tmp_path: Path, whole: bytes, left: int) -> None:
    def cut(records: list[Raw]) -> None:
        del records[left + 1 or len(records) :]

    rows, reader = rows_and_reader(tmp_path / "a.bag", never_closed(whole, cut))
    assert (rows < ALL) == (left == -4)
    (end,) = [loss for loss in reader.losses if "without an index" in loss.what]
    assert end.messages is None
    assert START < end.start_ns < START + COUNT * 10**9 // 100


def test_an_index_that_is_there_shows_that_the_bag_ends_where_it_should(tmp_path: Path, whole: bytes) -> None:
    rows, reader = read_changed(tmp_path / "a.bag", whole, change_field(3, 0, b"index_pos", bytes(8)))
    assert (rows, {loss.messages for loss in reader.losses}) == (ALL, {0})


@pytest.mark.parametrize("verify", [False, True])
@pytest.mark.parametrize("behind", ["the index records", "the chunk"])
def test_a_stretch_that_is_gone_behind_a_chunk_may_have_held_others(
    tmp_path: Path, whole: bytes, behind: str, verify: bool
) -> None:
    content = never_closed(whole)
    records = parsed(content)
    chunks = places(records, CHUNK)
    starts = 13 + np.cumsum([0, *(len(record.packed()) for record in records)])
    # From the first bytes of the index records of a chunk into, or to the end of, the next chunk's.
    first, end = starts[chunks[2] + 1] + 30, starts[chunks[3] + 1] + (50 if behind == "the index records" else 0)
    if behind == "the index records":
        content = content[:first] + content[end:]
    else:
        content = content[: first - 30] + bytes(end - first + 30) + content[starts[chunks[4]] :]
    rows, reader = rows_and_reader(tmp_path / "a.bag", content, verify=verify)
    assert rows < ALL
    assert any(loss.messages is None for loss in reader.losses if "without an index" not in loss.what), reader.losses


def test_messages_swallowed_by_one_with_a_damaged_length_are_reported(tmp_path: Path) -> None:
    content = never_closed(write_bag(tmp_path / "whole.bag", "none").read_bytes())
    chunk = [one for one in _records(content, 13, len(content)) if one.op == CHUNK][1]
    inside = [one for one in _records(content, chunk.start, chunk.end) if one.op == MESSAGE]
    # Bytes that came in stand where the length of a message was: it ends where the third behind it does.
    came_in = struct.pack("<I", inside[5].end - inside[2].start + 4)
    damaged = content[: inside[2].start - 4] + came_in + content[inside[2].start - 4 :]
    (tmp_path / "a.bag").write_bytes(damaged)
    reader = open_log(tmp_path / "a.bag")
    series = reader.read(WANTED)
    assert sum(len(one.receive_ns) for one in series.values()) < ALL
    assert any("index records count more messages" in loss.what for loss in reader.losses), reader.losses


def _records(content: bytes, first: int, end: int) -> list[Any]:
    records, found = Records(content), []
    while first < end:
        found.append(records.at(first))
        first = found[-1].end
    return found
