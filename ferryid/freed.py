"""What was freed, given back to the system: between stages of which each needs much, and keeps little."""

from __future__ import annotations

import ctypes
from contextlib import suppress


def give_back() -> None:
    """Give freed memory back where the C library can: glibc keeps it in the arenas of threads, where others do not find it."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
