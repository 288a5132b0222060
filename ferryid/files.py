"""Writing results so that nothing is ever half-written, whatever ends the process or the power.

A result is written under a temporary name beside its place, synced to disk, renamed, and its folder synced. What a process
that was killed left under temporary names is removed by the next one that writes there: beside each lies a file that is
locked for as long as its process lives.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import stat
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, UnwritableError

try:
    import fcntl
except ImportError:  # Windows: two fits at once into one folder may then take the same number
    fcntl = None  # type: ignore[assignment]

ABANDONED_S = 3600.0
"""Age from which on a temporary file belongs to no process that is at work, where the file system has no locks [s]."""
_AT_ONCE = 8
"""Files that are synced at once: the threads wait for the disk alone."""
_NOT_SUPPORTED = (errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.ENOLCK, errno.EPERM)
_TEMPORARY = re.compile(r"\.(?P<name>.+)\.(?P<key>[0-9a-f]{32})\.(?P<part>part|part\.d|old|lock)", re.DOTALL)


class _Draft:
    """Temporary names beside the place of a result, and the lock that shows that their process lives.

    ``.NAME.KEY.part`` is the new result, ``.NAME.KEY.old`` a folder that it replaces, ``.NAME.KEY.lock`` the lock.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path = path
        self.new, self.holder, self.old, self.lock = (
            path.parent / f".{path.name}.{key}.{part}" for part in ("part", "part.d", "old", "lock")
        )

    def remove(self) -> None:
        """Remove what is there under the temporary names; a folder moved aside goes back where nothing took its place."""
        if self.old.exists() and not self.path.exists():
            with suppress(OSError):
                os.rename(self.old, self.path)
        for path in (self.new, self.holder, self.old, self.lock):
            with suppress(OSError):
                _remove(path)


_unfinished: dict[str, _Draft] = {}
"""Drafts of this process by their keys."""
_scratch: set[Path] = set()
_held: dict[Path, int] = {}
"""Locks of this process's temporary folders, open files by the folder."""
_SCRATCH = "ferryid-"
_SCRATCH_NAME = re.compile(r"(?P<name>ferryid-[0-9a-f]{32})(\.lock)?")
_swept: set[Path] = set()
"""Folders that this process has looked through for what others left."""


_UNPRINTABLE = "[\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]"
"""Control and formatting characters that JSON allows in a text."""


@contextmanager
def replacing(path: Path, *, new: bool = False, by: str = "--out") -> Iterator[Path]:
    """Give a temporary name beside `path` and rename it over `path` when the block ends without an error.

    The block may create a file or a folder under the temporary name. An interrupt or an error removes it. At the end the
    result is on disk, and a loss of power leaves it or what was there before.

    Parameters
    ----------
    path
        Where the result goes.
    new
        True replaces nothing, not even what another process has put there meanwhile.
    by
        The option that names another place.

    Raises
    ------
    FerryIdError
        When the place cannot be written or is taken, or the disk is full.
    """
    key = uuid.uuid4().hex
    draft = _Draft(path, key)
    lock: int | None = None
    try:
        make_folder(path.parent)
        remove_abandoned(path.parent)
        _unfinished[key] = draft
        lock = _locked(draft.lock)
        yield draft.new
        _sync_all(draft.new)
        if new:
            _put(draft.new, path)
        elif draft.new.is_dir() and path.is_dir():
            _replace_folder(draft, path)
        else:
            os.replace(draft.new, path)
        # First, so that the sync makes this last as well.
        draft.remove()
        sync(path.parent)
    except OSError as error:
        raise unwritable(path, error, by) from error
    finally:
        draft.remove()
        _unfinished.pop(key, None)
        if lock is not None:
            os.close(lock)


def _locked(path: Path) -> int:
    """Create a file and lock it; return its descriptor."""
    while True:
        number = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
        _lock(number, wait=True)
        # Another process may have taken it for abandoned before it was locked.
        if os.path.exists(path):
            return number
        os.close(number)


def _lock(number: int, *, wait: bool) -> bool | None:
    """Lock an open file: True where that is done, False where another process holds it, None without locks."""
    locked: bool | None = None
    if fcntl is not None:
        with suppress(OSError):  # a file system without locks
            try:
                fcntl.flock(number, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
                locked = True
            except BlockingIOError:
                locked = False
    return locked


def remove_abandoned(folder: Path) -> None:
    """Remove what processes that were killed left under temporary names in a folder, and nothing of one that lives.

    A process looks once; `replacing` does so, and whoever finds a result finished and has nothing to write.
    """
    if folder in _swept:
        return
    _swept.add(folder)
    try:
        found = [_TEMPORARY.fullmatch(name) for name in os.listdir(folder)]
    except OSError:
        return
    for name, key in {(one["name"], one["key"]) for one in found if one is not None}:
        if key in _unfinished:
            continue
        draft = _Draft(folder / name, key)
        with suppress(OSError):
            _remove_if_abandoned(draft)


def _remove_if_abandoned(draft: _Draft) -> None:
    try:
        lock = os.open(draft.lock, os.O_RDWR)
    except FileNotFoundError:  # removed before the rest by a process that was killed then
        draft.remove()
        return
    try:
        free = _lock(lock, wait=False)
        if free is None:
            free = time.time() - os.stat(draft.lock).st_mtime > ABANDONED_S
        if free:
            draft.remove()
    finally:
        os.close(lock)


def remove_unfinished() -> None:
    """Remove all temporary files of this process, which is about to end without returning from where it is."""
    for draft in list(_unfinished.values()):
        draft.remove()
    for folder in list(_scratch):
        remove_scratch(folder)


def scratch_folder() -> Path:
    """Make a folder for temporary files, which whoever asked for it removes.

    Beside it lies a lock, as beside a draft; what processes that were killed left in the same place is removed.
    """
    place = Path(tempfile.gettempdir())
    _remove_scratch(place)
    folder = place / f"{_SCRATCH}{uuid.uuid4().hex}"
    # Its lock first, and never given back while the process lives: whoever finds the folder finds it held.
    _held[folder] = _locked(_lock_of(folder))
    folder.mkdir(mode=0o700)
    _scratch.add(folder)
    return folder


def remove_scratch(folder: Path) -> None:
    """Remove what `scratch_folder` made."""
    shutil.rmtree(folder, ignore_errors=True)
    _scratch.discard(folder)
    lock = _held.pop(folder, None)
    if lock is not None:
        with suppress(OSError):
            _lock_of(folder).unlink(missing_ok=True)
        os.close(lock)


def _lock_of(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.lock")


def _remove_scratch(place: Path) -> None:
    """Remove the temporary folders of this user whose processes are gone; a process looks once."""
    if place / _SCRATCH in _swept:
        return
    _swept.add(place / _SCRATCH)
    with suppress(OSError):
        found = [_SCRATCH_NAME.fullmatch(name) for name in os.listdir(place)]
        for name in {one["name"] for one in found if one is not None}:
            folder = place / name
            if folder in _held:
                continue
            with suppress(OSError):
                _remove_scratch_if_abandoned(folder)


def _remove_scratch_if_abandoned(folder: Path) -> None:
    path = _lock_of(folder)
    if hasattr(os, "getuid") and os.lstat(path if path.exists() else folder).st_uid != os.getuid():
        return  # another user's, in a place that all share
    try:
        lock = os.open(path, os.O_RDWR)
    except FileNotFoundError:  # removed before the folder by a process that was killed then
        shutil.rmtree(folder, ignore_errors=True)
        return
    try:
        free = _lock(lock, wait=False)
        if free is None:
            free = time.time() - os.stat(path).st_mtime > ABANDONED_S
        if free:
            shutil.rmtree(folder, ignore_errors=True)
            path.unlink(missing_ok=True)
    finally:
        os.close(lock)


def make_folder(path: Path) -> None:
    """Make a folder and those above it that are missing, and sync each to disk."""
    missing = []
    while not path.is_dir():
        missing.append(path)
        if path == path.parent:
            break
        path = path.parent
    for one in reversed(missing):
        one.mkdir(exist_ok=True)
        sync(one.parent)


def sync(path: Path) -> None:
    """Wait until a file's content, or the names in a folder, are on disk, where the system can tell."""
    folder = path.is_dir()
    if os.name == "nt" and folder:  # Windows cannot, and need not
        return
    try:
        number = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    except PermissionError:
        if folder:  # it may be written but not read
            return
        raise
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in _NOT_SUPPORTED:
            raise
    finally:
        os.close(number)


def _sync_all(path: Path) -> None:
    """Sync a file, or a folder and all that is in it."""
    if not path.is_dir():
        sync(path)
        return
    walked = list(os.walk(path, topdown=False))
    every = [Path(folder, name) for folder, _, names in walked for name in names]
    files = [file for file in every if stat.S_ISREG(os.lstat(file).st_mode)]
    if len(files) > 1:
        # Loading it takes longer than writing many a single file.
        from concurrent.futures import ThreadPoolExecutor

        # A journal takes all that is asked for at once in one turn, and what is asked for one after the other in one turn each.
        with ThreadPoolExecutor(min(_AT_ONCE, len(files))) as pool:
            synced: Iterator[None]
            try:
                synced = pool.map(sync, files)
            except RuntimeError:  # no room for a thread
                synced = map(sync, files)
            for _ in synced:
                pass
    else:
        for file in files:
            sync(file)
    for folder, _, _ in walked:
        sync(Path(folder))


def _put(finished: Path, path: Path) -> None:
    """Rename to a place where nothing is; only one of several processes can."""
    try:
        if finished.is_dir():
            # A folder takes the place of an empty one alone.
            os.rename(finished, path)
            return
        try:
            os.link(finished, path)
        except OSError as error:
            if error.errno not in _NOT_SUPPORTED:
                raise
            # A file system without links: a process killed in between leaves an empty file.
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
            os.replace(finished, path)
    except OSError as error:
        if error.errno in (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR):
            raise taken(path) from error
        raise


def _replace_folder(draft: _Draft, path: Path) -> None:
    # A folder that holds something cannot be replaced in one step: the old one is moved aside first.
    os.rename(path, draft.old)
    try:
        os.rename(draft.new, path)
    except OSError as error:
        # Another process finished the same result meanwhile: one is as good as the other.
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
    # Before the old one is removed.
    sync(path.parent)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def unwritable(path: Path, error: OSError, by: str = "--out") -> UnwritableError:
    """Return the error that says why `path` cannot be written and what helps, `by` the option that names another place."""
    what = "folder" if by == "--out" else "place"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return UnwritableError(f"{path}: the disk is full. Fix: free some space, or choose another {what} with {by}")
    if error.errno in (errno.EEXIST, errno.ENOTDIR) and (file := _file_for_folder(path)):
        return no_folder(file, by)
    reason = error.strerror or type(error).__name__
    return UnwritableError(f"{path}: cannot be written, {reason}. Fix: choose a {what} you may write to with {by}")


def _file_for_folder(path: Path) -> Path | None:
    """Return what stands where `path` or a folder above it was to be and is no folder, None where nothing does."""
    there = next((place for place in (path, *path.parents) if os.path.lexists(place)), None)
    return None if there is None or there.is_dir() else there


def no_folder(path: Path, by: str = "--out") -> UnwritableError:
    """Return the error for a place where a folder was to be and something else is, `by` the option that names another."""
    what = "file" if path.is_file() else "link to nothing" if path.is_symlink() else "special file"
    return UnwritableError(
        f"{path}: is a {what}, and a folder was to be there, so that results cannot be written. "
        f"Fix: name another place with {by}"
    )


def check_folder(path: Path, by: str = "--out") -> None:
    """Refuse a place for results that is no folder, or lies below something that is none; nothing need be there yet.

    `by` is the option that names another place.

    Raises
    ------
    UnwritableError
        When a file or the like is there.
    """
    try:
        file = _file_for_folder(path)
    except OSError as error:
        raise unwritable(path, error, by) from error
    if file:
        raise no_folder(file, by)


def taken(path: Path) -> FerryIdError:
    """Return the error for a place where something is that must stay."""
    return FerryIdError(f"{path}: exists already. Fix: choose another name, or replace it with --overwrite")


def write_text(path: Path, text: str, *, by: str = "--out") -> None:
    """Write a text file in one step: it is there whole, or not at all; `by` as of `replacing`."""
    with replacing(path, by=by) as temporary:
        # A file's name may hold bytes that are no characters.
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def write_bytes(path: Path, content: bytes, *, by: str = "--out") -> None:
    """Write a file in one step: it is there whole, or not at all; `by` as of `replacing`."""
    with replacing(path, by=by) as temporary:
        temporary.write_bytes(content)


def resolved(path: str | Path) -> Path:
    """Return what a path leads to, absolute; of one that leads nowhere, or round in a circle, the place where it ends.

    `Path.resolve` raises a RuntimeError for links that lead round in a circle before Python 3.13.
    """
    return Path(os.path.realpath(path))


def exists(path: str | Path) -> bool:
    """Return whether a path leads to a file or folder; one that is too long for a name, as of many parts, leads nowhere."""
    try:
        return Path(path).exists()
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            return False
        raise


def parts_of(log: str) -> list[str]:
    """Return the paths of the parts of a log, which ``+`` joins; the log's own where there is a file or folder of that name."""
    return [log] if exists(log) else log.split("+")


def name_of_log(log: str) -> str:
    """Return the name of the file of a log; of parts that ``+`` joins that of the first, and how many more there are."""
    first, *more = parts_of(log)
    return f"{Path(first).name} and {len(more)} more" if more else Path(first).name


def existing_parts(text: str) -> list[Path]:
    """Split a joined path at those ``+`` that leave paths which all exist (a folder's name may hold one too)."""
    pieces = text.split("+")
    for count in range(1, len(pieces) + 1):
        joined = "+".join(pieces[:count])
        head = Path(joined)
        # An empty path would be the working folder.
        if not joined.strip() or not exists(head):
            continue
        if count == len(pieces):
            return [head]
        tail = existing_parts("+".join(pieces[count:]))
        if tail:
            return [head, *tail]
    return []


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
        raise unwritable(path, error, "--json") from error
    check_folder(path.parent, "--json")
    if resolved(path).is_symlink():
        raise UnwritableError(
            f"{path}: is a link that leads round in a circle, so that nothing can be written there. "
            "Fix: give --json another name"
        )
    if path.is_dir():
        raise UnwritableError(f"{path}: is a folder, and a file was to be written. Fix: give --json the name of a file")
    if other:
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
        write_text(resolved(path) if path.is_symlink() else path, text, by="--json")
        return
    try:
        with path.open("w", encoding="utf-8") as device:
            device.write(text)
    except OSError as error:
        raise unwritable(path, error, "--json") from error


@contextmanager
def alone(folder: Path, *, wait: bool = True) -> Iterator[None]:
    """Keep other processes out of a folder's numbering while the block runs, where the system has file locks.

    Raises
    ------
    FerryIdError
        When the folder cannot be written, or another process is in it and `wait` is False.
    """
    try:
        make_folder(folder)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise unwritable(folder, error) from error
    with lock:
        if _lock(lock.fileno(), wait=wait) is False:
            raise FerryIdError(
                f"{folder}: another process is at work in it. Fix: wait for it, or choose another folder with --out"
            )
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
