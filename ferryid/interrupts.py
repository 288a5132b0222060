"""A process that is asked to end does so within two seconds, whatever it is at.

Python delivers a signal between two of its own instructions, so that a compiled loop, a pool of threads or a connection that
is being closed can hold it up for minutes. A thread of its own receives the signal at once: when the way out through
exceptions takes too long, it removes temporary files, ends child processes and ends this process.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

GRACE_S = 1.2
"""How long a process may take to end through exceptions [s]."""
CHILDREN_S = 0.3
"""How long child processes may take to remove their temporary files [s]."""
MESSAGE = "ferryid: interrupted, nothing half-written was left\n"
_OURS = (signal.SIGINT, signal.SIGTERM)


class Terminated(BaseException):
    """The process is asked to end; what is half done is cleaned up on the way out, as after an interrupt."""


_received = 0
_ending = threading.Lock()
"""Held by the first thread that ends this process."""


def received() -> int:
    """Return the number of the signal that asked this process to end, 0 where none did."""
    return _received


def _raise(number: int, frame: FrameType | None) -> None:
    global _received
    if _received:
        return  # on its way out already
    _received = number
    # An exception in a destructor or a callback cannot be raised, and would be printed.
    sys.unraisablehook = lambda _: None
    raise KeyboardInterrupt if number == signal.SIGINT else Terminated


@contextmanager
def raised() -> Iterator[None]:
    """Raise `KeyboardInterrupt` or `Terminated` for the first signal while the block runs; an ignored SIGINT stays ignored."""
    global _received
    _received = 0
    before = {number: signal.getsignal(number) for number in _OURS}
    try:
        for number in _OURS:
            if number != signal.SIGINT or before[number] != signal.SIG_IGN:
                signal.signal(number, _raise)
        yield
    finally:
        if not _received:
            for number, handler in before.items():
                signal.signal(number, handler)


def by_default() -> None:
    """Leave signals to the system: an interpreter that is shutting down shows an exception as a traceback."""
    for number in _OURS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def end_in_time() -> None:
    """End this process within `GRACE_S` of a signal, from now on until its very end."""
    _watch(GRACE_S, MESSAGE)


def end_at_once() -> None:
    """End this process, one of several of a command, as soon as it is asked to; interrupts are for the first of them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.name != "nt":
        _watch(0.0, "")
        signal.signal(signal.SIGTERM, lambda number, frame: None)


def end(number: int, message: str = MESSAGE) -> None:
    """Remove temporary files, end child processes and this one, whatever its threads are doing."""
    # On a busy machine the way out through exceptions may come here just as the thread that watches does.
    _ending.acquire(timeout=GRACE_S)
    from ferryid.files import remove_unfinished

    children = _children()
    with suppress(Exception):
        _end(children)
    with suppress(Exception):
        remove_unfinished()
    with suppress(OSError):
        os.write(2, message.encode())
    os._exit(128 + number)


def _watch(grace_s: float, message: str) -> None:
    if os.name == "nt" or threading.current_thread() is not threading.main_thread():
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)

    def wait() -> None:
        while True:
            for number in os.read(reading, 64):
                if number in _OURS:
                    time.sleep(grace_s)
                    end(number, message)

    threading.Thread(target=wait, daemon=True, name="ferryid-interrupts").start()


def _children() -> list[int]:
    """Return the processes that this one started and that live."""
    found: list[int] = []
    for path in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):
            found += map(int, path.read_text().split())
    started: Any = sys.modules.get("multiprocessing.process")
    if started is not None:
        found += [child.pid for child in list(started._children) if child.pid not in found]
    return found


def _end(children: list[int]) -> None:
    for last in (False, True):
        for pid in children:
            with suppress(OSError):
                os.kill(pid, signal.SIGKILL if last else signal.SIGTERM)
        deadline = time.monotonic() + CHILDREN_S
        while not last and children and time.monotonic() < deadline:
            for pid in list(children):
                with suppress(OSError):
                    if os.waitpid(pid, os.WNOHANG)[0] == 0:
                        continue
                children.remove(pid)
            time.sleep(0.01)
