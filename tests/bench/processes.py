"""The command line in a process of its own, as a person runs it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence


def whole_process(arguments: Sequence[str], environment: Mapping[str, str] | None = None) -> tuple[float, int]:
    """Return time [s] and peak memory [bytes] of one command in a process of its own, with more in its environment."""
    # What the kernel tells of a child counts in the memory of the process that forked it: the child tells by itself.
    program = (
        "import atexit, sys; from ferryid.cli.main import main; "
        "atexit.register(lambda: print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0], file=sys.stderr)); "
        "main()"
    )
    start = time.perf_counter()
    run = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **(environment or {})},
    )
    took = time.perf_counter() - start
    if run.returncode:
        raise RuntimeError(f"ferryid {' '.join(arguments)} ended with {run.returncode}: {run.stderr}")
    return took, int(run.stderr.split()[-1]) * 1024
