"""Mutations that know nothing of the format: bytes set, lost, moved and mixed."""

from __future__ import annotations

import re
from random import Random

from tests.attack.case import Base, Mutated, Mutation, formats, replaced

SECTORS = (512, 4096)
_CELL_OF_TWO_LINES = re.compile(rb'(?:^|(?<=[,;\t\r\n]))"[^"\r\n]*[\r\n][^"\r\n]*"(?=[,;\t\r\n]|$)')
_SEPARATOR = re.compile(rb"[,;\t ]")


def main_file(random: Random, base: Base) -> str:
    """Choose a file of the log, mostly the largest."""
    names = sorted(base.files, key=lambda name: len(base.files[name]))
    return names[-1] if random.random() < 0.8 else random.choice(names)


def _made(base: Base, name: str, content: bytes, what: str, *, cut: bool = False) -> Mutated | None:
    if content == base.files[name]:
        return None
    # A cell of a text may be changed to another valid one, and a line to none or two.
    if name.endswith((".csv", ".txt")):
        return edited_text(base, name, content, what)
    # Nothing counts the messages of an autopilot: one that ends with a whole message is complete.
    whole = cut and (name.endswith((".ulg", ".bin")) or len(content) in base.whole_at)
    return Mutated(f"{name}: {what}", replaced(base, name, content), cut=cut, counted=not whole)


def edited_text(base: Base, name: str, content: bytes, what: str, total: int | None = None) -> Mutated | None:
    """Return a text table edited by whole lines: as many rows are expected as it has lines now, or `total`."""
    old = base.files[name]
    if content == old:
        return None
    total = text_total(base, name, content) if total is None else total
    # What is no line of names any more may be a row.
    extra = int(content.splitlines()[:1] != old.splitlines()[:1])
    return Mutated(f"{name}: {what}", replaced(base, name, content), total=total, extra=extra)


def text_total(base: Base, name: str, content: bytes) -> int:
    """Count the rows of all text files as lines that hold anything, but for the one with the names.

    A line end inside a quoted cell ends no row: so Python's csv reads it, too. A line of one cell that was put above
    the names is no row either, but one before the table.
    """
    rows = 0
    for file, old in base.files.items():
        lines = _filled_lines(content if file == name else old)
        above = next((place for place, line in enumerate(lines) if _SEPARATOR.search(line)), 0)
        rows += max(len(lines) - 1 - min(above, max(len(lines) - len(_filled_lines(old)), 0)), 0)
    return rows


def _filled_lines(text: bytes) -> list[bytes]:
    lines = _CELL_OF_TWO_LINES.sub(b'"cell"', text).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    return [line for line in lines if line.strip(b" \t,;")]


def flip_bit(random: Random, base: Base) -> Mutated | None:
    """Flip one bit."""
    name = main_file(random, base)
    content = bytearray(base.files[name])
    at, bit = random.randrange(len(content)), random.randrange(8)
    content[at] ^= 1 << bit
    return _made(base, name, bytes(content), f"bit {bit} of byte {at} flipped")


def set_bytes(random: Random, base: Base) -> Mutated | None:
    """Overwrite a few bytes."""
    name = main_file(random, base)
    content = bytearray(base.files[name])
    size = min(random.choice((1, 1, 2, 4, 8)), len(content))
    at = random.randrange(len(content) - size + 1)
    value = random.choice((b"\0" * size, b"\xff" * size, random.randbytes(size)))
    content[at : at + size] = value
    return _made(base, name, bytes(content), f"bytes {at} to {at + size} set to {value.hex()}")


def truncate(random: Random, base: Base) -> Mutated | None:
    """Cut the end off."""
    name = main_file(random, base)
    content = base.files[name]
    kept = random.choice((random.randrange(len(content)), max(len(content) - random.randrange(1, 64), 0)))
    return _made(base, name, content[:kept], f"cut off after {kept} of {len(content)} bytes", cut=True)


def delete(random: Random, base: Base) -> Mutated | None:
    """Take a stretch out."""
    name = main_file(random, base)
    content = base.files[name]
    at, size = random.randrange(len(content)), random.choice((1, 2, 8, 100, 512, 4096))
    cut = at + size >= len(content)
    return _made(base, name, content[:at] + content[at + size :], f"{size} bytes deleted at {at}", cut=cut)


def insert(random: Random, base: Base) -> Mutated | None:
    """Put a stretch in, of noise or of the file itself."""
    name = main_file(random, base)
    content = base.files[name]
    at, size = random.randrange(len(content)), random.choice((1, 2, 8, 100, 512, 4096))
    source = random.randrange(len(content))
    noise = random.random() < 0.5
    stretch = random.randbytes(size) if noise else content[source : source + size]
    what = f"{len(stretch)} bytes {'of noise' if noise else f'copied from {source}'} inserted at {at}"
    made = _made(base, name, content[:at] + stretch + content[at:], what)
    if made is None or noise or made.total is not None:
        return made
    # Whole records may be among what is copied: where nothing counts them, they are as good as the first.
    return Mutated(made.what, made.files, extra=base.count)


def zero_sector(random: Random, base: Base) -> Mutated | None:
    """Zero a block of the disk, as a lost sector reads."""
    name = main_file(random, base)
    content = bytearray(base.files[name])
    size = random.choice(SECTORS)
    at = size * random.randrange(-(-len(content) // size))
    end = min(at + size, len(content))
    content[at:end] = bytes(end - at)
    return _made(base, name, bytes(content), f"bytes {at} to {end} are zero", cut=end == len(content))


def splice(random: Random, base: Base) -> Mutated | None:
    """Begin as this log and end as another."""
    name = main_file(random, base)
    content = base.files[name]
    other = random.choice(formats()[base.format][0])
    second = other.files[main_file(random, other)]
    at, there = random.randrange(len(content)), random.randrange(len(second))
    what = f"{name}: from byte {at} on it goes on as {other.name} from byte {there} on"
    return Mutated(what, replaced(base, name, content[:at] + second[there:]), counted=False)


MUTATIONS: dict[str, Mutation] = {
    "raw: bit flipped": flip_bit,
    "raw: bytes set": set_bytes,
    "raw: cut off": truncate,
    "raw: stretch deleted": delete,
    "raw: stretch inserted": insert,
    "raw: sector of zeros": zero_sector,
    "raw: two files spliced": splice,
}
