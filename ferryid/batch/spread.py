"""Work spread over processes of this machine or over a Dask cluster: a function, items, and results as they are ready.

Function, items and results must be picklable. On a cluster the workers need the same ferryid, and see the same folders under
the same paths where an item names some.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import connection
from typing import Any, Protocol, TypeVar

from ferryid.errors import FerryIdError
from ferryid.interrupts import end_at_once

T = TypeVar("T")
R = TypeVar("R")

MOST_PROCESSES = 64
TERMINATE_S = 0.5
"""How long a process may take to remove its temporary files before it is killed [s]."""
LOSSES = 3
"""An item whose process died so often is given up."""
ANSWER_S = 10.0
"""How long a cluster may take to answer [s]."""


class Spread(Protocol):
    """Something that carries out work."""

    def over(
        self,
        function: Callable[[T], R],
        items: Sequence[T],
        *,
        begun: Callable[[int], None] | None = None,
        lost: Callable[[T], R] | None = None,
    ) -> Iterator[tuple[int, R]]:
        """Yield the number of each item and what the function makes of it, as they are ready.

        An item whose process is lost is done again by another. What the function raises is raised here, and ends the work.

        Parameters
        ----------
        function, items
            What is to be done, and with what.
        begun
            Called with the number of an item that is begun; on a cluster, which does not tell, never.
        lost
            What comes of an item that lost its process `LOSSES` times; None ends the work with an error.

        Raises
        ------
        FerryIdError
            For an item that lost its process `LOSSES` times.
        """
        ...


@contextmanager
def spread(processes: int = 1, dask: str | None = None, *, apart: bool = False) -> Iterator[Spread]:
    """Give something that carries out work; what still runs at the end of the block is ended.

    Parameters
    ----------
    processes
        How many of this machine; 1 works in this process.
    dask
        Address of a Dask scheduler, such as ``tcp://localhost:8786``, which is used instead of them.
    apart
        A single process is another one than this, too: whatever dies there, this one goes on.

    Raises
    ------
    FerryIdError
        For a number that is not possible, and a cluster that cannot be used.
    """
    if dask is not None:
        with _quiet(), _cluster(dask) as client:
            yield _Cluster(client)
        return
    if not 1 <= processes <= MOST_PROCESSES:
        raise FerryIdError(f"--processes: {processes} is no number of processes. Fix: give 1 to {MOST_PROCESSES}")
    if processes == 1 and not apart:
        yield _Here()
        return
    pool = _Pool(processes)
    try:
        yield pool
    finally:
        pool.end()


class _Here:
    def over(
        self,
        function: Callable[[T], R],
        items: Sequence[T],
        *,
        begun: Callable[[int], None] | None = None,
        lost: Callable[[T], R] | None = None,
    ) -> Iterator[tuple[int, R]]:
        for number, item in enumerate(items):
            if begun is not None:
                begun(number)
            yield number, function(item)


class _Pool:
    """Processes of this machine, started afresh: numba's and NumPy's threads do not survive a fork.

    Each is an executor of its own: the death of one loses its item and no other, and no executor starts a process while it
    ends the others, which CPython 3.11 does not lock.
    """

    def __init__(self, processes: int) -> None:
        self._processes = processes
        self._idle: list[ProcessPoolExecutor] = []
        self._workers: dict[ProcessPoolExecutor, set[multiprocessing.process.BaseProcess]] = {}

    def over(
        self,
        function: Callable[[T], R],
        items: Sequence[T],
        *,
        begun: Callable[[int], None] | None = None,
        lost: Callable[[T], R] | None = None,
    ) -> Iterator[tuple[int, R]]:
        waiting, losses = deque(range(len(items))), [0] * len(items)
        # What lost its process is done again by itself: it may need the memory of all.
        suspects: deque[int] = deque()
        running: dict[Future[R], tuple[int, ProcessPoolExecutor]] = {}
        try:
            while waiting or suspects or running:
                # No more than are worked on, so that no others are lost.
                while (waiting and len(running) < self._processes) or (suspects and not running):
                    number = (waiting or suspects).popleft()
                    future, executor = self._submit(function, items[number])
                    running[future] = number, executor
                    if begun is not None:
                        begun(number)
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    number, executor = running.pop(future)
                    try:
                        result = future.result()
                    except BrokenProcessPool as error:
                        self._end([executor])
                        losses[number] += 1
                        if losses[number] < LOSSES:
                            suspects.append(number)
                            continue
                        if lost is None:
                            raise FerryIdError(
                                f"the process that worked on item {number + 1} of {len(items)} died {LOSSES} times. "
                                "Fix: give fewer --processes, which need less memory together"
                            ) from error
                        result = lost(items[number])
                    else:
                        self._idle.append(executor)
                    yield number, result
        finally:
            self._end([executor for _, executor in running.values()])

    def _submit(self, function: Callable[[T], R], item: T) -> tuple[Future[R], ProcessPoolExecutor]:
        before = set(multiprocessing.active_children())
        executor = (
            self._idle.pop()
            if self._idle
            else ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"), initializer=_begin)
        )
        try:
            return executor.submit(function, item), executor
        except BrokenProcessPool:  # it died while it had nothing to do
            self._end([executor])
            return self._submit(function, item)
        finally:
            if started := set(multiprocessing.active_children()) - before:
                self._workers.setdefault(executor, set()).update(started)

    def end(self) -> None:
        """End all processes at once, whatever they are doing."""
        self._idle.clear()
        self._end(list(self._workers))

    def _end(self, executors: Sequence[ProcessPoolExecutor]) -> None:
        workers = [worker for executor in executors for worker in self._workers.pop(executor, ())]
        for executor in executors:
            executor.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.terminate()
        deadline = time.monotonic() + TERMINATE_S
        while (left := [w for w in workers if not connection.wait([w.sentinel], 0.0)]) and time.monotonic() < deadline:
            time.sleep(0.01)
        for worker in left:
            worker.kill()
        for executor in executors:
            executor.shutdown(wait=True)


def _begin() -> None:
    """Leave interrupts to the process that started this one, and end with it, however it ends."""
    end_at_once()
    parent = multiprocessing.parent_process()

    def end_with() -> None:
        if parent is not None:
            connection.wait([parent.sentinel])
            os._exit(1)

    threading.Thread(target=end_with, daemon=True).start()


class _Cluster:
    def __init__(self, client: Any) -> None:
        self._client = client

    def over(
        self,
        function: Callable[[T], R],
        items: Sequence[T],
        *,
        begun: Callable[[int], None] | None = None,
        lost: Callable[[T], R] | None = None,
    ) -> Iterator[tuple[int, R]]:
        from distributed import CancelledError, KilledWorker, as_completed
        from distributed.comm.core import CommClosedError

        futures: dict[Any, int] = {}
        try:
            for number, item in enumerate(items):
                futures[self._client.submit(function, item, pure=False)] = number
            for future in as_completed(futures, loop=self._client.loop):  # type: ignore[no-untyped-call]
                try:
                    result = future.result()
                except KilledWorker as error:
                    if lost is None:
                        raise FerryIdError(
                            f"the workers that were given item {futures[future] + 1} of {len(items)} died, one after the "
                            "other. Fix: give the cluster's workers more memory"
                        ) from error
                    result = lost(items[futures[future]])
                yield futures[future], result
                future.release()
        except (CancelledError, CommClosedError) as error:
            raise FerryIdError(
                "--dask: the scheduler is gone, or took the work back. Fix: start it again and go on"
            ) from error
        finally:
            with suppress(Exception):  # a scheduler that is gone has nothing to cancel
                self._client.cancel(list(futures))


@contextmanager
def _quiet() -> Iterator[None]:
    """Have nothing logged of what is said in one line."""
    logs = [logging.getLogger(name) for name in ("distributed", "tornado", "asyncio")]
    levels = [log.level for log in logs]
    for log in logs:
        # Above the highest: what a connection that breaks off leaves is logged as critical.
        log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for log, level in zip(logs, levels, strict=True):
            log.setLevel(level)


@contextmanager
def _cluster(address: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError as error:
        raise FerryIdError(
            "--dask: the package distributed is not installed, which a cluster needs. Fix: pip install distributed"
        ) from error
    if not re.fullmatch(r"tcp://[^\s/:]+:\d{1,5}|tcp://\[[0-9a-fA-F:]+\]:\d{1,5}", address):
        raise FerryIdError(f"--dask: {address!r} is no scheduler's address. Fix: give one like tcp://HOST:8786")
    try:
        client: Any = Client(address, timeout=ANSWER_S, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, TimeoutError, ValueError) as error:
        reason = str(error).strip() or type(error).__name__
        raise FerryIdError(
            f"--dask {address}: no scheduler answers there within {ANSWER_S:.0f} s, {reason}. "
            "Fix: start one with `dask scheduler`, and give the address that it prints"
        ) from error
    try:
        yield client
    finally:
        client.close(timeout=ANSWER_S)
