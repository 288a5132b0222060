"""Independent parts of a diagnosis side by side, on threads: compiled loops and NumPy's let go of the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import parent_process
from threading import local
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

_thread = local()
_alone = False


def over(function: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """Return what a function makes of every item, in their order, on as many threads as there are cores.

    On one thread within itself, and in a process that was started as one of several: the cores are busy there already.
    """
    every = list(items)
    if len(every) < 2 or _cores() < 2 or getattr(_thread, "inside", False):
        return [function(item) for item in every]

    def inside(item: T) -> R:
        _thread.inside = True
        return function(item)

    with ThreadPoolExecutor(min(_cores(), len(every))) as pool:
        return list(pool.map(inside, every))


def keep_to_one_thread() -> None:
    """Use one thread in this process from now on: others like it keep the other cores busy."""
    global _alone
    _alone = True


def _cores() -> int:
    if _alone or parent_process() is not None:
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
