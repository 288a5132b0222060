"""Parts side by side on threads: in order, one level deep, and on one thread where the cores are busy already."""

from __future__ import annotations

import multiprocessing.process
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from operator import call
from threading import Barrier, get_ident

import pytest

from ferryid import side_by_side
from ferryid.side_by_side import over

CORES = 3


@pytest.fixture(autouse=True)
def several(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three cores, whatever machine this is and whatever runs beside."""
    monkeypatch.setattr(side_by_side, "_alone", False)
    monkeypatch.setattr(side_by_side.os, "sched_getaffinity", lambda pid: set(range(CORES)), raising=False)


@pytest.mark.slow
def test_results_are_in_the_order_of_the_items_whatever_ends_first() -> None:
    ended: list[int] = []

    def slow(k: int) -> int:
        time.sleep(0.02 * (2 * CORES - k))
        ended.append(k)
        return 10 * k

    assert over(slow, range(2 * CORES)) == [0, 10, 20, 30, 40, 50]
    assert ended != sorted(ended)
    assert over(slow, iter([4])) == [40]
    assert over(slow, []) == []


def test_as_many_run_at_once_as_there_are_cores() -> None:
    together = Barrier(CORES, timeout=10.0)

    def meet(k: int) -> int:
        together.wait()
        return get_ident()

    assert len(set(over(meet, range(CORES)))) == CORES
    # This thread is one of them.
    assert get_ident() in over(meet, range(CORES))


def test_what_one_raises_is_raised() -> None:
    def fails(k: int) -> int:
        if k == 4:
            raise KeyError("the fifth")
        return k

    with pytest.raises(KeyError, match="the fifth"):
        over(fails, range(2 * CORES))
    # On one thread, too, and afterwards there are threads again.
    with pytest.raises(KeyError, match="the fifth"):
        over(fails, [4])
    together = Barrier(CORES, timeout=10.0)
    assert over(lambda k: together.wait() < CORES, range(CORES)) == CORES * [True]


def test_of_several_that_fail_the_first_is_raised_and_none_begins_afterwards() -> None:
    together = Barrier(CORES, timeout=10.0)
    begun = []

    def fails(k: int) -> int:
        begun.append(k)
        together.wait()
        # The last fails first.
        time.sleep(0.05 * (CORES - k))
        raise KeyError(k)

    with pytest.raises(KeyError, match="0"):
        over(fails, range(2 * CORES))
    assert sorted(begun) == list(range(CORES))


def test_calls_within_stay_on_the_thread_that_they_are_made_on() -> None:
    together = Barrier(CORES, timeout=10.0)

    def inner(k: int) -> int:
        return get_ident()

    def middle(k: int) -> list[int]:
        return [get_ident(), *over(inner, range(5))]

    def outer(k: int) -> list[int]:
        # All threads are taken before any goes on.
        together.wait()
        return [get_ident(), *(ident for row in over(middle, range(4)) for ident in row)]

    rows = over(outer, range(CORES))
    assert all(len(row) == 1 + 4 * 6 and len(set(row)) == 1 for row in rows)
    assert len({row[0] for row in rows}) == CORES


def test_no_more_threads_than_are_of_use() -> None:
    assert set(over(lambda k: get_ident(), range(50), most=1)) == {get_ident()}
    together = Barrier(2, timeout=10.0)

    def meet(k: int) -> int:
        together.wait()
        return get_ident()

    assert len(set(over(meet, range(2 * CORES), most=2))) == 2


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
def test_what_has_begun_ends_before_an_interrupt_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(side_by_side, "usable_cores", lambda: 2)
    together, main, ended = Barrier(2, timeout=10.0), get_ident(), []

    def item(k: int) -> None:
        together.wait()
        if get_ident() != main:
            # The thread that asked has nothing left to do by the first sleep's end, and waits for this one.
            time.sleep(0.1)
            signal.pthread_kill(main, signal.SIGINT)
            time.sleep(0.2)
            ended.append(k)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            over(item, range(2))
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(ended) == 1


@pytest.mark.slow
def test_multiprocessing_is_not_loaded_for_it() -> None:
    code = "import sys; from ferryid.side_by_side import over; over(abs, range(4)); print('multiprocessing' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


@pytest.mark.slow
def test_one_of_several_processes_uses_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as started:
        started.setattr(multiprocessing.process, "parent_process", object)
        assert set(over(lambda k: get_ident(), range(4))) == {get_ident()}
    together = Barrier(CORES, timeout=10.0)
    assert over(lambda k: together.wait() < CORES, range(CORES)) == CORES * [True]
    # What a process really knows of having been started; its own machine has the cores that it has.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        main = pool.submit(call, get_ident).result(timeout=60.0)
        assert pool.submit(over, call, [get_ident] * 4).result(timeout=60.0) == [main] * 4
