"""Logs that are not on this machine (``https://``, ``s3://`` ...): copied once into a folder of the user's cache.

A fit hashes every byte of its logs, so that reading them in place would save nothing. A copy is used again as long as size and
tag (or time of change) at its source are the same; the folder may be deleted at any time.
"""

from __future__ import annotations

import glob
import hashlib
import json
import os
import re
import sys
from pathlib import Path, PurePosixPath
from typing import Any

from ferryid.counts import counted
from ferryid.errors import FerryIdError, one_line
from ferryid.files import make_folder, replacing

_URL = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)
_PARTS = re.compile(r"\+(?=[a-z][a-z0-9.-]+://)", re.IGNORECASE)
_BLOCK_BYTES = 4 << 20
_TAGS = ("ETag", "etag", "Last-Modified", "LastModified", "mtime", "md5Hash", "generation")
"""What file systems state of a version of a file."""
_BY_ARROW = ("s3", "gs")
"""Stores that pyarrow reads itself."""


class _UnreadableError(Exception):
    """The source failed, not the folder of the copies."""


def is_remote(log: str) -> bool:
    """Tell whether a log is named by a URL."""
    return _URL.match(log) is not None


def copies_folder() -> Path:
    """Return the folder of the copies: ``ferryid/remote`` in the user's folder for caches."""
    base = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME", "")
    return (Path(base) if base else Path("~/.cache").expanduser()) / "ferryid" / "remote"


def local_logs(log: str) -> list[str]:
    """Return a log as paths on this machine: itself, or where its copies are; several for a pattern.

    Parameters
    ----------
    log
        Path, URL, parts of one recording joined by ``+``, or a URL with a pattern (``s3://bucket/season/*.mcap``).

    Raises
    ------
    FerryIdError
        For a URL that cannot be read, and where fsspec or the file system of its kind is not installed.
    """
    if not is_remote(log):
        return [log]
    parts = _PARTS.split(log)
    if len(parts) > 1:
        return ["+".join(path for part in parts for path in local_logs(part))]
    try:
        return _copied(log)
    except FerryIdError:
        raise
    except ImportError as error:
        raise FerryIdError(
            f"{log}: reading this needs a package that is not installed ({_reason(error)}). "
            "Fix: pip install 'ferryid[remote]', or download the log"
        ) from error
    except FileNotFoundError as error:
        cause = error.__cause__
        if cause is None or isinstance(cause, FileNotFoundError) or getattr(cause, "status", None) == 404:
            raise FerryIdError(f"{log}: nothing is there, a log was to be read. Fix: check the URL") from error
        # So fsspec reports a server that does not answer, too.
        raise _not_copied(log, cause) from error
    except Exception as error:
        raise _not_copied(log, error) from error


def _not_copied(log: str, error: BaseException) -> FerryIdError:
    return FerryIdError(
        f"{log}: the log cannot be copied from there ({_reason(error)}). Fix: check the URL, the connection and your access"
    )


def _copied(url: str) -> list[str]:
    system, place = _opened(url)
    if glob.has_magic(place.partition("?")[0]):
        found = sorted(str(one) for one in system.glob(place))
        if not found:
            raise FerryIdError(f"{url}: nothing is there that this matches. Fix: check the pattern")
        return [_copy(url, system, one) for one in found]
    return [_copy(url, system, place)]


def _opened(url: str) -> tuple[Any, str]:
    """Return the file system of a URL, and its path there."""
    import fsspec

    scheme = url.partition("://")[0].lower()
    if scheme in _BY_ARROW:
        from fsspec.implementations.arrow import ArrowFSWrapper
        from pyarrow.fs import FileSystem

        # Options behind a ? are pyarrow's: region, endpoint_override, scheme.
        system, place = FileSystem.from_uri(url)
        return ArrowFSWrapper(system), place
    if scheme not in fsspec.available_protocols():
        raise FerryIdError(
            f"{url}: logs cannot be read from {scheme}://. Fix: use https:// or s3://, or download the log"
        )
    opened: tuple[Any, str] = fsspec.core.url_to_fs(url)
    return opened


def _copy(url: str, system: Any, place: str) -> str:
    """Return the copy of one file or folder, made anew where its source has changed."""
    if url.partition("?")[0].endswith("/") and url.lower().startswith("http"):
        raise FerryIdError(f"{url}: names no file. Fix: give the URL of a log")
    about = system.info(place)
    name = PurePosixPath(place.partition("?")[0]).name
    if not name:
        raise FerryIdError(f"{url}: names no file. Fix: give the URL of a log")
    # The same path of another store is another log.
    key = hashlib.sha256(f"{url.partition('://')[0]} {_store(url)} {place}".encode()).hexdigest()[:20]
    folder = copies_folder() / key
    copy, record = folder / name, folder / "source.json"
    if about.get("type") == "directory":
        return _copy_folder(url, system, place, copy)
    state = {"url": place, "size": about.get("size"), "tags": {key: str(about[key]) for key in _TAGS if about.get(key)}}
    if copy.is_file() and state["tags"] and _known(record) == state:
        return str(copy)
    make_folder(folder)
    with system.open(place, "rb") as source, replacing(copy) as new:
        _write(source, new)
    if state["size"] is not None and copy.stat().st_size != state["size"]:
        found = counted(copy.stat().st_size, "byte")
        copy.unlink()
        raise FerryIdError(f"{url}: the copy broke off, found {found} of {state['size']}. Fix: try again")
    with replacing(record) as new:
        new.write_text(json.dumps(state), encoding="utf-8")
    return str(copy)


def _copy_folder(url: str, system: Any, place: str, copy: Path) -> str:
    """Copy a folder that is one log, such as a ROS2 recording."""
    if url.lower().startswith("http"):
        raise FerryIdError(f"{url}: a folder, which cannot be listed here. Fix: give the URLs of its files joined by +")
    files = sorted(system.find(place))
    if not files:
        raise FerryIdError(f"{url}: the folder holds nothing, a log was to be read. Fix: check the URL")
    make_folder(copy.parent)
    with replacing(copy) as new:
        for file in files:
            target = new / PurePosixPath(file).relative_to(place)
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                source = system.open(file, "rb")
            except OSError as error:
                raise _UnreadableError(_reason(error)) from error
            with source:
                _write(source, target)
    return str(copy)


def _write(source: Any, target: Path) -> None:
    with target.open("wb") as file:
        while True:
            try:
                block = source.read(_BLOCK_BYTES)
            except OSError as error:
                raise _UnreadableError(_reason(error)) from error
            if not block:
                return
            file.write(block)


def _store(url: str) -> str:
    """What of a URL names the store: options behind a ``?`` of a bucket, and the host otherwise."""
    host = url.partition("://")[2].partition("/")[0]
    return host + (url.partition("?")[2] if url.partition("://")[0].lower() in _BY_ARROW else "")


def _known(record: Path) -> Any:
    try:
        return json.loads(record.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _reason(error: BaseException) -> str:
    return one_line(str(error) or type(error).__name__)[:200]
