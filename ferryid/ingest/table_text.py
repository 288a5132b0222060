"""Text tables: separator, header row and columns found or taken from a layout."""

from __future__ import annotations

import codecs
import csv
import mmap
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.ingest.log import TableLayout, Topic
from ferryid.ingest.other_formats import unread_text
from ferryid.ingest.table_rows import TextSheet, quoted
from ferryid.ingest.table_time import TimePlan, guess_stamp, guess_time, looks_like_clock_time, looks_like_datetime
from ferryid.ingest.tables import (
    no_time,
    number_doubt,
    numbers_from_text,
    plan_time,
    to_ns,
    unique_names,
    with_stated_unit,
)

_HEAD_BYTES = 1 << 16
_LONGEST_HEAD = 1 << 22
_HEAD_LINES = 8
"""The head is read on to its greatest length where it holds fewer lines."""
_SAMPLE_LINES = 400
_DAMAGED_LINES = 2
"""Lines without a number or the right number of fields that may stand between the column names and the rows."""
_CONTROL = re.compile(rb"[\0-\x08\x0e-\x1f]")
"""Characters that no text has; where every other line has one, a file is none."""
_COMMA_NUMBER = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$")
_BEGINS_NUMBER = re.compile(r"\s*[+-]?\.?\d")
_WORDS = {"true", "false", "nan", "inf", "-inf", "null", "none", ""}
_BOMS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_LINE_END = re.compile("\r\n|\n|\r")


@dataclass(frozen=True)
class _Shape:
    """Where the rows of a text start, how their fields are separated, and what the header calls them."""

    separator: str
    decimal: str
    first_row: int
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]
    unread: str = ""
    """What is lost before the first row, as a sentence."""


def open_text(path: Path, layout: TableLayout | None, topic: str = "table") -> TextSheet:
    """Find out how a text table is laid out, from its first 64 KiB and the profile's ``[table]`` where there is one.

    Raises
    ------
    FerryIdError
        For an empty file, a header without rows, text that is no table, or a layout that does not fit.
    """
    size = path.stat().st_size
    if size == 0:
        raise FerryIdError(f"{path}: the file is empty (0 bytes). Fix: copy or record the log again")
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
        if len(re.findall(rb"\r\n?|\n", head)) < _HEAD_LINES:
            head += file.read(_LONGEST_HEAD - len(head))
        file.seek(max(0, size - _HEAD_BYTES))
        tail = file.read()
    text, encoding, told = _decode(path, head, layout)
    lines = _LINE_END.split(text)
    if size > len(head) or not lines[-1]:
        lines.pop()  # very likely cut in the middle, or what follows the last line's end
    shape = _stated(path, lines, layout) if layout is not None else _guessed(path, lines)
    names, renamed = unique_names(shape.names)
    notes = [*told, *shape.notes, renamed]
    sample = {name: [row[place].strip() for row in shape.rows] for place, name in enumerate(names)}
    plan = plan_time(str(path), names, layout) if layout is not None else None
    if plan is None:
        plan = guess_time(
            {
                name: [v.replace(",", ".") if shape.decimal == "," else v for v in values]
                for name, values in sample.items()
            }
        )
        if plan is None:
            numbers = {
                name: numbers_from_text(np.array(v, dtype=object), shape.decimal)[0] for name, v in sample.items()
            }
            raise FerryIdError(no_time(str(path), names, numbers))
        plan = with_stated_unit(plan, layout)
        notes.append(plan.note)
    else:
        if not plan.stamp and guess_stamp(names):
            notes.append(f'the profile maps no stamp, though column "{guess_stamp(names)[0]}" looks like one')
        times = numbers_from_text(np.array(sample[plan.column], dtype=object), shape.decimal)[0]
        notes.append(number_doubt(times, plan.unit))
    fields = {name: _type_of(sample[name], shape.decimal) for name in names}
    start, end = _span(shape, names, plan, tail, encoding)
    lines_in_file = _count_lines(path, size)
    described = Topic(
        name=topic,
        type="table",
        encoding="table",
        count=max(0, lines_in_file - shape.first_row),
        start_ns=start,
        end_ns=end,
        fields=fields,
        note="; ".join(note for note in notes if note),
    )
    return TextSheet(
        path, described, plan, names, shape.separator, shape.decimal, shape.first_row, encoding, shape.unread
    )


def looks_like_text(head: bytes) -> bool:
    """Return True where the first bytes of a file are text (a byte-order mark counts)."""
    if any(head.startswith(bom) for bom, _ in _BOMS):
        return True
    return b"\0" not in head and not any(byte < 9 or 13 < byte < 32 for byte in head)


def _decode(path: Path, head: bytes, layout: TableLayout | None) -> tuple[str, str, list[str]]:
    """Text of the head, the encoding that fits, and what to report of it."""
    marked = next((name for bom, name in _BOMS if head.startswith(bom)), None)
    wanted = marked or (layout.encoding if layout is not None else "utf-8")
    wide = wanted.lower().replace("_", "-").startswith(("utf-16", "utf-32", "utf16", "utf32"))
    # Zeros at the end are what a power loss leaves of a row that was not written; they cost that row only.
    lines = head.rstrip(b"\0").splitlines()
    if not wide and sum(_CONTROL.search(line) is not None for line in lines) * 2 >= len(lines):
        raise FerryIdError(
            f"{path}: this is binary data, not a text table. Fix: pass a log in one of the known formats; for UTF-16 "
            'text without a byte-order mark set encoding = "utf-16-le" under [table] in the profile'
        )
    try:
        head[:64].decode(wanted, errors="replace")  # some codecs are for names and not for files
        decoder = codecs.getincrementaldecoder(wanted)(errors="strict")
        return decoder.decode(head).removeprefix("\ufeff"), wanted, ["byte-order mark skipped"] if marked else []
    except UnicodeDecodeError:
        if wide or (wanted.lower() in ("utf-8", "utf8", "utf-8-sig") and _mostly_utf8(head)):
            return head.decode(wanted, errors="replace").removeprefix("\ufeff"), wanted, []
        return head.decode("cp1252", errors="replace"), "cp1252", [f"not {wanted} text: read as cp1252"]
    except (LookupError, ValueError, TypeError) as error:
        raise FerryIdError(
            f'{path}: the profile\'s [table] names the encoding "{wanted}", which cannot be used. '
            'Fix: use "utf-8", "cp1252" or another name that Python knows'
        ) from error


def _mostly_utf8(head: bytes) -> bool:
    """True where more lines with characters beyond ASCII are UTF-8 than are not: the others are damaged."""
    valid = invalid = 0
    for line in head.splitlines()[:-1]:
        if line.isascii():
            continue
        try:
            line.decode()
            valid += 1
        except UnicodeDecodeError:
            invalid += 1
    return valid > invalid


def _split(line: str, separator: str) -> tuple[str, ...]:
    if separator == "whitespace":
        return tuple(line.split())
    if '"' not in line:
        return tuple(line.split(separator))
    try:
        return tuple(next(csv.reader([line], delimiter=separator), ()))
    except csv.Error:  # a cell of more than 128 KiB
        return tuple(line.split(separator))


def _is_number(text: str, decimal: str) -> bool:
    try:
        float(text.replace(",", ".") if decimal == "," and _COMMA_NUMBER.match(text) else text)
    except ValueError:
        return False
    return True


def _is_measured(text: str, decimal: str) -> bool:
    """True for a number or a time, but not for the 1 that stands for a unit."""
    bare = text.strip()
    return bare not in ("", "1") and (_is_number(bare, decimal) or _is_time(bare))


def _is_time(text: str) -> bool:
    return looks_like_datetime(text) or looks_like_clock_time(text)


def _values_in(fields: Sequence[str], decimal: str) -> int:
    """Return how many fields are values; zero where this is no row: under half of them are, or none is a number or a time."""
    if len(fields) < 2:
        return 0
    values, measured = 0, False
    for field in fields:
        bare = field.strip()
        # Most are numbers, and those are found fastest.
        if _is_number(bare, decimal) or _is_time(bare):
            values, measured = values + 1, True
        elif bare.lower() in _WORDS:
            values += 1
    return values if measured and values * 2 >= len(fields) else 0


def _decimal_of(rows: Sequence[Sequence[str]], separator: str) -> str:
    """A comma where numbers are written with commas and none with points."""
    if separator == ",":
        return "."
    cells = [cell for row in rows for cell in row]
    commas = sum(_COMMA_NUMBER.match(cell) is not None for cell in cells)
    points = sum("." in cell and _is_number(cell, ".") for cell in cells)
    return "," if commas > points else "."


def _guessed(path: Path, lines: Sequence[str]) -> _Shape:
    """Guess the separator as the one that splits most lines into rows of one length."""
    best: tuple[int, float, int, str, str, int] | None = None
    sample = list(lines[:_SAMPLE_LINES])
    filled = [line for line in sample if line.strip()]
    other = unread_text(filled)
    if other is not None:
        raise FerryIdError(
            f"{path}: this text is not a table of numbers, found {other[0]}: {quoted(filled[0])}. Fix: {other[1]}"
        )
    for separator in (",", ";", "\t", "whitespace"):
        split = [_split(line, separator) for line in sample]
        decimal = _decimal_of(split, separator)
        values = [_values_in(fields, decimal) for fields in split]
        rows = [place for place, count in enumerate(values) if count]
        if not rows:
            continue
        width, count = Counter(len(split[place]) for place in rows).most_common(1)[0]
        alike = [place for place in rows if len(split[place]) == width]
        first = alike[0]
        share = sum(values[place] for place in alike) / (count * width)
        rank = (count, share, width, separator, decimal, first)
        if best is None or rank[:3] > best[:3]:
            best = rank
    if best is None or best[0] * 10 < 6 * (len([line for line in sample[best[5] :] if line.strip()])):
        if len(filled) == 1 and any(len(_split(filled[0], separator)) > 1 for separator in (",", ";", "\t")):
            raise FerryIdError(f"{path}: the table holds a header and no rows. Fix: record or export the log again")
        raise FerryIdError(
            f"{path}: this text is not a table of numbers, found {quoted(filled[0] if filled else '')}. "
            "Fix: pass a log, or describe the table under [table] in the profile (separator, skip_rows, columns)"
        )
    _, _, width, separator, decimal, first = best
    first = _first_below_names(lines, separator, decimal, width, first)
    header = first
    while header > 0 and len(_split(lines[header - 1], separator)) == width:
        header -= 1
    notes = []
    if header < first:
        names = _split(lines[header], separator)
        if first - header > 1:
            notes.append(
                f"{counted(first - header - 1, 'line')} between the column names and the first row skipped (units?)"
            )
    elif first > 0 and (header_names := _names_for(lines[first - 1], separator, width)) is not None:
        names, header = header_names, first - 1
    else:
        names = tuple(f"column {place}" for place in range(1, width + 1))
        notes.append("no header row: columns are named by their place")
    unread = ""
    if header == first and any(line.strip() for line in lines[:first]):
        unread = (
            f"{counted(first, 'line')} before the first row cannot be read: names of columns and rows "
            "may be lost with them"
        )
    if header > 0:
        notes.append(f"{counted(header, 'line')} before the table skipped")
    filled_rows = tuple(_rows(lines[first:], separator, width))
    shown = {"\t": "a tab", "whitespace": "white space"}.get(separator, f'"{separator}"')
    if separator != ",":
        notes.append(f"columns separated by {shown}")
    if decimal == ",":
        notes.append("decimal comma")
    return _Shape(separator, decimal, first, names, filled_rows, tuple(notes), unread)


def _first_below_names(lines: Sequence[str], separator: str, decimal: str, width: int, intact: int) -> int:
    """Return the line below the column names, where damaged rows may stand above the first intact one; else `intact`.

    A damaged row has another number of fields or holds a number still; a line of names or units does neither. Between
    blanks any sentence has fields, so that only rows with a number are passed over in such a table.
    """
    top, unknown = intact, 0
    while top > 0:
        line = lines[top - 1]
        cells = _split(line, separator)
        if not any(_is_measured(cell, decimal) for cell in cells):
            if len(cells) == width or _names_for(line, separator, width) is not None:
                return top
            unknown += bool(line.strip())
            if unknown > _DAMAGED_LINES or separator == "whitespace":
                break
        top -= 1
    return intact


def _names_for(line: str, separator: str, width: int) -> tuple[str, ...] | None:
    """Column names from a header line that lacks the name of the last column; None if it is no header."""
    names = _split(line, separator)
    if separator == "whitespace" or not 1 < len(names) == width - 1:
        return None
    # What begins with a digit is a damaged row.
    return None if any(_BEGINS_NUMBER.match(name) for name in names) else (*names, "")


def _stated(path: Path, lines: Sequence[str], layout: TableLayout) -> _Shape:
    """Follow a layout to the letter."""
    separator = {"tab": "\t", "\\t": "\t", "space": "whitespace"}.get(layout.separator, layout.separator)
    if separator != "whitespace" and len(separator) != 1:
        raise FerryIdError(
            f'{path}: the profile\'s [table] names the separator "{layout.separator}". '
            'Fix: use ",", ";", a tab or "whitespace"'
        )
    body = list(lines[layout.skip_rows :])
    first = layout.skip_rows
    if layout.columns:
        names: tuple[str, ...] = tuple(layout.columns)
    else:
        while body and not body[0].strip():
            body.pop(0)
            first += 1
        names = _split(body.pop(0), separator) if body else ()
        first += 1
    filled = [line for line in body if line.strip()]
    if not filled:
        what = (
            "a header and no rows"
            if names and not layout.columns
            else f"no rows after {counted(layout.skip_rows, 'line')}"
        )
        raise FerryIdError(f"{path}: the table holds {what}. Fix: record or export the log again, or correct skip_rows")
    split = [_split(line, separator) for line in filled[:_SAMPLE_LINES]]
    width = Counter(len(fields) for fields in split).most_common(1)[0][0]
    if width == len(names) + 1 and not layout.columns and all(f[-1] == "" for f in split if len(f) == width):
        names = (*names, "")
    if width != len(names):
        raise FerryIdError(
            f"{path}: {len(names)} column names but {counted(width, 'field')} in the rows, first {quoted(filled[0])}. "
            "Fix: correct columns, separator or skip_rows under [table] in the profile"
        )
    rows = tuple(fields for fields in split if len(fields) == width)
    decimal = _decimal_of(rows, separator)
    return _Shape(separator, decimal, first, names, rows, ("decimal comma",) if decimal == "," else ())


def _rows(lines: Sequence[str], separator: str, width: int) -> list[tuple[str, ...]]:
    split = (_split(line, separator) for line in lines[:_SAMPLE_LINES])
    return [fields for fields in split if len(fields) == width]


def _type_of(values: Sequence[str], decimal: str) -> str:
    """Primitive type by a sample of the values."""
    filled = [value for value in values if value]
    if not filled:
        return "float64"
    if all(value.lower() in ("true", "false") for value in filled):
        return "bool"
    if all(re.fullmatch(r"[+-]?\d{1,18}", value) for value in filled):
        return "int64"
    numbers = sum(_is_number(value, decimal) for value in filled)
    return "float64" if numbers * 2 >= len(filled) else "string"


def _span(
    shape: _Shape, names: tuple[str, ...], plan: TimePlan, tail: bytes, encoding: str
) -> tuple[int | None, int | None]:
    """Time of the first and last row [ns] as far as they can be read from the ends of the file."""
    place = names.index(plan.column)
    text = tail[len(tail) % 4 :].decode(encoding, errors="replace")
    lines = _LINE_END.split(text)[1:]
    last = [row for row in (_split(line, shape.separator) for line in lines) if len(row) == len(names)]
    cells = np.array([row[place].strip() for row in (*shape.rows[:1], *last[-1:])], dtype=object)
    values = cells if plan.unit == "datetime" else numbers_from_text(cells, shape.decimal)[0]
    times, good, _ = to_ns(values, plan.unit)
    if not good.any():
        return None, None
    return int(times[good][0]), int(times[good][-1])


def _count_lines(path: Path, size: int) -> int:
    """Lines of a file, empty ones included; a last line without an end counts."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as whole:
        end = b"\n" if whole.find(b"\n") >= 0 else b"\r"
        count, place, ended = 0, 0, True
        while place < size:
            block = whole[place : place + (1 << 24)]
            count += block.count(end)
            place += len(block)
            ended = block.rstrip(b"\0").endswith(end)
        return count + (not ended)
