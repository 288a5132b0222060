"""Reading logs: `open_log` finds the format of a recording and returns its Reader."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from pathlib import Path

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import existing_parts, exists
from ferryid.ingest import formats
from ferryid.ingest.log import Format, Reader, TableLayout
from ferryid.ingest.other_formats import unread_file, unread_text
from ferryid.ingest.printable_names import printable_names

__all__ = ["existing_parts", "log_suffixes", "open_log", "supported_formats"]

HEAD_BYTES = 64


@cache
def supported_formats() -> tuple[Format, ...]:
    """Return every format in `ferryid.ingest.formats`, in the order in which they are asked."""
    names = sorted(module.name for module in pkgutil.iter_modules(formats.__path__))
    modules = [importlib.import_module(f"{formats.__name__}.{name}") for name in names]
    found: list[Format] = [module.FORMAT for module in modules if hasattr(module, "FORMAT")]
    return tuple(sorted(found, key=lambda entry: entry.order))


def log_suffixes(*, parts: bool = False) -> tuple[str, ...]:
    """Return how the names of logs end, in every format; with `parts`, of those whose files are parts of a recording."""
    return tuple(suffix for entry in supported_formats() if entry.parts or not parts for suffix in entry.suffixes)


def open_log(path: str | Path, layout: TableLayout | None = None) -> Reader:
    """Open a recording of any supported format without decoding a message.

    Parameters
    ----------
    path
        A file, a folder, or the parts of one recording joined by ``+`` (``"a_0.bag+a_1.bag"``). A folder that no
        format takes as a whole is one recording made of the bags in it.
    layout
        How to read a table, for logs that are text, CSV or Parquet; other formats ignore it.

    Raises
    ------
    FerryIdError
        For a path that is missing, empty, unreadable or of no supported format.
    """
    if not str(path).strip():
        raise FerryIdError("LOG: the path is empty, a log was to be read. Fix: name a file or a folder")
    return printable_names(_open(path, layout))


def _open(path: str | Path, layout: TableLayout | None) -> Reader:
    whole = Path(path)
    try:
        found = exists(whole)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FerryIdError(
            f"{str(path)[:80]!r}: this cannot be a path ({reason}), a log was to be read. Fix: check the path"
        ) from error
    if not found and "+" in str(path):
        return _open_parts(str(path), existing_parts(str(path)), layout)
    if not found:
        raise FerryIdError(f"{path}: no such file or folder, a log was to be read. Fix: check the path")
    if whole.is_dir():
        return _open_folder(whole, layout)
    if not whole.is_file():
        raise FerryIdError(f"{path}: neither a file nor a folder but a pipe or a device. Fix: give a recorded file")
    return _open_file(whole, layout)


def _open_parts(text: str, parts: list[Path], layout: TableLayout | None) -> Reader:
    if not parts:
        missing = [
            piece if piece.strip() else "a name beside a +"
            for piece in text.split("+")
            if not piece.strip() or not exists(piece)
        ]
        raise FerryIdError(
            f"{text}: no such file, and as parts joined by + it lacks {', '.join(missing)}. "
            "Fix: check the path of every part"
        )
    from ferryid.ingest.join import join

    return join([open_log(part, layout) for part in parts])


def _open_folder(folder: Path, layout: TableLayout | None) -> Reader:
    for entry in supported_formats():
        if entry.matches(folder, b""):
            return _opened(entry, folder, layout)
    parts = sorted(file for file in folder.iterdir() if file.is_file() and file.name.endswith(log_suffixes(parts=True)))
    if not parts:
        inside = sorted(file.name for file in folder.iterdir())
        found = (
            f"{counted(len(inside), 'entry')} ({', '.join(inside[:3])}{', …' if len(inside) > 3 else ''})"
            if inside
            else "nothing"
        )
        raise FerryIdError(
            f"{folder}: the folder holds no log, found {found}. Fix: name the log itself; {_supported_sentence()}"
        )
    if len(parts) == 1:
        return _open_file(parts[0], layout)
    from ferryid.ingest.join import join

    return join([_open_file(part, layout) for part in parts])


def _open_file(path: Path, layout: TableLayout | None) -> Reader:
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise FerryIdError(
            f"{path}: the log cannot be read, {error.strerror or error}. Fix: check the file's permissions"
        ) from error
    if not head:
        raise FerryIdError(
            f"{path}: the file is empty, a log was expected, found 0 bytes. Fix: copy it from the recorder again"
        )
    for entry in supported_formats():
        if entry.matches(path, head):
            return _opened(entry, path, layout)
    other = unread_file(head) or unread_text(head.decode("latin-1").splitlines()[:1])
    if other is not None:
        raise FerryIdError(
            f"{path}: not a log of a supported format, found {other[0]}. Fix: {other[1]}; {_supported_sentence()}"
        )
    raise FerryIdError(
        f"{path}: not a log of a supported format, found a file that begins with {head[:12]!r}. "
        f"Fix: give a log; {_supported_sentence()}"
    )


def _opened(entry: Format, path: Path, layout: TableLayout | None) -> Reader:
    try:
        reader: Reader = entry.open(path, layout)
    except OSError as error:
        raise FerryIdError(
            f"{path}: the {entry.name} cannot be read, {error.strerror or error}. Fix: check its permissions"
        ) from error
    return reader


def _supported_sentence() -> str:
    return "supported are " + ", ".join(entry.name for entry in supported_formats())
