"""The process that diagnoses: `python -m ferryid.prove.blind`, which can read logs and profiles and nothing of the answers.

It reads JSON lines on standard input and writes one JSON line for each on standard output. The first names its rooms, the
folder of all logs, that of all models and one for temporary files, and is answered with what guards it; the others are
requests of one log each. In its folder a log lies alone with the vessel's profile.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from ferryid.errors import FerryIdError, UnwritableError, one_line
from ferryid.prove.guard import Hook, Rooms, landlock, python_rooms
from ferryid.prove.sources import sources

# Nothing heavy is imported above: the kernel shuts in the thread that asks for it, and NumPy starts others.

UNWRITABLE = "unwritable"
"""Key of an answer that is no diagnosis: why what comes of it could not be written."""
RIVALS = 2
"""How many rivals of a finding are told."""


def diagnosed(log: Path, profile: Path, out: Path) -> dict[str, Any]:
    """Return what the diagnosis of one log says, as plain data.

    Parameters
    ----------
    log, profile
        The log, and the TOML file of its vessel.
    out
        Folder for the model that comes of it.

    Returns
    -------
    dict
        ``verdict``, ``findings`` without pictures, ``notes``, ``before``, ``after``, ``model`` (a path relative to `out`, or
        None) and ``seconds``, the time of the diagnosis. Of a log that was refused ``verdict`` is ``"refused"``, there are no
        findings, and ``error`` says why.

    Raises
    ------
    UnwritableError
        Where the model could not be written.
    """
    from ferryid.diagnose import diagnose_and_store, to_json
    from ferryid.vessel import load_profile

    start = time.perf_counter()
    try:
        vessel = load_profile(profile)
        (found,) = diagnose_and_store([str(log)], vessel, out, tables=None, progress=lambda stage: None)
        seconds = time.perf_counter() - start
        told = to_json(found)
    except UnwritableError:
        raise
    except FerryIdError as error:
        return failed("refused", str(error), time.perf_counter() - start)
    return {
        "verdict": told["verdict"],
        "findings": [_finding(one) for one in told["findings"]],
        "notes": told["notes"],
        "before": told["before"],
        "after": told["after"],
        "model": None if told["model"] is None else os.path.relpath(told["model"], out),
        "seconds": seconds,
    }


def failed(verdict: str, error: str, seconds: float) -> dict[str, Any]:
    """Return the line of a log of which there is no diagnosis: ``"refused"``, or ``"crashed"`` by a bug or a lost process."""
    nothing: dict[str, Any] = {"findings": [], "notes": [], "before": {}, "after": {}, "model": None}
    return {"verdict": verdict, **nothing, "seconds": seconds, "error": error}


def _finding(one: Mapping[str, Any]) -> dict[str, Any]:
    names = ("effect", "instance", "probability", "parameters", "improvement", "unresolved_with")
    where = one["where"]
    return {
        **{name: one[name] for name in names},
        "rivals": one["rivals"][:RIVALS],
        "onset": where["onset"],
        "offset": where["offset"],
    }


def main(diagnosis: Callable[[Path, Path, Path], dict[str, Any]] = diagnosed) -> None:
    """Answer requests until standard input ends.

    Parameters
    ----------
    diagnosis
        What is asked of a log.
    """
    # An interrupt is for whoever asks, with whom this ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What libraries print must not come between the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    rooms = json.loads(sys.stdin.buffer.readline())
    # Read before the door is shut: what the answers are sealed with names the sources that diagnose.
    stamp = sources()
    python = python_rooms(Path(rooms["closed"]))
    kernel = landlock(
        Rooms((*python.reads, rooms["logs"]), (*python.writes, rooms["models"], rooms["temporary"])),
    )
    hook = Hook(Rooms(python.reads, (*python.writes, rooms["temporary"])))
    _answer(answers, {"guard": "landlock+audit" if kernel else "audit", "sources": stamp})

    from ferryid.diagnose import keep_to_one_thread
    from ferryid.files import finite

    keep_to_one_thread()
    for line in iter(_requests(sys.stdin.buffer).get, b""):
        request = json.loads(line)
        log, profile, out = (Path(request[name]) for name in ("log", "profile", "out"))
        hook.now(Rooms((str(log.parent),), (str(out),)))
        start = time.perf_counter()
        try:
            answer = diagnosis(log, profile, out)
        except UnwritableError as error:
            answer = {UNWRITABLE: str(error)}
        except Exception as error:  # noqa: BLE001 - a bug that one log shows is told in its line, and the others go on
            place = traceback.extract_tb(error.__traceback__)[-1]
            bug = one_line(f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")
            answer = failed("crashed", bug, time.perf_counter() - start)
        _answer(answers, finite(answer))


def _answer(stream: BinaryIO, answer: Mapping[str, Any]) -> None:
    stream.write(json.dumps(answer).encode() + b"\n")
    stream.flush()


def _requests(stream: BinaryIO) -> queue.SimpleQueue[bytes]:
    """Return a queue of lines; the process ends at once, also in the middle of a diagnosis, when whoever asks is gone."""
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def read() -> None:
        for line in stream:
            lines.put(line)
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    return lines


if __name__ == "__main__":
    main()
