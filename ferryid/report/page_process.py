"""The page of a fit, made by a second process, which loads what draws while the fit is made.

What draws takes as long to load and to draw as a fit takes, and Python computes on one core at a time. The process reads one
request from its input, pickled, and writes the page to its output; where it does not answer, the page is made as if it did
not exist. It is a process afresh: a forked copy of one with threads (NumPy's, PyArrow's) may hang.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import subprocess
    from pathlib import Path

    from ferryid.identify import FitOutcome
    from ferryid.report.page import Page

MOST_ROWS = 2_000_000
"""Rows of the logs of a fit, some hundred bytes each, that are handed over: longer ones would lie in memory twice."""
_SERVE = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
from ferryid.report.page_process import serve
serve()
"""
_allowed = False


def allow() -> None:
    """Let pages be made by a second process from now on.

    For the command line alone: in another program the interpreter's path may lead to anything.
    """
    global _allowed
    _allowed = True


class PageProcess:
    """A process that makes one page."""

    def __init__(self) -> None:
        import pickle
        import subprocess

        self._process: subprocess.Popen[bytes] = subprocess.Popen(
            [sys.executable, "-P", "-c", _SERVE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._write(pickle.dumps(sys.path))

    def page_of(self, result: FitOutcome, folder: Path, out: Path, command: Sequence[str]) -> Page | None:
        """Return what `ferryid.report.page.page_of` does; None where the process failed or too much were to be handed over."""
        import pickle

        if sum(len(log.motion.t) for log in result.logs) > MOST_ROWS or self._process.stdout is None:
            return None
        try:
            request = pickle.dumps((result, folder, out, tuple(command)), protocol=5)
        except (pickle.PicklingError, TypeError, AttributeError):  # something in it that is a process's own
            return None
        if not self._write(request):
            return None
        try:
            page: Page = pickle.load(self._process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):  # it ended, wherever in its answer
            return None
        return page

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()
        self._process.wait()

    def _write(self, request: bytes) -> bool:
        """Tell whether the process took a request."""
        try:
            if self._process.stdin is not None:
                self._process.stdin.write(request)
                self._process.stdin.flush()
        except OSError:
            return False
        return True


@contextmanager
def started(wanted: bool) -> Iterator[PageProcess | None]:
    """Start the process where a page is wanted, another core is there and the command line runs; None elsewhere."""
    process = None
    if wanted and _allowed and _cores() > 1:
        with suppress(OSError):
            process = PageProcess()
    try:
        yield process
    finally:
        if process is not None:
            process.close()


def serve() -> None:
    """Make the page that is asked for on standard input."""
    import gc
    import pickle
    import warnings

    from ferryid import interrupts

    interrupts.end_at_once()
    warnings.simplefilter("ignore")
    # Figures are circles of references, which are sought again and again; this process ends with its page.
    gc.disable()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    from ferryid.report.page import load_all, page_of

    load_all()
    result, folder, out, command = pickle.load(sys.stdin.buffer)
    pickle.dump(page_of(result, folder, out, command), answers, protocol=5)
    answers.flush()
    os._exit(0)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
