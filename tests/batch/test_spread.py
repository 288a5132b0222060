"""Work spread over processes and over a cluster: all of it is done, whatever dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from ferryid.batch import spread as spreading
from ferryid.batch.spread import spread
from ferryid.errors import FerryIdError
from tests.batch.work import calls, ended, environment, square


def items(folder: Path, count: int, **fates: str) -> list[tuple[str, int, str]]:
    return [(str(folder), number, fates.get(f"at_{number}", "")) for number in range(count)]


def pids_in(folder: Path, number: int) -> list[int]:
    return [int(line) for line in (folder / str(number)).read_text().splitlines()]


@pytest.mark.slow
@pytest.mark.parametrize("processes", [1, 2])
def test_everything_is_done_once(tmp_path: Path, processes: int) -> None:
    with spread(processes) as workers:
        done = dict(workers.over(square, items(tmp_path, 9)))
        again = dict(workers.over(square, items(tmp_path, 2)))
        assert list(workers.over(square, [])) == []
    assert {number: result for number, (result, _) in done.items()} == {number: number**2 for number in range(9)}
    assert [calls(tmp_path, number) for number in range(9)] == [2, 2] + [1] * 7
    pids = {pid for _, pid in (*done.values(), *again.values())}
    assert (os.getpid() in pids) == (processes == 1)
    assert len(pids) <= processes, "processes are kept for the next stage"


@pytest.mark.slow
def test_results_come_as_they_are_ready(tmp_path: Path) -> None:
    with spread(2) as workers:
        for count, (number, _) in enumerate(workers.over(square, items(tmp_path, 6, at_0="sleeps")), 1):
            assert number != 0
            if count == 5:
                break
        start = time.monotonic()
    # What still runs at the end of the block is not waited for.
    assert time.monotonic() - start < 10.0
    assert ended([pid for number in range(6) for pid in pids_in(tmp_path, number)])


@pytest.mark.parametrize("processes", [1, 2])
def test_what_is_raised_ends_the_work(tmp_path: Path, processes: int) -> None:
    with spread(processes) as workers, pytest.raises(KeyError, match="number 1"):
        list(workers.over(square, items(tmp_path, 20, at_1="raises")))
    assert calls(tmp_path, 19) == 0


@pytest.mark.slow
def test_the_item_of_a_lost_process_is_done_again(tmp_path: Path) -> None:
    with spread(2) as workers:
        done = dict(workers.over(square, items(tmp_path, 8, at_2="dies once", at_5="dies once")))
        assert {number: result for number, (result, _) in done.items()} == {number: number**2 for number in range(8)}
        assert calls(tmp_path, 2) >= 2
        # One that dies between two stages costs nothing either.
        idle = {pid for _, pid in done.values()}
        for pid in idle:
            with suppress(ProcessLookupError):  # ended meanwhile
                os.kill(pid, signal.SIGKILL)
        assert ended(list(idle))
        assert len(dict(workers.over(square, items(tmp_path, 3)))) == 3


@pytest.mark.slow
def test_an_item_that_kills_every_process_is_given_up(tmp_path: Path) -> None:
    with spread(2) as workers, pytest.raises(FerryIdError, match=r"item \d of 4 died 3 times\. Fix: "):
        list(workers.over(square, items(tmp_path, 4, at_1="dies")))
    assert calls(tmp_path, 1) <= 3


@pytest.mark.slow
def test_what_comes_of_an_item_that_kills_every_process_and_not_of_its_neighbour(tmp_path: Path) -> None:
    begun: list[int] = []
    fates = items(tmp_path, 5, at_0="lingers", at_1="dies")
    with spread(2) as workers:
        done = dict(workers.over(square, fates, begun=begun.append, lost=lambda item: (-item[1], 0)))
    assert {number: result for number, (result, _) in done.items()} == {0: 0, 1: -1, 2: 4, 3: 9, 4: 16}
    assert calls(tmp_path, 1) == 3
    # Beside the one that dies a neighbour is lost once, if it is not done before that is noticed; then it goes alone.
    assert max(calls(tmp_path, number) for number in (0, 2, 3, 4)) <= 2
    assert begun.count(1) == 3
    assert set(begun) == {0, 1, 2, 3, 4}


@pytest.mark.slow
def test_one_process_apart(tmp_path: Path) -> None:
    with spread(1, apart=True) as workers:
        done = dict(workers.over(square, items(tmp_path, 3, at_1="dies"), lost=lambda item: (0, 0)))
    assert done[1] == (0, 0)
    assert os.getpid() not in {pid for _, pid in done.values()}


@pytest.mark.parametrize("processes", [0, -1, 1000])
def test_impossible_numbers(processes: int) -> None:
    with pytest.raises(FerryIdError, match=r"--processes: .* Fix: give 1 to 64"), spread(processes):
        pass


@pytest.mark.slow
def test_processes_end_with_the_one_that_started_them(tmp_path: Path) -> None:
    code = f"""
import sys
from pathlib import Path
from ferryid.batch.spread import spread
from tests.batch.work import environment, square
if __name__ == "__main__":
    with spread(2) as workers:
        list(workers.over(square, [({str(tmp_path)!r}, number, "sleeps") for number in (0, 1)]))
"""
    script = tmp_path / "script.py"
    script.write_text(code, encoding="utf-8")
    with subprocess.Popen([sys.executable, script], env=environment()) as working:
        deadline = time.monotonic() + 30.0
        while not (calls(tmp_path, 0) and calls(tmp_path, 1)):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        working.send_signal(signal.SIGKILL)
    assert ended([*pids_in(tmp_path, 0), *pids_in(tmp_path, 1)])


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker(tmp_path: Path, cluster: tuple[str, list[subprocess.Popen[bytes]]]) -> None:
    address, (_, *workers) = cluster
    tally = tmp_path / "tally"
    tally.mkdir()
    seen: set[int] = set()
    with spread(dask=address) as client:
        done = {}
        for number, (result, pid) in client.over(square, items(tally, 120)):
            done[number] = result
            seen.add(pid)
            if len(seen) == 2 and workers[0].poll() is None:
                workers[0].kill()
                workers[0].wait()
                lost_at = len(done)
        assert done == {number: number**2 for number in range(120)}
        assert lost_at < 120
        assert os.getpid() not in seen
        with pytest.raises(KeyError, match="number 1"):
            list(client.over(square, items(tally, 20, at_1="raises")))


@pytest.mark.slow
def test_a_cluster_whose_workers_an_item_kills(
    tmp_path: Path, cluster: tuple[str, list[subprocess.Popen[bytes]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")

    def killed(self: object) -> None:
        raise distributed.KilledWorker("square", None, 3)

    # It takes four workers in truth.
    monkeypatch.setattr(distributed.Future, "result", killed)
    with spread(dask=cluster[0]) as client:
        assert dict(client.over(square, items(tmp_path, 1), lost=lambda item: (-7, 0))) == {0: (-7, 0)}
        with pytest.raises(FerryIdError, match="died, one after the other"):
            list(client.over(square, items(tmp_path, 1)))


@pytest.mark.slow
def test_a_cluster_that_loses_its_scheduler(
    tmp_path: Path, cluster: tuple[str, list[subprocess.Popen[bytes]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spreading, "ANSWER_S", 1.0)
    address, (scheduler, *_) = cluster

    def work() -> None:
        with spread(dask=address) as client:
            for _ in client.over(square, items(tmp_path, 200)):
                scheduler.kill()

    with pytest.raises(FerryIdError, match=r"the scheduler .* Fix: "):
        work()


@pytest.mark.slow
def test_a_cluster_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(spreading, "ANSWER_S", 1.0)
    with (
        pytest.raises(FerryIdError, match=r"^--dask .*: no scheduler answers there .* Fix: start one"),
        spread(dask="tcp://127.0.0.1:9"),
    ):
        pass


@pytest.mark.parametrize(
    "address", ["", "nonsense", "nonsense://x", "tls://127.0.0.1:8786", "tcp://127.0.0.1", "tcp://:1", "127.0.0.1:1"]
)
def test_what_is_no_address_of_a_cluster(address: str) -> None:
    pytest.importorskip("distributed")
    with (
        pytest.raises(FerryIdError, match=r"^--dask: .* is no scheduler's address. Fix: give one like tcp://HOST"),
        spread(dask=address),
    ):
        pass


def test_a_cluster_without_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(FerryIdError, match="Fix: pip install distributed"), spread(dask="tcp://127.0.0.1:9"):
        pass
