"""Logs compressed as a whole: .mcap.zst, .bag.lz4, .db3.zstd and .csv.zst."""

from __future__ import annotations

import struct
from random import Random
from typing import Any

import lz4.frame
import zstandard

from tests.attack import definitions
from tests.attack.case import EXACT, REPORTED, Base, Mutated, Mutation, odd_number, replaced
from tests.attack.formats import mcap, rosbag1, sqlite3_bag

SKIPPABLE = b"\x50\x2a\x4d\x18"


def bases() -> list[Base]:
    """One of every ending, with content checksums."""
    bags = [each for each in rosbag1.bases() if each.name == "none, closed"]
    files = [each for each in mcap.bases() if each.name in ("ros2msg, none", "ros2msg, none, not closed")]
    databases = sqlite3_bag.bases()[:1]
    return [
        *(_base(each, ".zst", EXACT) for each in files),
        *(_base(each, ".lz4", REPORTED) for each in bags),
        *(_base(each, ".zstd", REPORTED) for each in databases),
    ]


def packed(content: bytes, ending: str) -> bytes:
    """Compress in blocks of 2 kB, so that damage to one leaves others, with a content checksum."""
    pieces = [content[at : at + 2000] for at in range(0, len(content), 2000)]
    if ending == ".lz4":
        frame = lz4.frame.LZ4FrameCompressor(content_checksum=True, auto_flush=True)
        return bytes(frame.begin(len(content)) + b"".join(map(frame.compress, pieces)) + frame.flush())
    packer = zstandard.ZstdCompressor(write_checksum=True).compressobj(size=len(content))
    blocks = [packer.compress(piece) + packer.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK) for piece in pieces]
    return b"".join(blocks) + packer.flush()


def _base(inner: Base, ending: str, guard: str) -> Base:
    ((name, content),) = inner.files.items()
    name += ending
    return Base(
        "compressed_file",
        f"{name.removeprefix('log')} ({inner.name})",
        {name: packed(content, ending)},
        name,
        inner.truth,
        inner.wanted,
        guard,
    )


def _whole(base: Base) -> tuple[str, str, bytes]:
    name = base.path
    ending = name[name.rindex(".") :]
    return name, ending, _unpacked(base.files[name], ending)


def _unpacked(content: bytes, ending: str) -> bytes:
    if ending == ".lz4":
        return bytes(lz4.frame.decompress(content))
    return zstandard.ZstdDecompressor().decompressobj().decompress(content)


def _made(base: Base, data: bytes, what: str, **expected: Any) -> Mutated | None:
    name = base.path
    return None if data == base.files[name] else Mutated(what, replaced(base, name, data), **expected)


def frames(random: Random, base: Base) -> Mutated | None:
    """Split into frames, with empty and skippable ones between, or with noise behind."""
    _, ending, plain = _whole(base)
    count = random.choice((1, 2, 3, 20))
    places = sorted(random.randrange(len(plain)) for _ in range(count - 1))
    parts = [plain[a:b] for a, b in zip([0, *places], [*places, len(plain)], strict=True)]
    made = [packed(part, ending) for part in parts]
    what = f"{count} frames"
    action = random.choice(("none", "empty", "skippable", "noise", "dropped", "duplicated", "swapped"))
    place = random.randrange(count)
    extra, cut = 0, False
    if action == "empty":
        made.insert(place, packed(b"", ending))
    elif action == "skippable":
        made.insert(place, SKIPPABLE + struct.pack("<L", 5) + b"hello")
    elif action == "noise":
        made.append(random.randbytes(random.choice((1, 10, 1000))))
    elif action in ("dropped", "duplicated"):
        # A file of several frames less one is whole to a decompressor; what is inside must miss the rest.
        made[place : place + 1] = [] if action == "dropped" else [made[place]] * 2
        extra = base.count if action == "duplicated" else 0
        cut = action == "dropped" and place == count - 1
        if not made:
            return None
    elif action == "swapped":
        other = random.randrange(count)
        made[place], made[other] = made[other], made[place]
    return _made(base, b"".join(made), f"{what}, {action}", extra=extra, cut=cut, content=True)


def header(random: Random, base: Base) -> Mutated | None:
    """Set a byte of the frame's header: flags, window, stated size."""
    content = bytearray(base.files[base.path])
    at = random.randrange(4, 20)
    old = content[at]
    content[at] = odd_number(random, 1, old)
    return _made(base, bytes(content), f"byte {at} set from {old} to {content[at]}")


def stated_size(random: Random, base: Base) -> Mutated | None:
    """State a size that is wrong, or none."""
    name, ending, plain = _whole(base)
    size = odd_number(random, 5, len(plain))
    if ending == ".lz4":
        made = bytearray(lz4.frame.compress(plain, content_checksum=True))
        made[6:14] = struct.pack("<Q", size)
    else:
        made = bytearray(zstandard.ZstdCompressor(write_checksum=True).compress(plain))
        flag = made[4] >> 6
        if flag == 0 and not made[4] & 0x20:
            return None
        length = (1, 2, 4, 8)[flag]
        at = 5 + (0 if made[4] & 0x20 else 1)
        made[at : at + length] = struct.pack("<Q", size)[:length]
    del name
    return _made(base, bytes(made), f"content size set to {size}")


def bomb(random: Random, base: Base) -> Mutated | None:
    """Zeros, alone or behind the log."""
    _, ending, _ = _whole(base)
    zeros, size = definitions.zeros("lz4" if ending == ".lz4" else "zstd")
    behind = random.random() < 0.5
    what = f"{size} zeros {'behind the log' if behind else 'in place of the log'}"
    return _made(base, base.files[base.path] + zeros if behind else zeros, what, bomb=True, counted=behind)


def nested(random: Random, base: Base) -> Mutated | None:
    """Compress what is compressed, or compress something else."""
    _, ending, plain = _whole(base)
    choice = random.choice(("twice", "nothing", "noise", "not at all", "the other codec"))
    if choice == "twice":
        content = packed(base.files[base.path], ending)
    elif choice == "nothing":
        content = packed(b"", ending)
    elif choice == "noise":
        content = packed(random.randbytes(500), ending)
    elif choice == "not at all":
        content = plain
    else:
        content = packed(plain, ".zst" if ending == ".lz4" else ".lz4")
    return _made(base, content, f"compressed: {choice}", counted=choice in ("not at all", "the other codec"))


MUTATIONS: dict[str, Mutation] = {
    "frames": frames,
    "header of a frame": header,
    "stated size": stated_size,
    "bomb": bomb,
    "nested": nested,
}
