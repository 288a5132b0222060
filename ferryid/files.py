"""Writing results so that nothing is ever half-written."""

from __future__ import annotations

import errno
import json
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError

try:
    import fcntl
except ImportError:  # Windows: two fits at once into one folder may then take the same number
    fcntl = None  # type: ignore[assignment]


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path` and rename it over `path` when the block ends without an error.

    The block may create a file or a folder under the temporary name. An interrupt or an error removes it.

    Raises
    ------
    FerryIdError
        When the place cannot be written or the disk is full.
    """
    temporary = path.parent / f".{path.name}.{uuid.uuid4().hex}.part"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        if temporary.is_dir() and path.is_dir():
            _replace_folder(temporary, path)
        else:
            os.replace(temporary, path)
    except OSError as error:
        raise unwritable(path, error) from error
    finally:
        _remove(temporary)


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
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    elif path.exists():
        path.unlink()


def unwritable(path: Path, error: OSError) -> FerryIdError:
    """Return the error that says why `path` cannot be written and what helps."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return FerryIdError(f"{path}: the disk is full. Fix: free some space, or choose another folder with --out")
    reason = error.strerror or type(error).__name__
    return FerryIdError(f"{path}: cannot be written, {reason}. Fix: choose a folder you may write to with --out")


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step: it is there whole, or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_result(path: Path, text: str) -> None:
    """Write a JSON result where a user asked for it, but never over something that is no such result.

    Raises
    ------
    FerryIdError
        When the place holds anything but an earlier JSON file, or cannot be written.
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
    if not special:
        write_text(path.resolve() if path.is_symlink() else path, text)
        return
    try:
        with path.open("w", encoding="utf-8") as device:
            device.write(text)
    except OSError as error:
        raise unwritable(path, error) from error


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keep other processes out of a folder's numbering while the block runs, where the system has file locks."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise unwritable(folder, error) from error
    with lock:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def dump_json(data: Any) -> str:
    """Return JSON text, one form for the same data everywhere; NaN and infinities become null."""
    return json.dumps(finite(data), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


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
