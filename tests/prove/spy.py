"""What a diagnosis might try in order to see the answers: each attempt by its name, and what became of it.

`python -m tests.prove.spy` takes the place of the blind process; with ``--without-kernel`` it has no Landlock, with
``--mortal`` it dies in the middle of requests.
"""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from ferryid.prove import blind

BY_C = ("pyarrow", "pyarrow lists", "c")
"""Attempts that Python's hook does not see."""


def spy(log: Path, profile: Path, out: Path) -> dict[str, Any]:
    proof = log.parents[2]
    answers = proof / "answers.sealed"
    attempts: dict[str, Callable[[], object]] = {
        "open": lambda: answers.read_bytes(),
        "os.open": lambda: os.open(answers, os.O_RDONLY),
        "listdir": lambda: os.listdir(proof),
        "scandir": lambda: list(os.scandir(proof)),
        "glob": lambda: _found(proof.glob("answers*")),
        "walk": lambda: _found(files for _, _, files in os.walk(proof) if files),
        "relative": lambda: Path(os.path.relpath(answers)).read_bytes(),
        "link": lambda: (log.parent / "link").read_bytes(),
        "another log": lambda: (proof / "logs" / "other" / "vessel.toml").read_bytes(),
        "parent": lambda: Path(f"/proc/{os.getppid()}/environ").read_bytes(),
        "root of proc": lambda: Path(f"/proc/self/root{answers}").read_bytes(),
        "write beside the log": lambda: (log.parent / "new").write_text("x"),
        "write into the proof": lambda: (proof / "lines.jsonl").write_text("x"),
        "rename": lambda: os.rename(log, out / "log"),
        "hard link": lambda: os.link(answers, out / "answers"),
        "chdir": lambda: os.chdir(proof),
        "process": lambda: subprocess.run(["cat", answers], check=True),
        "shell": lambda: os.system("true"),
        "fork": lambda: _fork(),
        "socket": lambda: socket.create_connection(("127.0.0.1", 9)),
        "sqlite": lambda: _sqlite(answers),
        "pyarrow": lambda: _pyarrow(answers),
        "pyarrow lists": lambda: _pyarrow_lists(proof),
        "c": lambda: _c(answers),
    }
    told: dict[str, Any] = {}
    for name, attempt in attempts.items():
        try:
            attempt()
            told[name] = "done"
        except PermissionError:
            told[name] = "refused"
        except Exception as error:  # noqa: BLE001 - the test shows whatever else became of it
            told[name] = repr(error)
    from ferryid.diagnose import parallel

    return {
        "attempts": told,
        "log": len(log.read_bytes()),
        "profile": len(profile.read_text("utf-8")),
        "kept": (out / "model.json").write_text("{}"),
        "temporary": _temporary(),
        "environment": dict(os.environ),
        "command": sys.argv,
        "pid": os.getpid(),
        "cores": parallel._cores(),
    }


def _found(what: Iterable[object]) -> None:
    # These take a refusal for an empty folder.
    if not any(True for _ in what):
        raise PermissionError


def _fork() -> None:
    if os.fork() == 0:
        os._exit(0)


def _sqlite(path: Path) -> None:
    import sqlite3

    sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True).execute("SELECT * FROM sqlite_master")


def _pyarrow(path: Path) -> None:
    import pyarrow

    pyarrow.OSFile(str(path)).read()


def _pyarrow_lists(folder: Path) -> None:
    from pyarrow import fs

    fs.LocalFileSystem().get_file_info(fs.FileSelector(str(folder)))


def _c(path: Path) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.open(os.fsencode(path), os.O_RDONLY) < 0:
        raise OSError(ctypes.get_errno(), "open")


def _temporary() -> str:
    import tempfile

    with tempfile.NamedTemporaryFile() as file:
        return str(Path(file.name).parent)


def mortal(log: Path, profile: Path, out: Path) -> dict[str, Any]:
    """Die at the first request for a log called ``once``, at each for one called ``always``; sleep over ``slow``."""
    if log.stem == "once" and not (out / "seen").exists():
        (out / "seen").write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    if log.stem == "always":
        os._exit(7)
    if log.stem == "slow":
        time.sleep(60.0)
    if log.stem == "bug":
        return {"verdict": 1 / 0}
    sys.stdout.write("libraries print what they like\n")
    sys.stdout.flush()
    return {"verdict": "matched", "pid": os.getpid(), "value": float("nan")}


if __name__ == "__main__":
    if "--without-kernel" in sys.argv:
        blind.landlock = lambda rooms: False
    blind.main(mortal if "--mortal" in sys.argv else spy)
