"""How long work will still take, from how long that took which is done."""

from __future__ import annotations

from collections.abc import Sequence


class Remaining:
    """Time left for items of unequal size: half of an item's work is taken to be its bytes, half the same for all.

    Parameters
    ----------
    sizes_bytes
        Of all items that are to be done, in their order.
    """

    def __init__(self, sizes_bytes: Sequence[int]) -> None:
        total = sum(sizes_bytes)
        self._work = [0.5 / len(sizes_bytes) + (0.5 * size / total if total else 0.0) for size in sizes_bytes]
        self._whole = sum(self._work)
        self._done = 0.0

    def seconds(self, number: int, elapsed_s: float) -> float:
        """Return the time left [s] when an item is done, `elapsed_s` after the first was begun."""
        self._done += self._work[number]
        return elapsed_s * max(self._whole - self._done, 0.0) / self._done


def told_time(seconds: float) -> str:
    """Return a time left in words."""
    minutes = seconds / 60.0
    return (
        f"{seconds:.0f} s" if minutes < 2.0 else f"{minutes:.0f} min" if minutes < 120.0 else f"{minutes / 60.0:.1f} h"
    )
