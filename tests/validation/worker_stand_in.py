"""Stand-ins for a diagnosis: `python -m tests.validation.worker_stand_in` takes the place of the worker.

It reports all that it was given; with ``--mortal`` it dies in the middle of requests.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from pathlib import Path

from ferryid import side_by_side
from ferryid.validation import worker
from ferryid.validation.records import Diagnosis


def report(log: Path, profile: Path, out: Path) -> Diagnosis:
    (out / "model.json").write_text("{}")
    given = {
        "arguments": [str(log), str(profile), str(out)],
        "environment": dict(os.environ),
        "command": sys.argv,
        "folder": os.getcwd(),
        "temporary": tempfile.gettempdir(),
        "cores": side_by_side.usable_cores(),
    }
    return Diagnosis("matched", 0.0, before=given)


def mortal(log: Path, profile: Path, out: Path) -> Diagnosis:
    """Die at the first request for a log called ``once``, at each for one called ``always``; sleep over ``slow``."""
    if log.stem == "once" and not (out / "seen").exists():
        (out / "seen").write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    if log.stem == "always":
        os._exit(7)
    if log.stem == "slow":
        time.sleep(60.0)
    if log.stem == "bug":
        return Diagnosis("matched", 1 / 0)
    sys.stdout.write("libraries print what they like\n")
    sys.stdout.flush()
    return Diagnosis("matched", 0.0, before={"pid": os.getpid(), "value": float("nan")})


if __name__ == "__main__":
    worker.main(mortal if "--mortal" in sys.argv else report)
