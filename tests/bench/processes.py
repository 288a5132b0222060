"""The command line in a process of its own, as a person runs it."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence


def whole_process(
    arguments: Sequence[str], environment: Mapping[str, str] | None = None, before: str = "pass"
) -> tuple[float, int]:
    """Return time [s] and peak memory [bytes] of one command in a process of its own.

    Parameters
    ----------
    arguments
        Words of the command.
    environment
        What else is in its environment.
    before
        Python that it runs before.
    """
    # What the kernel tells of a child counts in the memory of the process that forked it: the child tells by itself.
    program = (
        "import atexit, sys; from ferryid.cli.main import main; "
        "atexit.register(lambda: print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0], file=sys.stderr)); "
        f"{before}; main()"
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


TWICE = """
import contextlib, io, json, sys, time
from ferryid.cli.main import main
took = []
for words in json.loads(sys.argv[1]):
    sys.argv = ["ferryid", *words]
    start = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main()
    took.append(time.perf_counter() - start)
print("took", *took)
"""
"""Runs commands in one process: the second has everything loaded and compiled."""


def floor(what: str, whole_s: float, first: Sequence[str], again: Sequence[str], packages: Sequence[str]) -> str:
    """Return what of a command's time nothing of ferryid can save, and what is the work itself, as a sentence.

    Parameters
    ----------
    what
        The command.
    whole_s
        What it takes as a process of its own [s].
    first, again
        Its words, and those of a second one that does the same work in the same process.
    packages
        What any program for this would import.
    """
    bare = [sys.executable, "-c", f"import {', '.join(packages)}"]
    alone = []
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run(bare, check=True)
        alone.append(time.perf_counter() - start)
    run = subprocess.run(
        [sys.executable, "-c", TWICE, json.dumps([first, again])], check=True, capture_output=True, text=True
    )
    work_s = float(run.stdout.rpartition("took")[2].split()[1])
    import_s = statistics.median(alone)
    return (
        f"{what}: of {whole_s:.2g} s, a process that only imports {', '.join(packages)} takes {import_s:.2g} s "
        f"({import_s / whole_s:.0%}), and the work itself, done a second time in one process, {work_s:.2g} s "
        f"({work_s / whole_s:.0%}). The rest is loading "
        "other modules and compiled code, and what is done once."
    )


PROFILED = """
import contextlib, cProfile, io, json, pstats, sys
from ferryid.cli.main import main
from ferryid.side_by_side import keep_to_one_thread
keep_to_one_thread()
def run(words):
    sys.argv = ["ferryid", *words]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main()
stages, commands = json.loads(sys.argv[1])
run(commands[0])
for words in commands[1:]:
    profile = cProfile.Profile()
    profile.runcall(run, words)
    found = pstats.Stats(profile)
    by_stage = dict.fromkeys(stages, 0.0)
    for (file, _, name), (_, _, own, whole, _) in found.stats.items():
        for stage in stages:
            folder, _, function = stage.rpartition(":")
            if name == function and folder in file:
                by_stage[stage] = max(by_stage[stage], whole)
    own = sorted(((value[2], f"{key[0].rpartition('/')[2]}:{key[2]}") for key, value in found.stats.items()), reverse=True)
    print("profiled", json.dumps({"total": found.total_tt, "stages": by_stage, "own": own[:20]}))
"""
"""Runs a command, and then others under a profiler, on one thread."""
SHOWN = 8
"""Functions that are listed by the time that they take themselves."""


def where(stages: Mapping[str, str], first: Sequence[str], measured: Mapping[str, Sequence[str]]) -> list[str]:
    """Return where the time of commands goes: by stage, and the functions that take most themselves; a sentence for each.

    Parameters
    ----------
    stages
        Functions whose time, all that they call included, is a stage's: ``part of the path:name`` by what the page says.
    first
        Words of a command after which everything is loaded and compiled.
    measured
        Words of the commands, by what they are.
    """
    arguments = json.dumps([list(stages.values()), [first, *measured.values()]])
    run = subprocess.run([sys.executable, "-c", PROFILED, arguments], capture_output=True, text=True, check=True)
    lines = [line for line in run.stdout.splitlines() if line.startswith("profiled ")]
    told = []
    for what, line in zip(measured, lines, strict=True):
        found = json.loads(line.partition(" ")[2])
        total = found["total"]
        parts = "; ".join(f"{title} {found['stages'][name] / total:.0%}" for title, name in stages.items())
        own = "; ".join(f"`{name}` {took / total:.0%}" for took, name in found["own"][:SHOWN])
        told.append(
            f"Where the time of {what} goes, on one thread: {parts}. By function, without what it calls: {own}."
        )
    return told
