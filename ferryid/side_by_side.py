"""Independent parts of a task side by side, on threads: compiled loops, NumPy and Arrow let go of the interpreter's lock."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable
from functools import wraps
from threading import Event, Thread, local
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")

THREADS_OF_BLAS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""Environment variables by which a user says how many threads matrix products take."""

_thread = local()
_alone = False


def over(function: Callable[[T], R], items: Iterable[T], *, most: int | None = None) -> list[R]:
    """Return what a function makes of every item, in their order, on as many threads as there are cores, this one among them.

    On one thread within itself, and in a process that was started as one of several: the cores are busy there already. What the
    first of the items raises that fails is raised here.

    Parameters
    ----------
    function
        Takes one item; several threads run it at once.
    items
        Taken in their order.
    most
        Number of threads beyond which more would not make it faster; None for one for each core.
    """
    every = list(items)
    threads = min(usable_cores(), len(every), len(every) if most is None else most)
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

    def beside(ended: Event) -> None:
        try:
            work()
        finally:
            ended.set()

    # `Thread.join` that was interrupted holds the thread to have ended.
    others: list[Event] = []
    try:
        for _ in range(threads - 1):
            ended = Event()
            Thread(target=beside, args=(ended,), daemon=True).start()
            others.append(ended)
        work()
        for ended in others:
            ended.wait()
    except BaseException as error:  # noqa: BLE001 - an interrupt beside the items, or no room for a thread: raised below
        failed[-1] = error
        # What is half done may be removed by whoever asked, and nothing may be written afterwards.
        for ended in others:
            ended.wait()
    if failed:
        raise failed[min(failed)]
    return [made[k] for k in range(len(every))]


def blas_on_one_thread(call: Callable[P, R]) -> Callable[P, R]:
    """Keep the matrix products within a call to one thread each, but where the user chose by one of `THREADS_OF_BLAS`.

    They are too small for more: threads of BLAS that wait for work take the cores from those of `over`.
    """

    @wraps(call)
    def limited(*args: P.args, **named: P.kwargs) -> R:
        if any(os.environ.get(name) for name in THREADS_OF_BLAS):
            return call(*args, **named)
        # NumPy and SciPy bring a library each, and only those that are loaded can be limited.
        import scipy.linalg  # noqa: F401
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return call(*args, **named)

    return limited


def keep_to_one_thread() -> None:
    """Use one thread in this process from now on: others like it keep the other cores busy."""
    global _alone
    _alone = True


def usable_cores() -> int:
    """Return how many cores this process may use: one where it is one of several."""
    if _alone or _is_one_of_several():
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _is_one_of_several() -> bool:
    # A process that multiprocessing started has loaded it, and loading it takes longer than many a short log.
    started: Any = sys.modules.get("multiprocessing.process")
    return started is not None and started.parent_process() is not None
