"""The client of a diagnosing process: one log after the other, and another process if it dies."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.files import resolved
from ferryid.validation.records import Diagnosis
from ferryid.validation.worker import UNWRITABLE

PROGRAM = ("-m", "ferryid.validation.worker")
TRIES = 2
"""How often a log is diagnosed whose process died."""
PASSED_ON = ("HOME", "NUMBA_CACHE_DIR", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "SYSTEMROOT")
"""Of this environment, what the process needs to find libraries and caches."""


class WorkerClient:
    """A process that diagnoses logs of one run, and is given nothing else of it.

    Parameters
    ----------
    folder
        Of the run: temporary files go to ``scratch``.
    program
        What Python is to run.
    """

    def __init__(self, folder: Path, program: Sequence[str] = PROGRAM) -> None:
        self._folder = resolved(folder)
        self._program = tuple(program)
        self._process: subprocess.Popen[bytes] | None = None
        self._temporary = ""
        self.sources = ""
        """Hash of the sources that it diagnoses with."""

    def __enter__(self) -> WorkerClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def diagnose(
        self, log: Path, profile: Path, out: Path, more: Sequence[Path] = (), before: Sequence[Path] = ()
    ) -> Diagnosis:
        """Return the diagnosis of a log, or with more of them of a campaign; ``crashed`` where the process died every time.

        With logs before it, what changed since.

        Raises
        ------
        UnwritableError
            Where what comes of it could not be written.
        """
        out.mkdir(parents=True, exist_ok=True)
        request = {
            "log": str(resolved(log)),
            "profile": str(resolved(profile)),
            "out": str(resolved(out)),
            "more": [str(resolved(path)) for path in more],
            "before": [str(resolved(path)) for path in before],
        }
        start = time.perf_counter()
        for _ in range(TRIES):
            self._start()
            answer = self._exchange(request)
            if answer is not None and UNWRITABLE in answer:
                raise UnwritableError(answer[UNWRITABLE])
            if answer is not None:
                return Diagnosis.from_json(answer)
            code = self.close()
        lost = f"the process that diagnosed it died {TRIES} times, the last time with code {code}"
        return Diagnosis("crashed", time.perf_counter() - start, error=lost)

    def _start(self) -> None:
        # A folder that was emptied took the process's folder for temporary files along.
        if self._process is not None and self._process.poll() is None and os.path.isdir(self._temporary):
            return
        self.close()
        (self._folder / "scratch").mkdir(parents=True, exist_ok=True)
        self._temporary = tempfile.mkdtemp(dir=self._folder / "scratch")
        self._process = subprocess.Popen(
            [sys.executable, "-P", *self._program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=_environment(self._temporary),
            cwd=self._temporary,
        )
        ready = self._answer()
        if ready is None:
            code = self.close()
            raise FerryIdError(
                f"prove: the process that is to diagnose ended with code {code} before it took a log. "
                f"Fix: see what {sys.executable} {' '.join(self._program)} prints"
            )
        self.sources = ready["sources"]

    def _exchange(self, line: dict[str, Any]) -> dict[str, Any] | None:
        """Return the answer to a line; None where the process has died."""
        process = self._process
        if process is None or process.stdin is None:
            return None
        try:
            process.stdin.write(json.dumps(line).encode() + b"\n")
            process.stdin.flush()
        except OSError:
            return None
        return self._answer()

    def _answer(self) -> dict[str, Any] | None:
        process = self._process
        if process is None or process.stdout is None:
            return None
        try:
            return dict(json.loads(process.stdout.readline()))
        except (OSError, ValueError):  # ValueError: a line that broke off, or none
            return None

    def close(self) -> int | None:
        """End the process and return its exit code, None where there is none."""
        process, self._process = self._process, None
        if process is None:
            return None
        died = process.poll()
        process.kill()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                _close(stream)
        code = process.wait()
        shutil.rmtree(self._temporary, ignore_errors=True)
        return code if died is None else died


def _close(stream: Any) -> None:
    try:
        stream.close()
    except OSError:  # what was not yet written has no reader any more
        return


def _environment(temporary: str) -> dict[str, str]:
    kept = {name: os.environ[name] for name in PASSED_ON if name in os.environ}
    paths = [str(Path(__file__).resolve().parents[2]), *(path for path in sys.path if os.path.isabs(path))]
    return {
        **kept,
        "PATH": os.defpath,
        "PYTHONPATH": os.pathsep.join(dict.fromkeys(paths)),
        "TMPDIR": temporary,
        # Each diagnosis keeps to one core: others are diagnosed beside it.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }


_mine = threading.local()


def worker_of(folder: Path) -> WorkerClient:
    """Return the worker of a run that serves this thread, which is kept for the next log."""
    kept: dict[Path, WorkerClient] = _mine.__dict__.setdefault("kept", {})
    if folder not in kept:
        for other in kept.values():
            other.close()
        kept.clear()
        kept[folder] = WorkerClient(folder)
        atexit.register(kept[folder].close)
    return kept[folder]
