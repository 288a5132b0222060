"""Which logs a batch is about: patterns, paths and manifests."""

from __future__ import annotations

import csv
import glob
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ferryid.batch.log_result import LogFile
from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.files import existing_parts, exists, resolved
from ferryid.ingest import log_suffixes

COLUMNS = ("log", "vessel", "date", "note")
"""Of a manifest that is a table; `log` is what makes it one."""
LISTS = (".csv", ".txt", ".list")
"""How files end that may be manifests."""
METADATA = "metadata.yaml"
"""Of a folder that is one recording of ROS 2, which says itself what its parts are."""
_LIKE_LOG = ("logs", "path", "paths", "file", "files", "filename", "bag", "recording")
LARGEST_BYTES = 64 << 20
"""Of a manifest; a million paths are less."""
LONGEST_LINE = 1 << 16
"""Bytes of the first line of a table that are compared."""


@dataclass(frozen=True)
class Entry:
    """One log of a batch.

    Attributes
    ----------
    log
        Path as it was given; parts of one recording joined by ``+``.
    vessel
        Profile's name or path, None where nothing says.
    date
        When it was recorded, where a manifest says so; ISO 8601, UTC.
    note
        The manifest's.
    problem
        Why no vessel could be found for it; empty where one was, or the model brings it.
    """

    log: str
    vessel: str | None = None
    date: str | None = None
    note: str = ""
    problem: str = ""

    @property
    def paths(self) -> list[Path]:
        """Absolute paths of its parts; of what is not there, where it should be."""
        whole = Path(self.log)
        # One name that no file can have is an error; of parts the names together may be as long.
        there = exists(whole) if "+" in self.log else whole.exists()
        parts = [] if there else existing_parts(self.log)
        return [resolved(part) for part in parts or [whole]]

    @property
    def files(self) -> tuple[LogFile, ...]:
        """Its files; none for a log that is not there."""
        found = []
        for path in self.paths:
            for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
                try:
                    state = file.stat()
                except OSError:  # whoever reads the log says what is wrong with it
                    continue
                if not file.is_dir():
                    found.append(LogFile(str(file), state.st_size, state.st_mtime_ns))
        return tuple(found)


def entries_of(asked: Sequence[str], vessel: str | None, tell: Callable[[str], None]) -> list[Entry]:
    """Return the logs that are asked for, each once, in the order of the question, those of a pattern by their paths.

    Parameters
    ----------
    asked
        Paths, patterns (``season/**/*.mcap``), and manifests.
    vessel
        Of logs whose manifest names none.
    tell
        Called with what of a manifest is not used.

    Raises
    ------
    FerryIdError
        Where something matches nothing, or a manifest cannot be used.
    """
    found: dict[tuple[str, str | None], Entry] = {}
    for one in asked:
        for entry in _entries(one, vessel, tell):
            try:
                paths = "+".join(map(str, entry.paths))
            except (OSError, ValueError) as error:
                raise FerryIdError(
                    f"{one}: names what cannot be a file ({error.__class__.__name__}), found {entry.log[:80]!r}. "
                    "Fix: correct the path"
                ) from error
            found.setdefault((paths, entry.vessel), entry)
    if not found:
        raise FerryIdError(f"{', '.join(asked)}: names no log. Fix: write one a line below the header")
    return list(found.values())


def _entries(one: str, vessel: str | None, tell: Callable[[str], None]) -> Iterator[Entry]:
    if not one.strip():
        raise FerryIdError(
            "LOG: the path or pattern is empty, logs were to be read. Fix: name a file, a folder or a pattern"
        )
    path = Path(one)
    if path.is_file() and path.suffix.lower() in LISTS and path.stat().st_size <= LARGEST_BYTES:
        text = _text(path)
        if text is not None and "log" in _header(text):
            yield from _table(path, text, vessel, tell)
            return
        lines = _lines(text or "")
        if text is not None:
            _refuse_without_log(path, lines)
        # A log in text form holds numbers, not the names of files.
        if any(_exists(Path(line)) or _matches(line) for line in (_placed(path, line) for line in lines[:20])):
            for line in lines:
                yield from (Entry(log, vessel) for log in _logs(_placed(path, line)) or [_placed(path, line)])
            return
    logs = _logs(one)
    if not logs:
        raise FerryIdError(
            f"{one}: nothing is there that this matches. Fix: check the path; put a pattern in quotes, such as "
            '"season/**/*.mcap"'
        )
    _tell_of_parts(path, tell)
    yield from (Entry(log, vessel) for log in logs)


def _tell_of_parts(path: Path, tell: Callable[[str], None]) -> None:
    """Tell that the recordings or tables in a folder are of one log, as everywhere, and how each is a log of its own."""
    if not _exists(path) or not path.is_dir() or (path / METADATA).is_file():
        return
    parts = sum(file.name.endswith(log_suffixes(parts=True)) for file in path.iterdir())
    if parts > 1:
        tell(
            f"{path}: its {parts} recordings are taken as parts of one log; if each is a log of its own, name them: "
            f'"{path}/*"'
        )
    tables = sorted(path.glob("*.csv"))
    if len(tables) > 1 and len({_first_line(table) for table in tables}) == 1:
        tell(
            f"{path}: its {len(tables)} tables of the same columns are taken as topics of one log; if each is a log of its "
            f'own, name them: "{path}/*.csv"'
        )


def _first_line(path: Path) -> bytes:
    """Return the line of a table that names its columns, no more than the beginning of it."""
    try:
        with path.open("rb") as file:
            return file.readline(LONGEST_LINE)
    except OSError:  # whoever reads the log says what is wrong with it
        return b""


def _logs(one: str) -> list[str]:
    if _exists(Path(one)) or _parts(one):
        return [one]
    return _matches(one)


def _exists(path: Path) -> bool:
    """True for what is there; a line of a table may be no path at all."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _parts(one: str) -> list[Path]:
    try:
        return existing_parts(one)
    except (OSError, ValueError):
        return []


def _matches(pattern: str) -> list[str]:
    return sorted(glob.glob(pattern, recursive=True)) if glob.has_magic(pattern) else []


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        return None


def _lines(text: str) -> list[str]:
    return [line for line in map(str.strip, text.splitlines()) if line and not line.startswith("#")]


def _header(text: str) -> list[str]:
    first = next(iter(_lines(text)), "")
    return _cells(first, _separator(first))


def _separator(header: str) -> str:
    """Return what separates the cells of a table with this header: a semicolon where spreadsheets write decimal commas."""
    return ";" if ";" in header and "," not in header else ","


def _cells(line: str, separator: str = ",") -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:  # a cell of more than 128 KiB
        return []


def _refuse_without_log(path: Path, lines: Sequence[str]) -> None:
    """Refuse a manifest whose header lacks the column `log`: one with other columns of manifests, or that names files.

    Raises
    ------
    FerryIdError
        With the columns found.
    """
    separator = _separator(lines[0]) if lines else ","
    header = _cells(lines[0], separator) if lines else []
    if (len(header) < 2 and ",".join(header).lower() not in _LIKE_LOG) or any(
        _placed_log(path, cell) for cell in header
    ):
        return
    rows = [_cells(line, separator) for line in lines[1:20]]
    names_logs = any(_placed_log(path, cell) for row in rows for cell in row)
    of_manifest = set(COLUMNS) & set(header) and not any(_is_number(cell) for row in rows for cell in row[1:])
    if rows and (names_logs or of_manifest):
        near = next((name for name in header if name.lower() in _LIKE_LOG or did_you_mean(name, ("log",))), "")
        raise FerryIdError(
            f'{path}: a manifest needs the column "log" with the path of each log, found the columns '
            f"{', '.join(header[:12])}. Fix: "
            + (f'rename the column "{near}" to log' if near else "add the column log, or rename the one with the paths")
        )


def _placed_log(manifest: Path, cell: str) -> bool:
    """True for a cell that names a file or folder that is there."""
    return bool(cell) and not _is_number(cell) and _exists(Path(_placed(manifest, cell)))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _placed(manifest: Path, log: str) -> str:
    """Return a log's path as seen from here: one that is relative begins at the manifest."""
    whole = manifest.parent / log
    if _exists(whole) or "+" not in log:
        return str(whole)
    return "+".join(str(manifest.parent / part) for part in log.split("+"))


def _table(path: Path, text: str, vessel: str | None, tell: Callable[[str], None]) -> Iterator[Entry]:
    header = _header(text)
    for name in header:
        if name not in COLUMNS and (near := did_you_mean(name, COLUMNS)):
            raise FerryIdError(f'{path}: no manifest has a column "{name}".{near} Fix: rename the column')
    unused = [name for name in header if name not in COLUMNS]
    if unused:
        tell(f"{path}: columns that are not used: {', '.join(unused)}")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    rows = csv.reader(lines, delimiter=_separator(lines[0]))
    for number, cells in enumerate(_parsed(path, rows), 1):
        if number == 1:
            continue
        if len(cells) > len(header):
            raise FerryIdError(
                f"{path}: row {number} has {counted(len(cells), 'cell')}, the header {len(header)}. "
                "Fix: put a path or note with a comma in quotes"
            )
        row = {name: cell.strip() for name, cell in zip(header, cells, strict=False)}
        if row["log"]:
            placed, date = _placed(path, row["log"]), _date(path, number, row.get("date", ""))
            for log in _logs(placed) or [placed]:
                yield Entry(log, row.get("vessel") or vessel, date, row.get("note", ""))


def _parsed(path: Path, rows: Iterator[list[str]]) -> Iterator[list[str]]:
    try:
        yield from rows
    except csv.Error as error:
        raise FerryIdError(f"{path}: the manifest cannot be read, {error}. Fix: correct its quotes") from error


def _date(path: Path, number: int, text: str) -> str | None:
    if not text:
        return None
    try:
        date = datetime.fromisoformat(text)
        return (date.replace(tzinfo=UTC) if date.tzinfo is None else date.astimezone(UTC)).isoformat()
    except (ValueError, OverflowError) as error:
        raise FerryIdError(
            f"{path}: the date of row {number} cannot be read, found {text!r}. Fix: write 2024-05-17 or 2024-05-17T10:30"
        ) from error
