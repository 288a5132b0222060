"""MCAP files: every compression, with and without chunks, summary and checksums, and every encoding."""

from __future__ import annotations

import struct
import zlib
from random import Random
from typing import Any

from mcap.writer import CompressionType

from tests.attack import definitions
from tests.attack.case import EXACT, UNCHECKED, Base, Mutated, Mutation, odd_number, replaced
from tests.attack.logs import TYPES, WANTED
from tests.attack.mcap_records import (
    CHUNK,
    DATA_END,
    ENCODINGS,
    FIELDS,
    MESSAGE,
    MESSAGE_INDEX,
    NAME,
    OPCODES,
    SCHEMA,
    Layout,
    Record,
    chunk_of,
    chunk_record,
    joined,
    parsed,
    places_of,
    record,
    schema_of,
    truth_of,
    walk,
    with_checksums,
    written,
)


def bases() -> list[Base]:
    """Layouts that differ in what can be checked, and every encoding."""
    lz4_, zstd, none = CompressionType.LZ4, CompressionType.ZSTD, CompressionType.NONE
    layouts = [Layout(encoding) for encoding in ENCODINGS]
    layouts += [Layout(compression=codec, summary=closed) for codec in (lz4_, zstd) for closed in (True, False)]
    layouts += [Layout(compression=none, summary=False), Layout(compression=zstd, index=False)]
    layouts += [Layout(compression=codec, crcs=False) for codec in (none, zstd)]
    layouts += [Layout(chunks=False, summary=closed, crcs=crcs) for closed, crcs in ((True, True), (False, False))]
    layouts += [
        Layout("ros1msg", lz4_, summary=False, crcs=False),
        Layout("protobuf", zstd),
        Layout("jsonschema", lz4_),
    ]
    return [_base(layout) for layout in layouts]


def _base(layout: Layout) -> Base:
    content = written(layout)
    truth = truth_of(content, layout.encoding)
    if not layout.summary:
        content = content[: places_of(content)[[op for op, _, _ in parsed(content)].index(DATA_END)]]
    guard = EXACT if layout.crcs and layout.chunks else UNCHECKED
    return Base("mcap", layout.name, {NAME: content}, NAME, truth, WANTED, guard)


def _made(base: Base, data: bytes, what: str, **expected: Any) -> Mutated | None:
    if data == base.files[NAME]:
        return None
    return Mutated(what, replaced(base, NAME, data), **expected)


def _closed(base: Base) -> bool:
    return "not closed" not in base.name


def field_of_record(random: Random, base: Base) -> Mutated | None:
    """Set one field of one record, with stale or with right checksums."""
    content = base.files[NAME]
    records = parsed(content)
    op = random.choice(sorted({op for op, _, _ in records}))
    place = random.choice([index for index, one in enumerate(records) if one[0] == op])
    fields = [one for one in FIELDS[op] if one[1] + one[2] <= len(records[place][1])]
    name, at, size = random.choice(fields)
    changed = bytearray(records[place][1])
    old = int.from_bytes(changed[at : at + size], "little")
    others = [one[1] for one in records if one[0] == op and len(one[1]) >= at + size]
    neighbour = int.from_bytes(random.choice(others)[at : at + size], "little")
    new = neighbour if random.random() < 0.3 else odd_number(random, size, old)
    if new == old:
        return None
    changed[at : at + size] = new.to_bytes(size, "little")
    records[place] = record(op, bytes(changed))
    what = f"{OPCODES[op]} (record {place}): {name} set from {old} to {new}"
    made = joined(records, _closed(base))
    refitted = random.random() < 0.5
    if refitted:
        made, what = with_checksums(records, _closed(base)), what + ", checksums fitted"
    # Outside chunks a message's own fields are content, unless a checksum stands against them.
    return _made(base, made, what, content=op == MESSAGE)


def length_of_record(random: Random, base: Base) -> Mutated | None:
    """Let a record's length or its opcode lie."""
    content = bytearray(base.files[NAME])
    records, places = parsed(bytes(content)), places_of(bytes(content))
    op = random.choice(sorted({op for op, _, _ in records}))
    place = random.choice([index for index, one in enumerate(records) if one[0] == op])
    at, size = (places[place], 1) if random.random() < 0.3 else (places[place] + 1, 8)
    old = int.from_bytes(content[at : at + size], "little")
    new = odd_number(random, size, old)
    if new == old:
        return None
    content[at : at + size] = new.to_bytes(size, "little")
    what = f"{OPCODES[op]} (record {place}): {'opcode' if size == 1 else 'length'} set from {old} to {new}"
    # Opcodes from 128 on are private and passed over by rights; where nothing counts, they leave no trace.
    private = size == 1 and new >= 128 and op in (MESSAGE, CHUNK) and not _closed(base)
    return _made(base, bytes(content), what, missing=base.count if private else 0)


def record_moved(random: Random, base: Base) -> Mutated | None:
    """Duplicate, drop or swap records, with stale or right offsets."""
    records = parsed(base.files[NAME])
    closed = _closed(base)
    op = random.choice(sorted({op for op, _, _ in records}))
    places = [index for index, one in enumerate(records) if one[0] == op]
    place, other = random.choice(places), random.choice(places)
    action = random.choice(("duplicated", "dropped", "swapped"))
    extra = missing = 0
    what = f"{OPCODES[op]} (record {place}) {action}"
    if action == "duplicated":
        records.insert(place, records[place])
        extra = base.count if op in (CHUNK, MESSAGE) else 0
    elif action == "dropped":
        del records[place]
        missing = base.count if op in (CHUNK, MESSAGE) and not closed else 0
    else:
        records[place], records[other] = records[other], records[place]
        what += f" with record {other}"
    fitted = closed and random.random() < 0.5
    made = joined(records, closed, fitted=fitted)
    return _made(base, made, what + ", offsets and checksums fitted" * fitted, extra=extra, missing=missing)


def inside_chunk(random: Random, base: Base) -> Mutated | None:
    """Edit the records in a chunk and pack it anew, its checksum right or absent."""
    records = parsed(base.files[NAME])
    places = [index for index, one in enumerate(records) if one[0] == CHUNK]
    if not places:
        return None
    place = random.choice(places)
    codec, data, head = chunk_of(records[place][1])
    inner = list(walk(data, 0, len(data)))
    number = random.randrange(len(inner))
    op, content, _ = inner[number]
    action = random.choice(("duplicated", "dropped", "swapped", "field set", "length set"))
    extra = 0
    what = f"chunk (record {place}): {OPCODES[op]} (record {number} of it) {action}"
    if action == "duplicated":
        inner.insert(number, inner[number])
        extra = int(op == MESSAGE)
    elif action == "dropped":
        del inner[number]
    elif action == "swapped":
        other = random.randrange(len(inner))
        inner[number], inner[other] = inner[other], inner[number]
    elif action == "field set":
        name, at, size = random.choice(FIELDS[op])
        changed = bytearray(content)
        new = odd_number(random, size, int.from_bytes(changed[at : at + size], "little"))
        changed[at : at + size] = new.to_bytes(size, "little")
        inner[number] = record(op, bytes(changed))
        what += f": {name} = {new}"
    else:
        new = odd_number(random, 8, len(content))
        inner[number] = op, content, struct.pack("<BQ", op, new) + content
        what += f": {new}"
    plain = b"".join(whole for _, _, whole in inner)
    crc = zlib.crc32(plain) if any(head[24:28]) and random.random() < 0.7 else 0
    records[place] = chunk_record(codec, plain, head, crc)
    made = joined(records, _closed(base), fitted=True)
    return _made(base, made, what + (", checksum fitted" if crc else ", no checksum"), content=True, extra=extra)


def chunk_size(random: Random, base: Base) -> Mutated | None:
    """Let a chunk's size of records lie, or name another compression."""
    records = parsed(base.files[NAME])
    places = [index for index, one in enumerate(records) if one[0] == CHUNK]
    if not places:
        return None
    place = random.choice(places)
    content = bytearray(records[place][1])
    (length,) = struct.unpack_from("<L", content, 28)
    if random.random() < 0.4:
        name = random.choice((b"", b"lz4", b"zstd", b"bz2", b"\xff\xfe", b"z" * 3000))
        if name == bytes(content[32 : 32 + length]):
            return None
        changed = bytes(content[:28]) + struct.pack("<L", len(name)) + name + bytes(content[32 + length :])
        what = f"chunk (record {place}): compression {name[:9]!r}"
    else:
        old = int.from_bytes(content[32 + length : 40 + length], "little")
        new = odd_number(random, 8, old)
        content[32 + length : 40 + length] = new.to_bytes(8, "little")
        changed, what = bytes(content), f"chunk (record {place}): size of its records set from {old} to {new}"
    records[place] = record(CHUNK, changed)
    return _made(base, joined(records, _closed(base), fitted=_closed(base)), what)


def bomb(random: Random, base: Base) -> Mutated | None:
    """Put a chunk in that unpacks to gigabytes, as it states or not."""
    records = parsed(base.files[NAME])
    places = [index for index, one in enumerate(records) if one[0] == CHUNK]
    if not places:
        return None
    place = random.choice(places)
    _, plain, head = chunk_of(records[place][1])
    codec = random.choice(("zstd", "lz4"))
    packed, size = definitions.zeros(codec)
    truthful = random.random() < 0.5
    made = bytearray(chunk_record(codec, plain, head, 0, packed)[1])
    if truthful:
        made[16:24] = struct.pack("<Q", size)
    records[place] = record(CHUNK, bytes(made))
    what = f"chunk (record {place}) unpacks to {size} zeros, {'as' if truthful else 'more than'} it states"
    return _made(base, joined(records, _closed(base), fitted=True), what, bomb=True)


def definition(random: Random, base: Base) -> Mutated | None:
    """Put a hostile schema in, wherever the file repeats it."""
    records = parsed(base.files[NAME])
    topic = random.choice(list(TYPES))
    language = base.name.split(",")[0]
    name, text, _ = schema_of(topic, language)
    what, changed, kind = definitions.hostile(random, language, name, text)
    content_of = struct.pack("<L", len(kind.encode())) + kind.encode() + struct.pack("<L", len(language))
    content_of += language.encode() + struct.pack("<L", len(changed)) + changed

    def edited(one: Record) -> Record:
        op, content, _ = one
        if op != SCHEMA or content[6 : 6 + len(name)] != name.encode():
            return one
        return record(SCHEMA, content[:2] + content_of)

    made = []
    for one in records:
        if one[0] == CHUNK:
            codec, plain, head = chunk_of(one[1])
            inner = b"".join(edited(each)[2] for each in walk(plain, 0, len(plain)))
            made.append(chunk_record(codec, inner, head, zlib.crc32(inner) if any(head[24:28]) else 0))
        else:
            made.append(edited(one))
    content = joined(_message_indexes(made, records), _closed(base), fitted=True)
    return _made(base, content, f"schema of {topic}: {what}", content=True)


def _message_indexes(made: list[Record], before: list[Record]) -> list[Record]:
    """Shift the offsets of message indexes by as much as the schemas at the beginning of their chunk grew."""
    shift, fitted = 0, []
    for one, old in zip(made, before, strict=True):
        if one[0] == CHUNK:
            shift = len(chunk_of(one[1])[1]) - len(chunk_of(old[1])[1])
        if one[0] == MESSAGE_INDEX and shift:
            entries = bytearray(one[1])
            for at in range(6, len(entries) - 15, 16):
                (offset,) = struct.unpack_from("<Q", entries, at + 8)
                struct.pack_into("<Q", entries, at + 8, max(offset + shift, 0))
            one = record(MESSAGE_INDEX, bytes(entries))
        fitted.append(one)
    return fitted


def index_entry(random: Random, base: Base) -> Mutated | None:
    """Edit the entries of a message index: duplicated, dropped, swapped or pointing elsewhere."""
    records = parsed(base.files[NAME])
    places = [index for index, one in enumerate(records) if one[0] == MESSAGE_INDEX and len(one[1]) > 40]
    if not places:
        return None
    place = random.choice(places)
    content = records[place][1]
    entries = [content[at : at + 16] for at in range(6, len(content), 16)]
    number = random.randrange(len(entries))
    action = random.choice(("duplicated", "dropped", "repeats the next", "time set", "offset set"))
    time, offset = struct.unpack("<QQ", entries[number])
    if action == "duplicated":
        entries.insert(number, entries[number])
    elif action == "dropped":
        del entries[number]
    elif action == "repeats the next":
        entries[number] = entries[(number + 1) % len(entries)]
    elif action == "time set":
        entries[number] = struct.pack("<QQ", odd_number(random, 8, time), offset)
    else:
        entries[number] = struct.pack("<QQ", time, odd_number(random, 8, offset))
    body = b"".join(entries)
    records[place] = record(MESSAGE_INDEX, content[:2] + struct.pack("<L", len(body)) + body)
    what = f"message index (record {place}): entry {number} {action}"
    return _made(base, joined(records, _closed(base), fitted=_closed(base)), what)


MUTATIONS: dict[str, Mutation] = {
    "field of a record": field_of_record,
    "length of a record": length_of_record,
    "record moved": record_moved,
    "entry of an index": index_entry,
    "inside a chunk": inside_chunk,
    "size of a chunk": chunk_size,
    "bomb": bomb,
    "definition": definition,
}
