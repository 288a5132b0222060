"""Runs cases in worker processes, which may die, hang or need too much without harm to the run."""

from __future__ import annotations

import gc
import multiprocessing
import os
import resource
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from tests.attack import check
from tests.attack.case import COMMAND_EVERY, draw, formats
from tests.attack.check import Outcome, examine

ADDRESS_SPACE = 3 * 10**9
"""What a worker may map beyond what it has at first [bytes]: more than what a case may use, which is measured."""
ASLEEP_S = 60.0
"""Time that a case may sleep [s], waiting for something that does not come; waiting for a processor is no sleep."""


@dataclass(frozen=True)
class Result:
    """One case that was run, as the table counts it."""

    number: int
    format: str
    base: str
    kind: str
    what: str
    legitimate: bool
    outcome: Outcome


@dataclass
class _Worker:
    process: Any
    link: Connection
    number: int | None = None
    seen: float = 0.0
    asleep_s: float = 0.0
    processor_s: float = 0.0


def attack(
    seed: int,
    numbers: Iterator[int],
    *,
    workers: int = 2,
    only: str = "",
    opener: check.Open | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[Result]:
    """Run the cases of these numbers and yield their results as they come.

    Parameters
    ----------
    seed
        Of the run.
    numbers
        Which cases, until they end or `stop` returns true.
    workers
        Processes.
    only
        One format, or all of them.
    opener
        In place of `ferryid.ingest.open_log`.
    """
    warm_up()
    # SIGKILL leaves files behind, so that everything of the run lies in one folder.
    with tempfile.TemporaryDirectory(prefix="attack-run-", ignore_cleanup_errors=True) as folder:
        root = Path(folder)
        for bases, _ in formats().values():
            for base in bases:
                check.reported_undamaged(base, root / "undamaged")
        pool = [_started(seed, only, root / str(place), opener) for place in range(workers)]
        try:
            yield from _run(
                pool, numbers, stop, lambda place: _started(seed, only, root / str(place), opener), seed, only
            )
        finally:
            for worker in pool:
                worker.process.kill()
                worker.process.join()


def warm_up() -> None:
    """Load what reading loads, so that workers need not."""
    import pyarrow.csv
    import pyarrow.parquet  # noqa: F401

    import ferryid.signals.ingest
    import ferryid.signals.inspect
    import ferryid.vessel  # noqa: F401
    from ferryid.ingest import supported_formats

    supported_formats()
    formats()


def _run(
    pool: list[_Worker],
    numbers: Iterator[int],
    stop: Callable[[], bool],
    start: Callable[[int], _Worker],
    seed: int,
    only: str,
) -> Iterator[Result]:
    while True:
        for worker in pool:
            if worker.number is None and not stop():
                number = next(numbers, None)
                if number is not None:
                    _give(worker, number)
        busy = [worker for worker in pool if worker.number is not None]
        if not busy:
            return
        ready = wait([worker.link for worker in busy], timeout=0.5)
        for place, worker in enumerate(pool):
            if worker.number is None:
                continue
            answer, why = None, ""
            if worker.link in ready:
                try:
                    answer = worker.link.recv()
                except (EOFError, OSError):
                    worker.process.join()
                    why = f"the process died ({_ending(worker.process.exitcode)})"
            else:
                why = _over_time(worker)
            if answer is not None:
                worker.number = None
                yield answer
            elif why:
                worker.process.kill()
                worker.process.join()
                # Drawing it in this process is safe: reading is what failed.
                yield _result(seed, only, worker.number, Outcome("refused", (why,), check.SECONDS))
                pool[place] = start(place)


def _give(worker: _Worker, number: int) -> None:
    worker.number, worker.seen, worker.asleep_s = number, time.monotonic(), 0.0
    worker.processor_s = _used(worker.process.pid)
    worker.link.send(number)


def _over_time(worker: _Worker) -> str:
    # Two readings, and the commands besides.
    limit = check.SECONDS * (2 + 2 * (worker.number is not None and worker.number % COMMAND_EVERY == 0))
    if _used(worker.process.pid) - worker.processor_s > limit:
        return f"took more than {limit:.0f} s of processor time"
    now = time.monotonic()
    worker.asleep_s = worker.asleep_s + now - worker.seen if _asleep(worker.process.pid) else 0.0
    worker.seen = now
    return f"slept for more than {ASLEEP_S:.0f} s" if worker.asleep_s > ASLEEP_S else ""


def _asleep(pid: int) -> bool:
    """Tell whether every thread of a process waits for something that is no processor."""
    return all(_stat(thread)[:1] != ["R"] for thread in Path(f"/proc/{pid}/task").glob("*"))


def _used(pid: int) -> float:
    """Processor time of a process [s], of all its threads."""
    fields = _stat(Path(f"/proc/{pid}"))
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") if fields else 0.0


def _stat(process: Path) -> list[str]:
    """Return what the system tells of a process or thread, from its state on; nothing where it has ended."""
    try:
        return (process / "stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


def _ending(code: int | None) -> str:
    return signal.Signals(-code).name if code is not None and code < 0 else f"exit code {code}"


def _result(seed: int, only: str, number: int, outcome: Outcome) -> Result:
    case = draw(seed, number, only)
    return Result(
        number, case.base.format, case.base.name, case.kind, case.mutated.what, case.mutated.legitimate, outcome
    )


def _started(seed: int, only: str, folder: Path, opener: check.Open | None) -> _Worker:
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs, ours, seed, only, folder, opener), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _work(link: Connection, other: Connection, seed: int, only: str, folder: Path, opener: check.Open | None) -> None:
    other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    shutil.rmtree(folder, ignore_errors=True)
    temporary = folder / "tmp"
    temporary.mkdir(parents=True)
    tempfile.tempdir = str(temporary)
    os.environ["TMPDIR"] = str(temporary)
    size = check.status("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (size + ADDRESS_SPACE, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    gc.collect()
    # What the parent loaded need not be looked through after every case.
    gc.freeze()
    while True:
        try:
            number = link.recv()
        except (EOFError, OSError):
            return
        case = draw(seed, number, only)
        outcome = examine(case, folder / "case", temporary, *([] if opener is None else [opener]))
        link.send(_result(seed, only, number, outcome))
