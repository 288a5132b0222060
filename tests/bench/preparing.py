"""How long a run of the benchmarks makes what it measures on: the page says so."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

_spent = [0.0]


@contextmanager
def preparing() -> Iterator[None]:
    """Count the time of a block, which makes logs or archives, as preparation."""
    start = time.perf_counter()
    try:
        yield
    finally:
        _spent[0] += time.perf_counter() - start


def spent_s() -> float:
    """Return how long this process has prepared so far [s]."""
    return _spent[0]
