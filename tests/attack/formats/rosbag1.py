"""ROS 1 bags: none, lz4 and bz2 compression, closed and never closed."""

from __future__ import annotations

import bz2
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any

import lz4.frame
from rosbags.rosbag1 import Writer

from tests.attack import definitions
from tests.attack.case import EXACT_IF_VERIFIED, UNCHECKED, Base, Mutated, Mutation, odd_number, replaced
from tests.attack.logs import STORES, TYPES, WANTED, in_folder, messages, serialized, truth_of

NAME = "log.bag"
MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
OPCODES = {2: "message", 3: "bag header", 4: "index data", 5: "chunk", 6: "chunk info", 7: "connection"}


@dataclass(frozen=True)
class Record:
    """One record: its header's fields in order, and its data."""

    fields: tuple[tuple[bytes, bytes], ...]
    data: bytes

    @property
    def op(self) -> int:
        """Opcode."""
        return dict(self.fields)[b"op"][0]

    def bytes(self) -> bytes:
        """Return the record as the file holds it."""
        header = b"".join(
            struct.pack("<L", len(key) + 1 + len(value)) + key + b"=" + value for key, value in self.fields
        )
        return struct.pack("<L", len(header)) + header + struct.pack("<L", len(self.data)) + self.data

    def with_field(self, key: bytes, value: bytes) -> Record:
        """Return the record with one field replaced."""
        return replace(self, fields=tuple((k, value if k == key else v) for k, v in self.fields))


def parsed(content: bytes) -> list[Record]:
    """Return the records of a stretch of a bag."""
    found, at = [], 0
    while at < len(content):
        (size,) = struct.unpack_from("<L", content, at)
        end, at = at + 4 + size, at + 4
        fields = []
        while at < end:
            (length,) = struct.unpack_from("<L", content, at)
            key, value = content[at + 4 : at + 4 + length].split(b"=", 1)
            fields.append((key, value))
            at += 4 + length
        (length,) = struct.unpack_from("<L", content, end)
        found.append(Record(tuple(fields), content[end + 4 : end + 4 + length]))
        at = end + 4 + length
    return found


def joined(records: list[Record], *, fitted: bool = False) -> bytes:
    """Return the file; fitted: with the offsets of chunks and index where they are now."""
    if fitted:
        at, places, index = len(MAGIC), [], None
        for record in records:
            if record.op == CHUNK:
                places.append(at)
            if record.op == CONNECTION and index is None:
                index = at
            at += len(record.bytes())
        queue = iter(places)
        made = []
        for record in records:
            if record.op == HEADER and index is not None:
                record = record.with_field(b"index_pos", struct.pack("<Q", index))
            if record.op == CHUNK_INFO and (place := next(queue, None)) is not None:
                record = record.with_field(b"chunk_pos", struct.pack("<Q", place))
            made.append(record)
        records = made
    return MAGIC + b"".join(record.bytes() for record in records)


def bases() -> list[Base]:
    """Three compressions, each closed and not."""
    return [_base(codec, closed) for codec in ("none", "lz4", "bz2") for closed in (True, False)]


def _base(codec: str, closed: bool) -> Base:
    files, path, folder = in_folder(lambda place: written(place, codec))
    truth = truth_of(folder / path, "ros1")
    if not closed:
        # What a recorder leaves that lost its power: chunks and their index records, and nothing that points to them.
        first = parsed(files[NAME][len(MAGIC) :])[0]
        (end,) = struct.unpack("<Q", dict(first.fields)[b"index_pos"])
        zeroed = replace(first, fields=tuple((k, v if k == b"op" else bytes(len(v))) for k, v in first.fields))
        files = {NAME: MAGIC + zeroed.bytes() + files[NAME][len(MAGIC) + len(first.bytes()) : end]}
    guard = UNCHECKED if codec == "none" else EXACT_IF_VERIFIED
    name = f"{codec}, {'closed' if closed else 'not closed'}"
    return Base("rosbag1", name, files, path, truth, WANTED, guard, _payload(files[NAME]))


def written(folder: Path, codec: str) -> Path:
    """Write the bag by rosbags, lz4 with the checksum that ROS adds."""
    writer = Writer(folder / NAME)
    if codec != "none":
        writer.set_compression(Writer.CompressionFormat[codec.upper()])
    writer.chunk_threshold = 3000
    writer.open()
    if codec == "lz4":
        writer.compressor = lambda data: bytes(lz4.frame.compress(data, content_checksum=True))
    store = STORES["ros1"]
    connections = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in TYPES.items()}
    for topic, time, value in messages():
        writer.write(connections[topic], time, serialized(topic, time, value, "ros1"))
    writer.close()
    return folder / NAME


def _payload(content: bytes) -> dict[str, tuple[tuple[int, int], ...]]:
    """Stretches of the data of chunks."""
    spans, at = [], len(MAGIC)
    for record in parsed(content[at:]):
        at += len(record.bytes())
        if record.op == CHUNK:
            spans.append((at - len(record.data), at))
    return {NAME: tuple(spans)}


def _records(base: Base) -> list[Record]:
    return parsed(base.files[NAME][len(MAGIC) :])


def _made(base: Base, data: bytes, what: str, **expected: Any) -> Mutated:
    return Mutated(what, replaced(base, NAME, data), **expected)


def field_of_record(random: Random, base: Base) -> Mutated | None:
    """Set one field of one record's header."""
    records = _records(base)
    op = random.choice(sorted({record.op for record in records}))
    place = random.choice([index for index, record in enumerate(records) if record.op == op])
    record = records[place]
    key, value = random.choice(record.fields)
    changed = _odd_value(random, key, value)
    if changed == value:
        return None
    records[place] = record.with_field(key, changed)
    what = f"{OPCODES[op]} (record {place}): {key.decode()} set from {value.hex()} to {changed.hex()}"
    return _made(base, joined(records), what, content=key in (b"topic", b"time"))


def _odd_value(random: Random, key: bytes, value: bytes) -> bytes:
    if len(value) in (1, 4, 8) and key not in (b"compression", b"topic"):
        number = odd_number(random, len(value), int.from_bytes(value, "little"))
        return number.to_bytes(len(value), "little")
    return random.choice((b"", random.randbytes(len(value)), value[:-1], value + value, b"\0" + value[1:]))


def index_entry(random: Random, base: Base) -> Mutated | None:
    """Set a time or an offset in an index record, or the chunk that a count of a chunk info belongs to."""
    records = _records(base)
    places = [i for i, record in enumerate(records) if record.op in (INDEX, CHUNK_INFO) and record.data]
    place = random.choice(places)
    data = bytearray(records[place].data)
    at = 4 * random.randrange(len(data) // 4)
    old = int.from_bytes(data[at : at + 4], "little")
    neighbour = int.from_bytes(data[at - 12 : at - 8], "little") if at >= 12 and random.random() < 0.4 else None
    new = neighbour if neighbour is not None else odd_number(random, 4, old)
    if new == old:
        return None
    data[at : at + 4] = new.to_bytes(4, "little")
    records[place] = replace(records[place], data=bytes(data))
    what = f"{OPCODES[records[place].op]} (record {place}): word at {at} of its data set from {old} to {new}"
    return _made(base, joined(records), what, content=records[place].op == INDEX)


def record_moved(random: Random, base: Base) -> Mutated | None:
    """Duplicate, drop or swap records."""
    records = _records(base)
    closed = "not closed" not in base.name
    op = random.choice(sorted({record.op for record in records} - {HEADER}))
    places = [index for index, record in enumerate(records) if record.op == op]
    place, other = random.choice(places), random.choice(places)
    action = random.choice(("duplicated", "dropped", "swapped"))
    fitted = random.random() < 0.5 and closed
    missing = extra = 0
    what = f"{OPCODES[op]} (record {place}) {action}"
    if action == "duplicated":
        records.insert(random.choice((place, len(records))), records[place])
        extra = base.count if op == CHUNK and not closed else 0
    elif action == "dropped":
        del records[place]
        # Of a bag that was never closed, nothing but the index records after a chunk tells that there was one.
        missing = base.count if op == CHUNK and not closed else 0
    else:
        if place == other:
            return None
        records[place], records[other] = records[other], records[place]
        what += f" with record {other}"
    return _made(base, joined(records, fitted=fitted), what + ", offsets fitted" * fitted, missing=missing, extra=extra)


def length_of_record(random: Random, base: Base) -> Mutated | None:
    """Let the length of a record's header, of its data or of a field lie."""
    records = _records(base)
    place = random.randrange(len(records))
    start = len(MAGIC) + sum(len(record.bytes()) for record in records[:place])
    record = records[place]
    header = len(record.bytes()) - 8 - len(record.data)
    at, which = random.choice(((start, "header"), (start + 4 + header, "data"), (start + 4, "first field")))
    content = bytearray(base.files[NAME])
    old = int.from_bytes(content[at : at + 4], "little")
    new = odd_number(random, 4, old)
    if new == old:
        return None
    content[at : at + 4] = new.to_bytes(4, "little")
    what = f"{OPCODES[record.op]} (record {place}): length of its {which} set from {old} to {new}"
    return _made(base, bytes(content), what)


def inside_chunk(random: Random, base: Base) -> Mutated | None:
    """Edit the records in a chunk, compressed anew: no checksum tells."""
    records = _records(base)
    place = random.choice([index for index, record in enumerate(records) if record.op == CHUNK])
    chunk = records[place]
    codec = dict(chunk.fields)[b"compression"].decode()
    inner = parsed(_unpacked(codec, chunk.data))
    number = random.randrange(len(inner))
    record = inner[number]
    action = random.choice(("duplicated", "dropped", "swapped", "field set", "data cut"))
    extra = missing = 0
    if action == "duplicated":
        inner.insert(number, record)
        extra = int(record.op == MESSAGE)
    elif action == "dropped":
        del inner[number]
    elif action == "swapped":
        other = random.randrange(len(inner))
        inner[number], inner[other] = inner[other], record
    elif action == "field set":
        key, value = random.choice(record.fields)
        changed = _odd_value(random, key, value)
        inner[number] = record.with_field(key, changed)
        action = f"{key.decode()} set from {value.hex()} to {changed.hex()}"
    else:
        inner[number] = replace(record, data=record.data[: random.randrange(len(record.data) + 1)])
    plain = b"".join(each.bytes() for each in inner)
    data = _packed(codec, plain)
    size = struct.pack("<L", len(plain))
    records[place] = replace(chunk, data=data).with_field(b"size", size)
    fitted = "not closed" not in base.name
    what = f"chunk (record {place}): {OPCODES[record.op]} (record {number} of it) {action}"
    return _made(base, joined(records, fitted=fitted), what, content=True, extra=extra, missing=missing)


def _unpacked(codec: str, data: bytes) -> bytes:
    return {"none": bytes, "lz4": lz4.frame.decompress, "bz2": bz2.decompress}[codec](data)


def _packed(codec: str, data: bytes) -> bytes:
    if codec == "lz4":
        return bytes(lz4.frame.compress(data, content_checksum=True))
    return {"none": bytes, "bz2": bz2.compress}[codec](data)


def bomb(random: Random, base: Base) -> Mutated | None:
    """Let a small chunk unpack to far more than it states, or state far more than it unpacks to."""
    records = _records(base)
    place = random.choice([index for index, record in enumerate(records) if record.op == CHUNK])
    codec = dict(records[place].fields)[b"compression"].decode()
    if codec == "none":
        return None
    truthful = random.random() < 0.5
    data, size = definitions.zeros(codec)
    records[place] = replace(records[place], data=data)
    if truthful:
        records[place] = records[place].with_field(b"size", struct.pack("<L", size))
    what = f"chunk (record {place}) unpacks to {size} zeros, {'as' if truthful else 'more than'} it states"
    return _made(base, joined(records, fitted="not closed" not in base.name), what, bomb=True)


def definition(random: Random, base: Base) -> Mutated | None:
    """Put a hostile definition into the connection records of one topic."""
    records = _records(base)
    topic = random.choice(list(TYPES)).encode()
    kind = TYPES[topic.decode()].replace("/msg/", "/")
    texts = [
        dict(_header(record.data))[b"message_definition"]
        for record in records
        if record.op == CONNECTION and dict(record.fields)[b"topic"] == topic
    ]
    if not texts:
        return None
    what, changed, new_kind = definitions.hostile(random, "ros1msg", kind, texts[0])

    def edited(record: Record) -> Record:
        if record.op != CONNECTION or dict(record.fields)[b"topic"] != topic:
            return record
        fields = {**dict(_header(record.data)), b"message_definition": changed, b"type": new_kind.encode()}
        return replace(record, data=_header_bytes(fields))

    made = []
    for record in records:
        if record.op == CHUNK:
            codec = dict(record.fields)[b"compression"].decode()
            plain = b"".join(edited(each).bytes() for each in parsed(_unpacked(codec, record.data)))
            record = replace(record, data=_packed(codec, plain)).with_field(b"size", struct.pack("<L", len(plain)))
        made.append(edited(record))
    return _made(base, joined(made, fitted=True), f"definition of {topic.decode()}: {what}", content=True)


def _header(data: bytes) -> list[tuple[bytes, bytes]]:
    return list(parsed(struct.pack("<L", len(data)) + data + b"\0\0\0\0")[0].fields)


def _header_bytes(fields: dict[bytes, bytes]) -> bytes:
    return Record(tuple(fields.items()), b"").bytes()[4:-4]


MUTATIONS: dict[str, Mutation] = {
    "field of a record": field_of_record,
    "entry of an index": index_entry,
    "record moved": record_moved,
    "length of a record": length_of_record,
    "inside a chunk": inside_chunk,
    "bomb": bomb,
    "definition": definition,
}
