"""Writing results so that nothing is ever half-written."""

from __future__ import annotations

import errno
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path` and rename it over `path` when the block ends without an error.

    The block may create a file or a folder under the temporary name. An interrupt or an error removes it.

    Raises
    ------
    FerryIdError
        When the place cannot be written or the disk is full.
    """
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        os.close(handle)
        os.unlink(name)
        temporary = Path(name)
        yield temporary
        if temporary.is_dir() and path.is_dir():
            shutil.rmtree(path)
        os.replace(temporary, path)
    except OSError as error:
        raise unwritable(path, error) from error
    finally:
        if temporary is not None and temporary.exists():
            shutil.rmtree(temporary) if temporary.is_dir() else temporary.unlink()


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
