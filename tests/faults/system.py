"""What a process asks of its file system below one folder: counted, recorded, and made to fail at one operation."""

from __future__ import annotations

import builtins
import errno
import io
import os
import shutil
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
REMOVALS = ("unlink", "rmdir")
ERRORS = {"ENOSPC": errno.ENOSPC, "EIO": errno.EIO}


@dataclass
class Operation:
    """One operation: its kind, its paths below the folder, and for a write the file's content after it."""

    kind: str
    path: str
    target: str = ""
    content: bytes = b""


@dataclass
class System:
    """The layer between a process and its file system; `install` works on the process for good, so fork before.

    Parameters
    ----------
    root
        Absolute path of the folder that is watched.
    fault
        ``ENOSPC`` or ``EIO``, raised by one operation, ``KILL``, before it, or None. Of a write, half is done then.
    at
        Number of the operation, from 0; removals are none of those that can raise.
    """

    root: str
    fault: str | None = None
    at: int = -1
    operations: list[Operation] = field(default_factory=list)
    _lock: Any = field(default_factory=threading.RLock)

    def install(self) -> None:
        """Replace the functions of this process that write."""
        shutil._use_fd_functions = False  # type: ignore[attr-defined]
        for name in ("rename", "replace", "link"):
            setattr(os, name, self._two("rename" if name != "link" else name, getattr(os, name)))
        for name in ("mkdir", "unlink", "rmdir"):
            setattr(os, name, self._one(name, getattr(os, name)))
        os.remove = os.unlink
        self._open, self._fsync = os.open, os.fsync
        os.open, os.fsync = self._os_open, self._os_fsync  # type: ignore[assignment]
        self._io_open = io.open
        builtins.open = io.open = self._opened  # type: ignore[assignment]

    def _below(self, path: Any) -> str | None:
        if isinstance(path, int):
            return None
        text = os.path.abspath(os.fsdecode(path))
        return os.path.relpath(text, self.root) if text == self.root or text.startswith(self.root + os.sep) else None

    def _happens(self, kind: str, path: str, target: str = "", half: Callable[[], object] | None = None) -> Operation:
        """Note an operation that is about to happen, or let it fail."""
        with self._lock:
            number = sum(one.kind not in REMOVALS for one in self.operations) if self.fault in ERRORS else None
            number = len(self.operations) if number is None else number
            one = Operation(kind, path, target)
            if number == self.at and self.fault and not (self.fault in ERRORS and kind in REMOVALS):
                self.at = -1
                if half is not None:
                    half()
                if self.fault == "KILL":
                    os.kill(os.getpid(), signal.SIGKILL)
                raise OSError(ERRORS[self.fault], os.strerror(ERRORS[self.fault]), os.path.join(self.root, path))
            self.operations.append(one)
            return one

    def _one(self, kind: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(path: Any, *rest: Any, **options: Any) -> Any:
            below = self._below(path)
            with self._lock:
                if below is not None and os.path.lexists(path) == (kind != "mkdir"):
                    self._happens(kind, below)
                return real(path, *rest, **options)

        return call

    def _two(self, kind: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(source: Any, target: Any, *rest: Any, **options: Any) -> Any:
            below = self._below(source)
            with self._lock:
                if below is not None:
                    # Recorded where it succeeds alone.
                    one = self._happens(kind, below, self._below(target) or "")
                    try:
                        return real(source, target, *rest, **options)
                    except OSError:
                        self.operations.remove(one)
                        raise
                return real(source, target, *rest, **options)

        return call

    def _os_open(self, path: Any, flags: int, *rest: Any, **options: Any) -> int:
        below = self._below(path) if flags & WRITING else None
        with self._lock:
            if below is not None and not os.path.exists(path):
                self._happens("create", below)
            return self._open(path, flags, *rest, **options)

    def _os_fsync(self, number: int) -> None:
        below = self._below(os.readlink(f"/proc/self/fd/{number}"))
        if below is not None:
            self._happens("fsync", below)
        self._fsync(number)

    def _opened(self, file: Any, mode: str = "r", buffering: int = -1, *rest: Any, **options: Any) -> Any:
        below = self._below(file) if set(mode) & set("wxa+") else None
        if below is None:
            return self._io_open(file, mode, buffering, *rest, **options)
        self._happens("create", below)
        raw = _Raw(self, below, os.path.join(self.root, below), mode.replace("t", "").replace("b", ""))
        buffered = io.BufferedWriter(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, *rest, **options)

    def wrote(self, one: Operation) -> None:
        with self._io_open(os.path.join(self.root, one.path), "rb") as file:
            one.content = file.read()


class _Raw(io.FileIO):
    """A file that is written through the layer."""

    def __init__(self, system: System, below: str, path: str, mode: str) -> None:
        super().__init__(path, mode)
        self._system, self._below = system, below

    def write(self, data: Any) -> int:  # type: ignore[override]
        write = super().write
        one = self._system._happens("write", self._below, half=lambda: write(bytes(data)[: len(data) // 2]))
        count = write(data)
        self._system.wrote(one)
        return count or 0
