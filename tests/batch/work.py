"""Work for other processes: it counts itself, and dies where it is told to."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ferryid.batch.log_result import LogResult
    from ferryid.batch.task import Task

# Every process that is started imports this, and little beside it.

ROOT = Path(__file__).resolve().parents[2]


def square(item: tuple[str, int, str]) -> tuple[int, int]:
    """Return a square and the process that worked it out; each call leaves a line in the file of its number.

    Parameters
    ----------
    item
        Folder of the files, number, and its fate: ``dies`` for good, ``dies once``, ``raises``, ``lingers`` or ``sleeps``.
    """
    folder, number, fate = item
    with (Path(folder) / str(number)).open("a") as file:
        file.write(f"{os.getpid()}\n")
    if fate == "dies" or (fate == "dies once" and calls(Path(folder), number) == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    if fate == "lingers":
        # Until the next one is at work, however long its process takes to start, and a while more.
        deadline = time.monotonic() + 60.0
        while not calls(Path(folder), number + 1) and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(2.0)
    if fate == "raises":
        raise KeyError(f"number {number}")
    time.sleep(60.0 if fate == "sleeps" else 0.05)
    return number**2, os.getpid()


def blank(one: Task) -> LogResult:
    """Carry out a task of a batch, and leave figures blank, as tests do that look at none."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    from ferryid.batch import task
    from tests.conftest import BLANK

    FigureCanvasSVG.print_svg = lambda canvas, file, **options: file.write(BLANK)  # type: ignore[method-assign]
    return task.work(one)


def deadly(one: Task) -> LogResult:
    """Carry out a task of a batch, but die at once at a log of that name."""
    from ferryid.batch import task

    if "deadly" in one.name:
        os.kill(os.getpid(), signal.SIGKILL)
    return task.work(one)


def calls(folder: Path, number: int) -> int:
    path = folder / str(number)
    return len(path.read_text().splitlines()) if path.exists() else 0


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):  # the second where it ends between the opening and the reading
        return False


def ended(pids: list[int], seconds: float = 10.0) -> bool:
    """Wait for processes to end."""
    deadline = time.monotonic() + seconds
    while any(map(alive, pids)):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def children_of(pid: int) -> list[int]:
    """Return the processes below one, of all generations."""
    of: dict[int, list[int]] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        of.setdefault(int(text[1]), []).append(int(path.parent.name))
    found, left = [], [pid]
    while left:
        left = [child for one in left for child in of.get(one, [])]
        found += left
    return found


def environment() -> dict[str, str]:
    """Return this environment, for a process that is to find these tests."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), *filter(None, sys.path)))}


def default_interrupts() -> None:
    """Let a process that is started be interrupted, also where whoever started these tests ignores interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
