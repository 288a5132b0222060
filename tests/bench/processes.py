"""The command line in a process of its own, as a person runs it."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from tests.bench import sampled
from tests.bench.page import duration


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
    took, much, _ = _run(arguments, environment, f"from ferryid.cli.main import main; {before}; main()")
    return took, much


def _run(arguments: Sequence[str], environment: Mapping[str, str] | None, program: str) -> tuple[float, int, str]:
    """Return time [s], peak memory [bytes] and errors of Python that runs a command."""
    # What the kernel says of a child counts in the memory of the process that forked it: the child says it by itself.
    peak = (
        "import atexit, sys; "
        "atexit.register(lambda: print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0], file=sys.stderr))"
    )
    start = time.perf_counter()
    run = subprocess.run(
        [sys.executable, "-c", f"{peak}; {program}", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **(environment or {})},
    )
    took = time.perf_counter() - start
    if run.returncode:
        raise RuntimeError(f"ferryid {' '.join(arguments)} ended with {run.returncode}: {run.stderr}")
    return took, int(run.stderr.split()[-1]) * 1024, run.stderr


LARGEST = 3
"""Steps that are named of what limits a command."""
SHOWN = 8
"""Functions that are listed by the time that they take."""
LEAST_SHARE = 0.01
"""Steps that take less of the whole are of the rest."""
INTERVAL_S = 0.01
"""Time between two looks at a process [s]."""
SHORT_INTERVAL_S = 0.002
"""The same for processes of a second or two."""


@dataclass(frozen=True)
class Sampled:
    """A command in a process of its own, and where its time went.

    Attributes
    ----------
    took_s
        Its time [s].
    peak
        Its peak memory [bytes].
    steps
        Of that time, what the main thread spent in each step [s]: starting and ending Python, loading, the command's own.
    functions
        The same by function of ferryid, with what it calls outside ferryid [s].
    processor_s
        Processor time of all of its threads and processes [s].
    looks, looks_s
        How often it was looked at, and what that took [s].
    loops_s
        Of its time, what the main thread spent within compiled loops [s].
    """

    took_s: float
    peak: int
    steps: Mapping[str, float]
    functions: Mapping[str, float]
    processor_s: float
    looks: int
    looks_s: float
    loops_s: float

    @property
    def largest(self) -> str:
        """The steps that take most, as a sentence."""
        most = sorted(self.steps.items(), key=lambda one: -one[1])[:LARGEST]
        return f"Its largest steps are {', '.join(f'{step} ({duration(took)})' for step, took in most)}."

    @property
    def limit(self) -> str:
        """What it could be with all cores busy throughout, and what takes most, as sentences."""
        return f"With all cores busy throughout, its processor time would take {duration(self.busy_s)}. {self.largest}"

    @property
    def busy_s(self) -> float:
        """What it would take if all cores were busy throughout [s]."""
        return self.processor_s / (os.cpu_count() or 1)

    def where(self, what: str) -> str:
        """Return where the time went, as sentences; `what` is the command."""
        shown = {step: took for step, took in self.steps.items() if took >= LEAST_SHARE * self.took_s}
        parts = ", ".join(f"{step} {duration(took)}" for step, took in shown.items())
        most = sorted(self.functions.items(), key=lambda one: -one[1])[:SHOWN]
        names = ", ".join(f"`{name}` {took / self.took_s:.0%}" for name, took in most)
        cores, rest_s = os.cpu_count() or 1, max(self.took_s - sum(shown.values()), 0.0)
        loops = ""
        if self.loops_s >= LEAST_SHARE * self.took_s:
            loops = f" Compiled loops alone keep the main thread for {duration(self.loops_s)}."
        return (
            f"Where the {duration(self.took_s)} of {what} go, by {self.looks} looks at the main thread, which took "
            f"{duration(self.looks_s)}: {parts}, the rest {duration(rest_s)}. All of its threads and processes take "
            f"{duration(self.processor_s)} of processor time: with {cores} cores busy throughout it would take "
            f"{duration(self.busy_s)}.{loops} By function, with what it calls outside ferryid: {names}."
        )


def sampled_process(
    arguments: Sequence[str], steps: Mapping[str, Sequence[str]], before: str = "pass", interval_s: float = INTERVAL_S
) -> Sampled:
    """Return time and memory of one command in a process of its own, and where the time of its main thread went.

    Parameters
    ----------
    arguments, before
        As of `whole_process`.
    steps
        Functions of each step, as of `tests.bench.sampled.begin`.
    interval_s
        Time between two looks [s].
    """
    program = (
        f"from tests.bench import sampled; atexit.register(sampled.begin({dict(steps)!r}, {interval_s})); "
        f"from ferryid.cli.main import main; {before}; main()"
    )
    took, much, errors = _run(arguments, None, program)
    found = json.loads(next(line for line in errors.splitlines() if line.startswith("sampled ")).partition(" ")[2])
    by_step = {"starting and ending Python": max(took - found["seen_s"], 0.0)}
    by_step |= {step: found["steps"][step] for step in (*sampled.LOADING, *steps) if step in found["steps"]}
    more = (found[name] for name in ("functions", "processor_s", "looks", "looks_s", "loops_s"))
    return Sampled(took, much, by_step, *more)


def middle(runs: Sequence[Sampled]) -> Sampled:
    """Return the middle one of several runs of a command by their time, with the most memory of all."""
    return replace(sorted(runs, key=lambda run: run.took_s)[len(runs) // 2], peak=max(run.peak for run in runs))


@dataclass(frozen=True)
class Imports:
    """A process that only imports packages: their names, and what it takes [s]."""

    packages: Sequence[str]
    took_s: float

    def floor(self, what: str, run: Sampled) -> str:
        """Return where a command's time goes, and what of it nothing of ferryid can save, as sentences."""
        return f"{run.where(what)} {self.says} ({self.took_s / run.took_s:.0%})."

    @property
    def says(self) -> str:
        """What it takes, as the beginning of a sentence."""
        return f"A process that only imports {', '.join(self.packages)} takes {duration(self.took_s)}"

    def limit(self, run: Sampled, allowed_s: float) -> str:
        """Return what limits a command that may take so long [s], as sentences."""
        return f"{self.says}, of the {duration(allowed_s)} that the goal comes to. {run.largest}"


def imports(packages: Sequence[str], repeats: int = 3) -> Imports:
    """Measure the import of what any program of a kind would import, so often; the median counts."""
    bare = [sys.executable, "-c", f"import {', '.join(packages)}"]
    alone = []
    for _ in range(repeats):
        start = time.perf_counter()
        subprocess.run(bare, check=True)
        alone.append(time.perf_counter() - start)
    return Imports(packages, statistics.median(alone))
