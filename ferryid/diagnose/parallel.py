"""Independent parts of a diagnosis side by side, on threads: compiled loops and NumPy's let go of the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from multiprocessing import parent_process
from threading import Thread, local
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

_thread = local()
_alone = False


def over(function: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """Return what a function makes of every item, in their order, on as many threads as there are cores, this one among them.

    On one thread within itself, and in a process that was started as one of several: the cores are busy there already. What the
    first of the items raises that fails is raised here.
    """
    every = list(items)
    threads = min(_cores(), len(every))
    if threads < 2 or getattr(_thread, "inside", False):
        return [function(item) for item in every]
    made: dict[int, R] = {}
    failed: dict[int, BaseException] = {}
    left = iter(range(len(every)))

    def work() -> None:
        _thread.inside = True
        try:
            # What is taken is done, so that all before one that fails are.
            while not failed and (k := next(left, None)) is not None:
                try:
                    made[k] = function(every[k])
                except BaseException as error:  # noqa: BLE001 - raised below, on the thread that asked
                    failed[k] = error
        finally:
            _thread.inside = False

    others = [Thread(target=work, daemon=True) for _ in range(threads - 1)]
    for thread in others:
        thread.start()
    work()
    for thread in others:
        thread.join()
    if failed:
        raise failed[min(failed)]
    return [made[k] for k in range(len(every))]


def keep_to_one_thread() -> None:
    """Use one thread in this process from now on: others like it keep the other cores busy."""
    global _alone
    _alone = True


def _cores() -> int:
    if _alone or parent_process() is not None:
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
