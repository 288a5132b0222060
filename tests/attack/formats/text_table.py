"""Text tables: comma, semicolon, tab and blanks, in several encodings."""

from __future__ import annotations

import csv
import io
from random import Random

from tests.attack.case import Base, Mutated, Mutation, Rows
from tests.attack.logs import messages, rows
from tests.attack.raw import edited_text, text_total

WANTED = {"table": ("data",)}
ODD_CELLS = (
    "", "nan", "inf", "-inf", "1e999", "1e308", "x", '"', '""', '"a""b"', '"a\nb"', "1,5", "0x10", "1_000", "\t",
    "9" * 400, "9" * 100_000, "-", "=cmd()", "<b>", "\x1b[2J", "é", "\x00", "None", "#N/A", "TRUE", "2020-01-01",
    "9223372036854775808", "-9223372036854775808", "1.7e300", "1600000000", "1600000000000", " 7 ", "'7'", "//", "#",
)  # fmt: skip


def bases() -> list[Base]:
    """Separators, quotes and line ends."""
    return [
        _base("comma", "log.csv", ",", "\n"),
        _base("semicolon, CRLF", "log.csv", ";", "\r\n"),
        _base("tab", "log.txt", "\t", "\n"),
        _base("comma, quoted", "log.csv", ",", "\n", quoted=True),
    ]


def _base(name: str, file: str, separator: str, end: str, quoted: bool = False) -> Base:
    text = io.StringIO()
    quoting = csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL
    writer = csv.writer(text, delimiter=separator, lineterminator=end, quoting=quoting)
    writer.writerow(["time", "data", "note"])
    for topic, time, value in messages():
        if topic == "/speed":
            writer.writerow([str(time), repr(value), "ok"])
    content = text.getvalue().encode()
    return Base("text_table", name, {file: content}, file, _truth(content.decode(), separator), WANTED)


def _truth(text: str, separator: str) -> dict[str, Rows]:
    found = csv.DictReader(io.StringIO(text, newline=""), delimiter=separator)
    return rows(("table", int(row["time"]), float(row["data"])) for row in found)


def _file(random: Random, base: Base) -> str:
    return random.choice(sorted(base.files))


def _lines(base: Base, name: str) -> tuple[list[bytes], bytes]:
    content = base.files[name]
    end = b"\r\n" if b"\r\n" in content else b"\n"
    return content.rstrip(b"\r\n").split(end), end


def _separator(lines: list[bytes]) -> bytes:
    return next(one for one in (b",", b";", b"\t") if one in lines[0])


def cells(random: Random, base: Base) -> Mutated | None:
    """Replace a cell, or several of one column."""
    name = _file(random, base)
    lines, end = _lines(base, name)
    separator = _separator(lines)
    value = random.choice(ODD_CELLS)
    places = random.sample(range(1, len(lines)), random.choice((1, 1, 5, len(lines) - 1)))
    before = sum(line.count(b"\n") for line in lines)
    column = random.randrange(lines[0].count(separator) + 1)
    for place in places:
        parts = lines[place].split(separator)
        parts[column] = value.encode()
        lines[place] = separator.join(parts)
    content = end.join(lines) + end
    shown = repr(value[:20])
    rows_before = sum(len(each.times) for each in base.truth.values())
    # A line end inside quotes makes no row.
    total = rows_before if "\n" in value and before == 0 else None
    return edited_text(base, name, content, f"{len(places)} cells of column {column} set to {shown}", total)


def lines_moved(random: Random, base: Base) -> Mutated | None:
    """Duplicate, drop, swap or add lines, also the first."""
    name = _file(random, base)
    lines, end = _lines(base, name)
    place = random.choice((0, random.randrange(len(lines))))
    action = random.choice(("duplicated", "dropped", "swapped", "blank before it", "wider", "narrower", "noise"))
    separator = _separator(lines)
    if action == "duplicated":
        lines.insert(random.randrange(place, len(lines)), lines[place])
    elif action == "dropped":
        del lines[place]
    elif action == "swapped":
        other = random.randrange(len(lines))
        lines[place], lines[other] = lines[other], lines[place]
    elif action == "blank before it":
        lines.insert(place, random.choice((b"", b"  ", separator, separator * 2)))
    elif action == "wider":
        lines[place] += separator + random.choice((b"7", b"x", b"\xff\xfe"))
    elif action == "narrower":
        lines[place] = lines[place].rpartition(separator)[0]
    else:
        lines[place] = bytes(byte for byte in random.randbytes(40) if byte not in b"\r\n")
    # The line of names may stand twice below each other, as that of units does: it is no row.
    total = sum(len(each.times) for each in base.truth.values()) if (place, action) == (0, "duplicated") else None
    return edited_text(base, name, end.join(lines) + end, f"line {place} {action}", total)


def header(random: Random, base: Base) -> Mutated | None:
    """Change the line of names."""
    name = _file(random, base)
    lines, end = _lines(base, name)
    separator = _separator(lines)
    names = lines[0].split(separator)
    action = random.choice(("twice", "empty", "odd", "numbers", "none", "wide", "same"))
    if action == "twice":
        lines[0] = separator.join(names + names)
    elif action == "empty":
        lines[0] = separator * (len(names) - 1)
    elif action == "odd":
        odd = (b"time\x00", b"\xff", b'"', b"=cmd()", b"<script>", b"\x1b[2J", b"x" * 70_000, b"original_timestamp")
        names[random.randrange(len(names))] = random.choice(odd)
        lines[0] = separator.join(names)
    elif action == "numbers":
        lines[0] = separator.join(b"%d" % number for number in range(len(names)))
    elif action == "none":
        del lines[0]
    elif action == "wide":
        lines[0] += separator + separator.join(b"c%d" % number for number in range(20_000))
    else:
        lines[0] = separator.join([names[0]] * len(names))
    content = end.join(lines) + end
    total = text_total(base, name, content)
    # Without names the first of these lines is a row, which may be taken for the names.
    return edited_text(base, name, content, f"line of names: {action}", total)


def encoding(random: Random, base: Base) -> Mutated | None:
    """Write the text in another encoding, with or without a byte order mark."""
    name = _file(random, base)
    text = base.files[name].decode()
    codec = random.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "utf-32", "cp037", "utf-7"))
    return edited_text(
        base, name, text.encode(codec), f"in {codec}", sum(len(each.times) for each in base.truth.values())
    )


def bad_text(random: Random, base: Base) -> Mutated | None:
    """Put bytes that are no UTF-8, NULs or quotes into lines."""
    name = _file(random, base)
    lines, end = _lines(base, name)
    odd = random.choice((b"\xff", b"\xc3", b"\x00", b'"', b"\r", b"\xed\xa0\x80", b"\x1a", b"\x1b[2J", b"\xef\xbb\xbf"))
    count = random.choice((1, 1, 3, 50))
    places = random.sample(range(len(lines)), min(count, len(lines)))
    for place in places:
        at = random.randrange(len(lines[place]) + 1)
        # Also too many cells: what reports a bad line must not fail for what is in it.
        lines[place] = lines[place][:at] + odd + lines[place][at:] + random.choice((b"", _separator(lines) + b"7"))
    return edited_text(base, name, end.join(lines) + end, f"{odd!r} in {len(places)} lines")


def separators(random: Random, base: Base) -> Mutated | None:
    """Use another separator in some lines, or in all."""
    name = _file(random, base)
    lines, end = _lines(base, name)
    separator = _separator(lines)
    other = random.choice((b",", b";", b"\t", b" ", b"|", b":"))
    share = random.choice((0.02, 0.5, 1.0))
    lines = [line.replace(separator, other) if random.random() < share else line for line in lines]
    return edited_text(base, name, end.join(lines) + end, f"{separator!r} is {other!r} in {share:.0%} of the lines")


def line_ends(random: Random, base: Base) -> Mutated | None:
    """Mix line ends, or leave them out."""
    name = _file(random, base)
    lines, _ = _lines(base, name)
    ends = random.choice(([b"\r"], [b"\r\n", b"\n"], [b"\n", b"\r"], [b"\n\n"], [b"\n\r"], [b"\n", b"\x0b"]))
    content = b"".join(line + random.choice(ends) for line in lines)
    return edited_text(base, name, content, f"lines end with {ends!r}")


MUTATIONS: dict[str, Mutation] = {
    "cells": cells,
    "lines moved": lines_moved,
    "line of names": header,
    "encoding": encoding,
    "odd bytes": bad_text,
    "separators": separators,
    "line ends": line_ends,
}
