"""Where the time of a process goes: the step that its main thread is in, looked at every few milliseconds while it runs.

The measured process imports this before anything else, so that nothing heavy is imported here. What looks is a timer's signal
and no thread: a process with threads is not forked for its drawings (`ferryid.report.drawn_by_two`), and would be another one.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import CodeType, FrameType

LOADING = {
    "loading modules": ("importlib._bootstrap>:_find_and_load",),
    "loading or compiling loops": (
        "/numba/core/dispatcher.py:compile",
        "/numba/core/dispatcher.py:_compile_for_args",
        "/ferryid/compiler.py:dispatcher_of",
        "/ferryid/compiler.py:callback",
    ),
}
"""Steps of every command, as `begin` takes them."""
REST = "the rest"
LOOPS = f"{os.sep}ferryid{os.sep}compiled.py"
"""Where compiled loops are called."""


def begin(steps: Mapping[str, Sequence[str]], interval_s: float) -> Callable[[], None]:
    """Look at the main thread from now on, and return what ends that and prints what was seen as the last line of errors.

    Parameters
    ----------
    steps
        Functions of each step, as ``part of the path:name``. What is called within one is of it, but for what is of a step that
        was entered later.
    interval_s
        Time between two looks [s].
    """
    every = {**LOADING, **steps}
    known = [(*function.rsplit(":", 1), step) for step, functions in every.items() for function in functions]
    own = f"{os.sep}ferryid{os.sep}"
    step_of, took, functions = dict[CodeType, str](), Counter[str](), Counter[str]()
    start = last = time.perf_counter()
    looks, looks_s, loops_s = 0, 0.0, 0.0

    def step(code: CodeType) -> str:
        if code not in step_of:
            step_of[code] = next(
                (of for part, name, of in known if name == code.co_name and part in code.co_filename), ""
            )
        return step_of[code]

    def look(_signal: int, frame: FrameType | None) -> None:
        nonlocal last, looks, looks_s, loops_s
        now = time.perf_counter()
        if frame is not None and frame.f_code.co_filename.endswith(LOOPS):
            loops_s += now - last
        found, function = REST, ""
        while frame is not None:
            code = frame.f_code
            # A compiled loop is a part of what calls it.
            if not function and own in code.co_filename and not code.co_filename.endswith("compiled.py"):
                function = f"{os.path.basename(code.co_filename)}:{code.co_name}"
            if step(code):
                found = step(code)
                break
            frame = frame.f_back
        # A call that is not interrupted delays the look: the time since the last one is its.
        took[found] += now - last
        if function:
            functions[function] += now - last
        last = now
        looks, looks_s = looks + 1, looks_s + time.perf_counter() - now

    def end() -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        seen_s = time.perf_counter() - start
        # Threads and processes that have ended count, and what the kernel did for them.
        processor = os.times()
        made = {
            "seen_s": seen_s,
            "processor_s": sum(processor[:4]),
            "looks": looks,
            "looks_s": looks_s,
            "loops_s": loops_s,
        }
        made |= {"steps": took, "functions": functions}
        print(f"sampled {json.dumps(made)}", file=sys.stderr, flush=True)

    signal.signal(signal.SIGALRM, look)
    signal.setitimer(signal.ITIMER_REAL, interval_s, interval_s)
    return end
