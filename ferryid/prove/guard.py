"""Shutting a process in: what it may read and write, kept by Python's audit hook and, where there is one, by the kernel.

The audit hook sees every file that Python opens, every folder that it lists, every process and socket. Compiled libraries
open files without asking Python, and C code can do as it likes; Linux's Landlock keeps these in as well, since 5.13. Neither
can be taken off again.

This is to show that a diagnosis did not read the answers, not to hold an attacker: under the audit hook alone, C code can
read them, and the names and sizes of files can be seen in either case.
"""

from __future__ import annotations

import ctypes
import os
import platform
import site
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ferryid.errors import FerryIdError

SYSTEM = (
    *("/lib", "/lib32", "/lib64", "/usr/lib", "/usr/lib32", "/usr/lib64", "/usr/local/lib", "/etc/ld.so.cache"),
    *("/usr/share/zoneinfo", "/etc/localtime", "/proc/self", "/proc/cpuinfo", "/sys/devices", "/dev/urandom"),
)
"""What libraries read as they load and start."""
SINK = "/dev/null"
FORBIDDEN = (
    *(
        "subprocess.",
        "socket.",
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "os.spawn",
        "os.fork",
        "pty.",
        "os.startfile",
    ),
    *("sqlite3.enable_load_extension", "sqlite3.load_extension"),
)
"""Audit events, by how they begin, that are refused whatever they ask for."""
READS = ("os.listdir", "os.scandir", "os.walk", "os.fwalk", "os.chdir", "glob.glob", "os.listxattr", "os.getxattr")
WRITES = (
    *("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod", "os.chown"),
    *("os.utime", "os.setxattr", "os.removexattr", "os.mkfifo", "os.mknod"),
)
"""Audit events whose arguments are paths."""

READ = 1 << 2 | 1 << 3
FILES_ONLY = 1 << 0 | 1 << 1 | 1 << 2 | 1 << 14 | 1 << 15
"""Landlock's rights by their bits: read files and folders; those that a rule on a single file can have."""
RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15, 5: 16}
"""How many rights on files a version of Landlock knows; later ones have no more than the last."""
EXECUTE, IOCTL = 1 << 0, 1 << 15


@dataclass(frozen=True)
class Rooms:
    """Folders and files that a process may use, with all below them.

    Attributes
    ----------
    reads
        To read.
    writes
        To read and write.
    """

    reads: tuple[str, ...]
    writes: tuple[str, ...]


def python_rooms(closed: Path) -> Rooms:
    """Return what Python, its packages and ferryid need: their files to read, numba's caches to write.

    Parameters
    ----------
    closed
        A folder with answers in it, which must not be open through any of these.

    Raises
    ------
    FerryIdError
        Where the folder lies within one of them.
    """
    package = Path(__file__).parents[1]
    prefixes = {sys.prefix, sys.base_prefix, sys.exec_prefix, sys.base_exec_prefix}
    if site.ENABLE_USER_SITE:
        prefixes.add(site.getusersitepackages())
    commands = package.parent / "cli"
    # Of the folder that holds ferryid only ferryid: in a checkout, results lie there, too.
    added = {
        path for path in sys.path if os.path.isdir(path) and os.path.realpath(path) != str(package.parent.resolve())
    }
    open_ones = {os.path.realpath(path) for path in (*prefixes, *SYSTEM, str(package), str(commands))}
    inside = os.path.realpath(closed)
    for path in sorted(open_ones):
        if _below(inside, path):
            raise FerryIdError(
                f"{closed}: lies in {path}, which the diagnosing process must be able to read. "
                "Fix: choose another folder with --out"
            )
    added = {real for real in map(os.path.realpath, added) if not _below(inside, real)}
    kept = os.environ.get("NUMBA_CACHE_DIR") or Path.home() / ".cache" / "numba"
    caches = [*package.rglob("__pycache__"), *([Path(kept)] if os.path.isdir(kept) else [])]
    caches = [path for path in caches if not _below(inside, os.path.realpath(path))]
    return Rooms(tuple(sorted(open_ones | added)), tuple(os.path.realpath(path) for path in caches))


def _below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)


class Hook:
    """The audit hook; `rooms` may be exchanged from one request to the next by its owner alone.

    Parameters
    ----------
    always
        What is open all the time.
    """

    def __init__(self, always: Rooms) -> None:
        self._always = always
        self._now = Rooms((), ())
        sys.addaudithook(self._event)

    def now(self, rooms: Rooms) -> None:
        """Open further rooms, and close those that were opened in this way before."""
        self._now = Rooms(*(tuple(map(os.path.realpath, paths)) for paths in (rooms.reads, rooms.writes)))

    def _event(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, flags = arguments[0], arguments[2]
            writing = bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND))
            self._ask(event, path, writing)
        elif event in READS:
            self._ask(event, "." if arguments[0] is None else arguments[0], False)
        elif event in WRITES:
            paths = arguments[:2] if event in ("os.rename", "os.link", "os.symlink") else arguments[:1]
            for path in paths:
                self._ask(event, path, True)
        elif event == "sqlite3.connect":
            self._ask(event, _database(arguments[0]), False)
        elif event.startswith(FORBIDDEN):
            raise PermissionError(13, f"a process that diagnoses blind may not do this: {event}")

    def _ask(self, event: str, path: Any, writing: bool) -> None:
        # A number is a file that is open already, and was asked for then.
        if isinstance(path, int):
            return
        real = os.path.realpath(os.fsdecode(path))
        rooms = self._always.writes + self._now.writes
        if not writing:
            rooms += self._always.reads + self._now.reads
        if real != SINK and not any(_below(real, room) for room in rooms):
            raise PermissionError(13, f"a process that diagnoses blind may not do this: {event}", os.fsdecode(path))


def _database(name: Any) -> str:
    """Return the file of a database that SQLite is given by its path or as ``file:`` with options."""
    path = os.fsdecode(name)
    return unquote(path.removeprefix("file:").partition("?")[0]) if path.startswith("file:") else path


def landlock_version() -> int:
    """Return which version of Landlock the kernel has, 0 for none."""
    if sys.platform != "linux" or platform.machine() == "alpha":
        return 0
    return max(0, _kernel(444, None, 0, 1))


def landlock(rooms: Rooms) -> bool:
    """Shut this thread and all that it starts into rooms for good; return False where the kernel has no Landlock.

    To be called before there are other threads: these would stay outside.
    """
    version = landlock_version()
    if version == 0:
        return False
    handled = (1 << RIGHTS.get(version, RIGHTS[5])) - 1
    # From versions 4 and 6 on also TCP, and the sockets and signals of processes outside.
    numbers = [handled, *([3] if version >= 4 else []), *([3] if version >= 6 else [])]
    attributes = (ctypes.c_uint64 * len(numbers))(*numbers)
    rules = _kernel(444, ctypes.byref(attributes), ctypes.sizeof(attributes), 0)
    if rules < 0:
        return False
    try:
        _admit(rules, rooms.reads, READ)
        _admit(rules, (*rooms.writes, SINK), handled & ~EXECUTE & ~IOCTL)
        # 38: no new privileges by any program that is started, which the kernel wants first.
        prctl, words = _libc().prctl, [ctypes.c_ulong(number) for number in (1, 0, 0, 0)]
        held = prctl(38, *words) == 0 and _kernel(446, rules, 0) == 0
    finally:
        os.close(rules)
    return held


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = (("allowed_access", ctypes.c_uint64), ("parent_fd", ctypes.c_int32))


def _admit(rules: int, paths: Iterable[str], rights: int) -> None:
    for path in paths:
        try:
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
        except OSError:  # what is not there needs no rule
            continue
        try:
            allowed = rights if os.path.isdir(path) else rights & FILES_ONLY
            rule = _PathBeneath(allowed, place)
            if _kernel(445, rules, 1, ctypes.byref(rule), 0) < 0:
                raise OSError(ctypes.get_errno(), "the kernel took no rule of Landlock", path)
        finally:
            os.close(place)


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _kernel(number: int, *arguments: Any) -> int:
    call: Callable[..., int] = _libc().syscall
    return int(call(ctypes.c_long(number), *(ctypes.c_long(a) if isinstance(a, int) else a for a in arguments)))
