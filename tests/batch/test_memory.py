"""Memory: what a bound keeps, and what a peak counts."""

from __future__ import annotations

import resource
import sys

import numpy as np
import pytest

from ferryid.batch import memory
from ferryid.errors import FerryIdError

MiB = 1 << 20


@pytest.mark.parametrize(
    ("text", "size"), [("4G", 4 << 30), ("1500M", 1500 * MiB), ("0.5g", 512 * MiB), ("2GB", 2 << 30), ("1GiB", 1 << 30)]
)
def test_sizes(text: str, size: int) -> None:
    assert memory.size_bytes(text) == size


@pytest.mark.parametrize("text", ["", "4", "much", "-4G", "nanG", "1e9G", "9999999G"])
def test_what_is_no_size(text: str) -> None:
    with pytest.raises(FerryIdError, match=r"--memory: .* is no size\. Fix: "):
        memory.size_bytes(text)
    with pytest.raises(FerryIdError, match=r"less than ferryid needs for itself\. Fix: give 512M"):
        memory.size_bytes("100M")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems hold no process to a bound")
def test_a_bound_holds_and_ends_with_its_block() -> None:
    before = resource.getrlimit(resource.RLIMIT_DATA)
    with open("/proc/self/status") as file:
        now = int(file.read().partition("VmData:")[2].split()[0]) << 10
    with memory.bounded(now + 200 * MiB):
        assert np.ones(50 * MiB, dtype=np.uint8).sum() == 50 * MiB
        with pytest.raises(MemoryError):
            np.ones(400 * MiB, dtype=np.uint8)
    assert resource.getrlimit(resource.RLIMIT_DATA) == before
    assert len(np.ones(400 * MiB, dtype=np.uint8)) == 400 * MiB


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not forget")
def test_a_peak_counts_from_when_it_was_forgotten() -> None:
    memory.forget_peak()
    start = memory.peak_bytes()
    np.ones(300 * MiB, dtype=np.uint8)
    assert memory.peak_bytes() > start + 250 * MiB
    memory.forget_peak()
    assert memory.peak_bytes() < start + 100 * MiB
