"""Memory of a process: a bound that the kernel keeps, and the peak of one log."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ferryid.errors import FerryIdError

UNITS = {"M": 1 << 20, "G": 1 << 30}
LEAST_BYTES = 512 << 20
"""Python, its libraries and what is drawn take 0.25 GB of it."""


def size_bytes(text: str) -> int:
    """Return a size like ``4G`` or ``1500M`` in bytes.

    Raises
    ------
    FerryIdError
        For what is no size, or less than ferryid itself takes.
    """
    match = re.fullmatch(r"(\d{1,6}(?:\.\d{1,3})?)([MG])i?B?", text.strip(), re.IGNORECASE)
    if match is None:
        raise FerryIdError(f"--memory: {text!r} is no size. Fix: give one like 4G or 1500M")
    size = int(float(match[1]) * UNITS[match[2].upper()])
    if size < LEAST_BYTES:
        raise FerryIdError(f"--memory: {text} is less than ferryid needs for itself. Fix: give 512M or more")
    return size


def told_bytes(size: float) -> str:
    """Return a size in words."""
    return f"{size / UNITS['G']:.1f} GB"


def can_be_bounded() -> bool:
    """Tell whether this system holds a process to a bound: only Linux counts what libraries map, since 4.7."""
    return sys.platform == "linux"


@contextmanager
def bounded(limit_bytes: int) -> Iterator[None]:
    """Let this process have no more than so much memory of its own while the block runs; asking for more is a MemoryError.

    A library that takes no refusal may end the process instead.
    """
    if not can_be_bounded():
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    hard = before[1]
    least = limit_bytes if hard == resource.RLIM_INFINITY else min(limit_bytes, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (least, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def count_what_is_used() -> None:
    """Have Arrow take its memory where all else does: its own allocator reserves 1 GiB that it does not use.

    To be called before Arrow is loaded.
    """
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")


def forget_peak() -> None:
    """Let `peak_bytes` count from now on, where the system can."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_bytes() -> int:
    """Return the most memory that this process held since `forget_peak`, or since it started; 0 where nobody tells."""
    with suppress(OSError, ValueError, IndexError):
        status = Path("/proc/self/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) << 10
    with suppress(ImportError):
        import resource

        # Bytes on macOS, kilobytes elsewhere.
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << (0 if sys.platform == "darwin" else 10)
    return 0
