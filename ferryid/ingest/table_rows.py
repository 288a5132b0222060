"""Rows of a text table: bytes to columns with pyarrow, every line either a row or counted as lost."""

from __future__ import annotations

import csv
import mmap
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, one_line
from ferryid.ingest.arrow_columns import column_from_arrow
from ferryid.ingest.log import Loss, Topic
from ferryid.ingest.table_time import TimePlan
from ferryid.ingest.tables import Rows, numbers_from_text

LONGEST_LINE = 1 << 20
"""Bytes of a row; a longer line is damage. A row of 40,000 columns is shorter."""
_PIECE = 1 << 24
_MOST_LINES = 100
"""Lines that the quoted cells of one row may go over."""
_UTF8 = ("utf-8", "utf8", "utf-8-sig", "ascii", "us-ascii")
_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "null", "NULL", "None", "-nan", "-NaN"]


@dataclass(frozen=True)
class TextSheet:
    """One text table; `first_row` counts the lines before the first row of data, its header included."""

    path: Path
    topic: Topic
    time: TimePlan
    names: tuple[str, ...]
    separator: str
    decimal: str
    first_row: int
    encoding: str
    unread: str = ""
    """What is lost before the first row, as a sentence."""

    def load(self, names: Sequence[str]) -> Rows:
        """Parse the named columns of every row that has the right number of fields."""
        rows = _load(self, tuple(names))
        if not self.unread:
            return rows
        return replace(rows, losses=(Loss(str(self.path), self.unread, self.topic.name), *rows.losses))


@dataclass
class _Body:
    """The rows of a table as UTF-8, one character between fields, and what of the file is not in them."""

    data: Any
    start: int
    delimiter: str
    cut: bool
    """True where the last line lacks its end."""
    several_lines: bool = False
    """True where a quoted cell goes over several lines."""
    dropped: dict[str, list[str]] = field(default_factory=dict)
    """Reason to the lines left out for it; all but the first ten as empty strings."""
    undecodable: int = 0
    """Lines with bytes that are not text in the file's encoding."""


@dataclass
class _Wrong:
    """Rows without the right number of fields: how many, and of the first and last line, fields and text."""

    count: int = 0
    first: tuple[int | None, int, str] = (None, 0, "")
    last: tuple[int | None, int, str] = (None, 0, "")

    def __call__(self, row: Any) -> str:
        entry = (row.number, row.actual_columns, row.text)
        self.first = self.first if self.count else entry
        self.last = entry
        self.count += 1
        return "skip"


def after_lines(data: Any, lines: int) -> int:
    """Return the place of the first byte after so many lines, which end in LF, CR LF or CR."""
    place = 0
    ends = re.finditer(rb"\r\n|\n|\r", data)
    for _ in range(lines):
        end = next(ends, None)
        if end is None:
            return len(data)
        place = end.end()
    return place


def quoted(text: str) -> str:
    """A line of the file in quotes, cut to 60 characters."""
    bare = one_line(" ".join(text[:400].split()))
    return f'"{bare[:57]}..."' if len(bare) > 60 else f'"{bare}"'


def _load(sheet: TextSheet, names: tuple[str, ...]) -> Rows:
    import pyarrow as pa
    import pyarrow.csv as arrow_csv

    body = _body(sheet)
    wrong = _Wrong()
    times = {sheet.time.column, *sheet.time.stamp}
    texts = {sheet.time.column: pa.string()} if sheet.time.unit == "datetime" else {}
    try:
        table = arrow_csv.read_csv(
            pa.BufferReader(pa.py_buffer(body.data).slice(body.start)),
            read_options=arrow_csv.ReadOptions(column_names=list(sheet.names), use_threads=False, block_size=1 << 22),
            parse_options=arrow_csv.ParseOptions(
                delimiter=body.delimiter, invalid_row_handler=wrong, newlines_in_values=body.several_lines
            ),
            convert_options=arrow_csv.ConvertOptions(
                include_columns=list(names),
                column_types=texts,
                decimal_point=sheet.decimal,
                strings_can_be_null=True,
                null_values=_MISSING,
            ),
        )
    except (pa.ArrowException, ValueError, KeyError) as error:
        raise FerryIdError(
            f"{sheet.path}: the rows cannot be parsed ({one_line(str(error))}). "
            "Fix: correct separator, encoding or skip_rows under [table] in the profile"
        ) from error
    losses: list[Loss] = []
    columns = {}
    for name in names:
        values = column_from_arrow(table.column(name), is_time=name in times)
        if values.dtype.kind == "O" and name not in texts:
            values, unreadable = numbers_from_text(values, sheet.decimal, is_time=name in times)
            if unreadable:
                numbers = "is not a number and counts" if unreadable == 1 else "are not numbers and count"
                what = f'{counted(unreadable, "cell")} of column "{name}" {numbers} as missing'
                losses.append(Loss(str(sheet.path), what, sheet.topic.name))
        columns[name] = values
    losses += _wrong_rows(sheet, wrong, _cut_line(body))
    for reason, lines in body.dropped.items():
        what = f"{counted(len(lines), 'row')} with {reason} {verb(len(lines), 'was')} left out (the first: {quoted(lines[0])})"
        losses.append(Loss(str(sheet.path), what, sheet.topic.name, messages=len(lines)))
    if body.undecodable:
        what = (
            f"{counted(body.undecodable, 'row')} {verb(body.undecodable, 'holds')} bytes that are not "
            f"{sheet.encoding} text: these characters are lost"
        )
        losses.append(Loss(str(sheet.path), what, sheet.topic.name))
    return Rows(columns, tuple(losses))


def _cut_line(body: _Body) -> str:
    """Return the last line of a file that does not end with one, an empty string where it does."""
    if not body.cut:
        return ""
    start = 1 + max(body.data.rfind(b"\n"), body.data.rfind(b"\r"), body.start - 1)
    return bytes(body.data[start:]).decode("utf-8", "replace")


def _wrong_rows(sheet: TextSheet, wrong: _Wrong, cut_line: str) -> list[Loss]:
    """Losses for rows with the wrong number of fields; a last row cut in mid-line is told apart."""
    losses = []
    count = wrong.count
    _, fields, text = wrong.last
    # The quoted cells of a row may go over several lines.
    if cut_line and count and text.endswith(cut_line) and fields < len(sheet.names):
        what = f"the file ends in the middle of a row ({quoted(text)}): the last row was left out"
        losses.append(Loss(str(sheet.path), what, sheet.topic.name, messages=1))
        count -= 1
    if count:
        number, fields, text = wrong.first
        line = "" if number is None else f" near line {number + sheet.first_row}"
        what = (
            f"{counted(count, 'row')} without {counted(len(sheet.names), 'field')} {verb(count, 'was')} left out "
            f"(the first{line} has {fields}: {quoted(text)})"
        )
        losses.append(Loss(str(sheet.path), what, sheet.topic.name, messages=count))
    return losses


def _body(sheet: TextSheet) -> _Body:
    """Decode, find the first row, and take out what would cost more than its own line."""
    body = _decoded(sheet)
    if sheet.separator == "whitespace":
        pieces = (np.frombuffer(piece, dtype=np.uint8) for piece in _pieces(body.data, body.start))
        body.data, body.start = b"".join(_single_tabs(piece) for piece in pieces), 0
    if _needs_care(body.data, body.start):
        _without_broken_lines(body, len(sheet.names))
    return body


def _decoded(sheet: TextSheet) -> _Body:
    """The rows as UTF-8; a file in it that is not damaged is mapped and not copied."""
    delimiter = "\t" if sheet.separator == "whitespace" else sheet.separator
    with sheet.path.open("rb") as file:
        data: Any = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    encoding = sheet.encoding.lower().replace("_", "-")
    undecodable = 0
    if encoding not in _UTF8:
        text = _as_text(sheet, data[:], encoding)
        data, undecodable = text.encode("utf-8", "replace"), _lines_with("\ufffd", text)
    start = after_lines(data, sheet.first_row)
    if encoding in _UTF8 and not _is_utf8(data, start):
        text = data[start:].decode("utf-8", "surrogateescape")
        text = re.sub("[\udc80-\udcff]+", "\ufffd", text)
        undecodable = _lines_with("\ufffd", text)
        data, start = text.encode(), 0
    cut = len(data) > start and data[-1:] not in (b"\n", b"\r")
    return _Body(data, start, delimiter, cut, undecodable=undecodable)


def _lines_with(character: str, text: str) -> int:
    """Number of lines that hold a character."""
    count, place, end = 0, 0, re.compile("[\r\n]")
    while (place := text.find(character, place)) >= 0:
        count += 1
        following = end.search(text, place)
        if following is None:
            break
        place = following.end()
    return count


def _as_text(sheet: TextSheet, data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding, errors="replace").removeprefix("\ufeff")
    except ValueError as error:
        raise FerryIdError(
            f"{sheet.path}: the text is not {sheet.encoding} ({one_line(str(error))}). "
            "Fix: correct encoding under [table] in the profile"
        ) from error


def _is_utf8(data: Any, start: int) -> bool:
    import pyarrow as pa

    whole = pa.py_buffer(data).slice(start)
    ends = pa.py_buffer(np.array([0, whole.size], dtype=np.int64))
    try:
        pa.Array.from_buffers(pa.large_string(), 1, [None, ends, whole]).validate(full=True)
    except pa.ArrowInvalid:
        return False
    return True


def _needs_care(data: Any, start: int) -> bool:
    """True where a line is too long, or where quotes may not be closed."""
    if data.find(b'"', start) >= 0:
        return True
    place, size = start, len(data)
    while size - place > LONGEST_LINE:
        # Every stretch of that length holds the end of a line; the search for it is short where lines are.
        end = data.rfind(b"\n", place, place + LONGEST_LINE)
        if end < 0:
            return True
        place = end + 1
    return False


def _pieces(data: Any, place: int) -> Iterator[bytes]:
    """Stretches of whole lines."""
    while place < len(data):
        end = data.find(b"\n", place + _PIECE)
        stop = len(data) if end < 0 else end + 1
        yield data[place:stop]
        place = stop


def _without_broken_lines(body: _Body, width: int) -> None:
    """Leave out lines that are too long or whose quotes are not closed, and count them."""
    delimiter = body.delimiter.encode()
    if len(_suspect_lines(np.frombuffer(body.data, dtype=np.uint8)[body.start :], delimiter)) == 0:
        return
    data = bytes(body.data[body.start :])
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    whole = _whole_row(delimiter)
    suspects = _suspect_lines(np.frombuffer(data, dtype=np.uint8), delimiter)
    lines = data.split(b"\n")
    kept = np.ones(len(lines), dtype=bool)
    done = 0
    for number in suspects.tolist():
        line = lines[number]
        if number < done or (len(line) <= LONGEST_LINE and whole.fullmatch(line)):
            continue
        last = 0 if len(line) > LONGEST_LINE else _last_line(lines, number, width, delimiter, whole)
        if last:
            body.several_lines, done = True, last + 1
            continue
        kept[number] = False
        reason = "more than a million characters" if len(line) > LONGEST_LINE else "a quote that is not closed"
        listed = body.dropped.setdefault(reason, [])
        listed.append(line[:200].decode("utf-8", "replace") if len(listed) < 10 else "")
    body.data = data if kept.all() else b"\n".join(lines[number] for number in np.flatnonzero(kept))
    body.start = 0
    body.cut = body.cut and bool(kept[-1])


def _whole_row(delimiter: bytes) -> re.Pattern[bytes]:
    """Pattern of a row as CSV readers take it: only a cell that begins with a quote is quoted."""
    other = b"[^" + re.escape(delimiter) + b"]"
    cell = b'(?:"(?:[^"]|"")*+"' + other + b'*+|(?!")' + other + b"*+)"
    return re.compile(cell + b"(?:" + re.escape(delimiter) + cell + b")*+")


def _suspect_lines(raw: NDArray[np.uint8], delimiter: bytes) -> NDArray[np.intp]:
    """Lines that are too long, or whose quotes do not stand in pairs at the ends of cells."""
    end = raw == 10
    returns = np.flatnonzero(raw == 13)
    if len(returns):
        end[returns[raw[np.minimum(returns + 1, len(raw) - 1)] != 10]] = True  # a CR by itself ends a line too
    ends = np.append(np.flatnonzero(end), len(raw))
    long = np.flatnonzero(np.diff(ends, prepend=-1) > LONGEST_LINE)
    quotes = np.flatnonzero(raw == 34)
    if len(quotes) == 0:
        return long
    line = np.searchsorted(ends, quotes)
    first = np.searchsorted(line, line)  # place of the first quote of the same line
    opens = (np.arange(len(quotes)) - first) % 2 == 0
    before = _ends_cell(raw[np.maximum(quotes - 1, 0)], delimiter) | (quotes == 0)
    after = _ends_cell(raw[np.minimum(quotes + 1, len(raw) - 1)], delimiter) | (quotes == len(raw) - 1)
    odd = np.bincount(line, minlength=len(ends)) % 2 == 1
    odd[line[np.where(opens, ~before, ~after)]] = True
    odd[long] = True
    return np.flatnonzero(odd)


def _ends_cell(raw: NDArray[np.uint8], delimiter: bytes) -> NDArray[np.bool_]:
    ends: NDArray[np.bool_] = (raw == delimiter[0]) | (raw == 10) | (raw == 13)
    return ends


def _last_line(lines: Sequence[bytes], number: int, width: int, delimiter: bytes, whole: re.Pattern[bytes]) -> int:
    """Line on which a row ends whose quoted cell goes over several lines; 0 where the quote is damage.

    A line below that has as many fields as a row by itself is one, so that a stray quote cannot take rows with it.
    """
    for last in range(number + 1, min(number + _MOST_LINES, len(lines))):
        if len(lines[last].split(delimiter)) == width or len(lines[last]) > LONGEST_LINE:
            return 0
        joined = b"\n".join(lines[number : last + 1])
        if len(joined) > LONGEST_LINE:
            return 0
        if whole.fullmatch(joined):
            try:
                rows = list(csv.reader([joined.decode("utf-8", "replace")], delimiter=delimiter.decode()))
            except csv.Error:
                return 0
            return last if len(rows) == 1 and len(rows[0]) == width else 0
    return 0


def _single_tabs(raw: NDArray[np.uint8]) -> bytes:
    """Replace every run of blanks by one tab, none at the ends of a line."""
    blank = (raw == 32) | (raw == 9)
    end = (raw == 10) | (raw == 13)
    after = np.empty(len(raw), dtype=bool)  # the next byte is a blank or ends the line
    after[:-1] = blank[1:] | end[1:]
    after[-1:] = True
    first = np.empty(len(raw), dtype=bool)  # a line starts here
    first[:1] = True
    first[1:] = end[:-1]
    # Of each run the last blank stays, unless nothing but blanks comes before it on its line.
    keep = ~blank | ~after
    leading = blank & first
    if leading.any():
        starts = np.flatnonzero(first)
        solid = np.flatnonzero(~blank)
        following = np.searchsorted(solid, starts)
        stops = np.where(following < len(solid), solid[np.minimum(following, max(len(solid) - 1, 0))], len(raw))
        edges = np.zeros(len(raw) + 1, dtype=np.int64)
        np.add.at(edges, starts, 1)
        np.add.at(edges, stops, -1)
        keep &= np.cumsum(edges[:-1]) == 0
        keep |= ~blank
    tabbed = np.where(blank, np.uint8(9), raw)
    return bytes(tabbed[keep].tobytes())
