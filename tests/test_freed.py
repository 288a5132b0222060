"""Freed memory goes back to the system."""

from __future__ import annotations

import platform
from pathlib import Path

import numpy as np
import pytest

from ferryid.freed import give_back


def resident() -> int:
    """Return the memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries keep less, and cannot be asked")
def test_what_was_freed_below_something_that_is_kept_is_given_back() -> None:
    arrays = [np.ones(10_000) for _ in range(1_000)]
    kept = arrays[-1]
    del arrays
    before = resident()
    give_back()
    assert before - resident() > 40_000_000
    assert kept.sum() == 10_000
