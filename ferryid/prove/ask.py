"""Asking a blind process for diagnoses, one log after the other; another takes its place if it dies."""

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
from ferryid.prove.blind import UNWRITABLE, failed

PROGRAM = ("-m", "ferryid.prove.blind")
TRIES = 2
"""How often a log is diagnosed whose process died."""
PASSED_ON = ("HOME", "NUMBA_CACHE_DIR", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "SYSTEMROOT")
"""Of this environment, what the process needs to find libraries and caches."""


class Blind:
    """A process that diagnoses logs of one proof and can read nothing else of it.

    Parameters
    ----------
    folder
        Of the proof: logs are in ``logs``, models go to ``models``, temporary files to ``scratch``.
    program
        What Python is to run.
    """

    def __init__(self, folder: Path, program: Sequence[str] = PROGRAM) -> None:
        self._folder = folder.resolve()
        self._program = tuple(program)
        self._process: subprocess.Popen[bytes] | None = None
        self._temporary = ""
        self.guard = ""
        """What keeps the answers from it: ``"landlock+audit"`` or ``"audit"``."""
        self.sources = ""
        """Hash of the sources that it diagnoses with."""

    def __enter__(self) -> Blind:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def ask(self, log: Path, profile: Path, out: Path) -> dict[str, Any]:
        """Return the diagnosis of a log, as `ferryid.prove.blind.diagnosed` has it, and ``guard``.

        Where the process died every time, ``verdict`` is ``"crashed"``.

        Raises
        ------
        UnwritableError
            Where what comes of it could not be written.
        """
        out.mkdir(parents=True, exist_ok=True)
        request = {"log": str(log.resolve()), "profile": str(profile.resolve()), "out": str(out.resolve())}
        start = time.perf_counter()
        for _ in range(TRIES):
            self._start()
            answer = self._exchange(request)
            if answer is not None and UNWRITABLE in answer:
                raise UnwritableError(answer[UNWRITABLE])
            if answer is not None:
                return {**answer, "guard": self.guard}
            code = self.close()
        lost = f"the process that diagnosed it died {TRIES} times, the last time with code {code}"
        return {**failed("crashed", lost, time.perf_counter() - start), "guard": self.guard}

    def _start(self) -> None:
        # Where its folder for temporary files is gone, so are the others that the kernel knows it may use.
        if self._process is not None and self._process.poll() is None and os.path.isdir(self._temporary):
            return
        self.close()
        for name in ("logs", "models", "scratch"):
            (self._folder / name).mkdir(parents=True, exist_ok=True)
        self._temporary = tempfile.mkdtemp(dir=self._folder / "scratch")
        self._process = subprocess.Popen(
            [sys.executable, "-P", *self._program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=_environment(self._temporary),
            cwd=self._temporary,
        )
        rooms = {name: str(self._folder / name) for name in ("logs", "models")}
        ready = self._exchange({**rooms, "temporary": self._temporary, "closed": str(self._folder)})
        if ready is None:
            code = self.close()
            raise FerryIdError(
                f"prove: the process that is to diagnose blind ended with code {code} before it took a log. "
                f"Fix: see what {sys.executable} {' '.join(self._program)} says, or choose another folder with --out"
            )
        self.guard, self.sources = ready["guard"], ready["sources"]

    def _exchange(self, line: dict[str, Any]) -> dict[str, Any] | None:
        """Return the answer to a line; None where the process has died."""
        process = self._process
        if process is None or process.stdin is None or process.stdout is None:
            return None
        try:
            process.stdin.write(json.dumps(line).encode() + b"\n")
            process.stdin.flush()
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


def blind_of(folder: Path) -> Blind:
    """Return the blind process of a proof that serves this thread, which is kept for the next log."""
    kept: dict[Path, Blind] = _mine.__dict__.setdefault("kept", {})
    if folder not in kept:
        for other in kept.values():
            other.close()
        kept.clear()
        kept[folder] = Blind(folder)
        atexit.register(kept[folder].close)
    return kept[folder]
