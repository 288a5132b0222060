"""Writing results so that nothing is ever half-written."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, UnwritableError

try:
    import fcntl
except ImportError:  # Windows: two fits at once into one folder may then take the same number
    fcntl = None  # type: ignore[assignment]


_UNPRINTABLE = "[\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]"
"""Control and formatting characters that JSON allows in a text."""


@contextmanager
def replacing(path: Path, *, new: bool = False) -> Iterator[Path]:
    """Give a temporary name beside `path` and rename it over `path` when the block ends without an error.

    The block may create a file or a folder under the temporary name. An interrupt or an error removes it.

    Parameters
    ----------
    path
        Where the result goes.
    new
        True replaces nothing, not even what another process has put there meanwhile.

    Raises
    ------
    FerryIdError
        When the place cannot be written or is taken, or the disk is full.
    """
    temporary = path.parent / f".{path.name}.{uuid.uuid4().hex}.part"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        if new:
            _put(temporary, path)
        elif temporary.is_dir() and path.is_dir():
            _replace_folder(temporary, path)
        else:
            os.replace(temporary, path)
    except OSError as error:
        raise unwritable(path, error) from error
    finally:
        _remove(temporary)


def _put(finished: Path, path: Path) -> None:
    """Rename to a place where nothing is; only one of several processes can."""
    try:
        if finished.is_dir():
            # A folder takes the place of an empty one alone.
            os.rename(finished, path)
        else:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
            os.replace(finished, path)
    except OSError as error:
        if error.errno in (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR):
            raise taken(path) from error
        raise


def _replace_folder(finished: Path, path: Path) -> None:
    # A folder that holds something cannot be replaced in one step: the old one is moved aside first.
    old = path.parent / f".{path.name}.{uuid.uuid4().hex}.part"
    os.rename(path, old)
    try:
        os.rename(finished, path)
    except OSError as error:
        # Another process finished the same result meanwhile: one is as good as the other.
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
    finally:
        _remove(old)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    elif os.path.lexists(path):
        path.unlink()


def unwritable(path: Path, error: OSError) -> UnwritableError:
    """Return the error that says why `path` cannot be written and what helps."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return UnwritableError(f"{path}: the disk is full. Fix: free some space, or choose another folder with --out")
    reason = error.strerror or type(error).__name__
    return UnwritableError(f"{path}: cannot be written, {reason}. Fix: choose a folder you may write to with --out")


def taken(path: Path) -> FerryIdError:
    """Return the error for a place where something is that must stay."""
    return FerryIdError(f"{path}: exists already. Fix: choose another name, or replace it with --overwrite")


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step: it is there whole, or not at all."""
    with replacing(path) as temporary:
        # A file's name may hold bytes that are no characters.
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def check_result(path: Path) -> bool:
    """Refuse a place for a JSON result that holds anything but an earlier one; tell whether it is a device.

    Raises
    ------
    FerryIdError
        When something else is there, or it cannot be seen.
    """
    try:
        special = path.exists() and not path.is_file()
        other = path.is_file() and path.suffix != ".json" and path.stat().st_size > 0
    except OSError as error:
        raise unwritable(path, error) from error
    if path.is_dir() or other:
        raise FerryIdError(
            f"{path}: is there already and no JSON file, so it is not written over. Fix: give --json another name"
        )
    return special


def write_result(path: Path, text: str) -> None:
    """Write a JSON result where a user asked for it, but never over something that is no such result.

    Raises
    ------
    FerryIdError
        When the place holds anything but an earlier JSON file, or cannot be written.
    """
    if not check_result(path):
        write_text(path.resolve() if path.is_symlink() else path, text)
        return
    try:
        with path.open("w", encoding="utf-8") as device:
            device.write(text)
    except OSError as error:
        raise unwritable(path, error) from error


@contextmanager
def alone(folder: Path, *, wait: bool = True) -> Iterator[None]:
    """Keep other processes out of a folder's numbering while the block runs, where the system has file locks.

    Raises
    ------
    FerryIdError
        When the folder cannot be written, or another process is in it and `wait` is False.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise unwritable(folder, error) from error
    with lock:
        if fcntl is not None:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise FerryIdError(
                    f"{folder}: another process is at work in it. Fix: wait for it, or choose another folder with --out"
                ) from error
        yield


def dump_json(data: Any) -> str:
    """Return JSON text, one form for the same data everywhere; NaN and infinities become null."""
    text = json.dumps(finite(data), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    # As JSON writes them down: bytes of a file's name that are no characters, and what would command a terminal.
    return re.sub(_UNPRINTABLE, lambda found: f"\\u{ord(found[0]):04x}", text)


def finite(data: Any) -> Any:
    """Return `data` in plain JSON types: arrays as lists, NaN and infinities as None, keys as strings."""
    if isinstance(data, dict):
        return {str(key): finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [finite(value) for value in data]
    if hasattr(data, "tolist"):
        return finite(data.tolist())
    if isinstance(data, float):
        return data if data - data == 0.0 else None
    return data
