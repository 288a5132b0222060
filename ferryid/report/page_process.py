"""The page of a fit, or the drawings of a diagnosis, made by a second process, which loads what draws beside the work.

What draws takes as long to load and to draw as a fit takes, and Python computes on one core at a time. The process reads one
request from its input, pickled, and writes the page to its output; where it does not answer, the page is made as if it did
not exist. It is a process afresh: a forked copy of one with threads (NumPy's, PyArrow's) may hang. The drawings of a diagnosis
show what it found, and are made while a fit learns what it leaves.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import subprocess
    from pathlib import Path
    from threading import Thread

    from ferryid.diagnose import Diagnosis
    from ferryid.identify import FitOutcome
    from ferryid.report.page import Page
    from ferryid.types import Given

MOST_ROWS = 2_000_000
"""Rows of the logs of a fit, some hundred bytes each, that are handed over: longer ones would lie in memory twice."""
_SERVE = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
from ferryid.report import page_process
page_process.{serve}()
"""
_allowed = False


def allow() -> None:
    """Let pages be made by a second process from now on.

    For the command line alone: in another program the interpreter's path may lead to anything.
    """
    global _allowed
    _allowed = True


class _Process:
    """A process that answers one request."""

    serve: str
    """The function of this module that it runs."""

    def __init__(self) -> None:
        import pickle
        import subprocess

        self._process: subprocess.Popen[bytes] = subprocess.Popen(
            [sys.executable, "-P", "-c", _SERVE.format(serve=self.serve)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._write(pickle.dumps(sys.path))

    def _answer(self, request: bytes) -> Any:
        """Return what the process makes of a request; None where it failed."""
        import pickle

        if self._process.stdout is None or not self._write(request):
            return None
        try:
            return pickle.load(self._process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):  # it ended, wherever in its answer
            return None

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
        except (OSError, ValueError):
            return False
        return True


class PageProcess(_Process):
    """A process that makes the page of a fit."""

    serve = "serve_page"

    def page_of(
        self, result: FitOutcome, folder: Path, out: Path, command: Sequence[str], *given: Given
    ) -> Page | None:
        """Return what `ferryid.report.page.page_of` does; None where the process failed or too much were to be handed over."""
        import pickle

        if sum(len(log.motion.t) for log in result.logs) > MOST_ROWS:
            return None
        try:
            request = pickle.dumps((result, folder, out, tuple(command), *given), protocol=5)
        except (pickle.PicklingError, TypeError, AttributeError):  # something in it that is a process's own
            return None
        page: Page | None = self._answer(request)
        return page


class DrawingProcess(_Process):
    """A process that makes the drawings of a diagnosis while this one goes on."""

    serve = "serve_drawings"
    _thread: Thread | None = None
    _asked: Sequence[Diagnosis] = ()
    _made: Mapping[str, str] | None = None

    def begin(self, diagnoses: Sequence[Diagnosis]) -> None:
        """Ask for the drawings of diagnoses."""
        import pickle
        from dataclasses import replace
        from threading import Thread

        # What enters a model is not drawn.
        lean = tuple(replace(one, posterior=None, wider=None) for one in diagnoses)
        try:
            request = pickle.dumps(lean, protocol=5)
        except (pickle.PicklingError, TypeError, AttributeError):  # something in them that is a process's own
            return

        def exchange() -> None:
            self._made = self._answer(request)

        self._asked, self._thread = diagnoses, Thread(target=exchange, daemon=True)
        self._thread.start()

    def drawings(self, diagnoses: Sequence[Diagnosis]) -> Mapping[str, str]:
        """Return the drawings by name; none where the process failed, or other findings were asked for."""
        if self._thread is None or len(diagnoses) != len(self._asked):
            return {}
        if any(now.findings is not then.findings for now, then in zip(diagnoses, self._asked, strict=True)):
            return {}
        self._thread.join()
        return self._made or {}


Kind = TypeVar("Kind", bound=_Process)


@contextmanager
def started(kind: type[Kind], wanted: bool = True) -> Iterator[Kind | None]:
    """Start a process where it is wanted, another core is there and the command line runs; None elsewhere."""
    process = None
    if wanted and _allowed and _cores() > 1:
        with suppress(OSError):
            process = kind()
    try:
        yield process
    finally:
        if process is not None:
            process.close()


def serve_page() -> None:
    """Make the page that is asked for on standard input."""
    with _serving() as (request, answer):
        from ferryid.report.drawn_by_two import drawn_by_two
        from ferryid.report.page import load_all, page_of

        load_all()
        asked: tuple[FitOutcome, Path, Path, Sequence[str], Given] = request()
        # Who asked waits meanwhile: its core is free for half of the drawings.
        answer(page_of(*asked, draw=drawn_by_two))


def serve_drawings() -> None:
    """Make the drawings of the diagnoses that are asked for on standard input."""
    with _serving() as (request, answer):
        from ferryid.report.diagnosis_page import render
        from ferryid.report.page import load_all

        load_all()
        answer(render(request(), "")[1])


@contextmanager
def _serving() -> Iterator[tuple[Callable[[], Any], Callable[[Any], None]]]:
    """Yield what reads the request and what writes the answer; the process ends with it."""
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
    yield lambda: pickle.load(sys.stdin.buffer), lambda made: pickle.dump(made, answers, protocol=5)
    answers.flush()
    os._exit(0)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
