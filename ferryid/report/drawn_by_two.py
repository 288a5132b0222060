"""The drawings of a page made by two processes: a forked copy of this one makes every other of them."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

from ferryid.report.drawings import Calls, drawn


def drawn_by_two(calls: Calls) -> dict[str, str]:
    """Return the drawings by the names of their files; what the copy fails at is made here.

    For a process that is about to end. One with other threads is not forked: a lock that they hold would stay held in the copy.
    """
    if not _alone():
        return drawn(calls)
    names = list(calls)
    end, begin = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            half = drawn({name: calls[name] for name in names[::2]})
            with os.fdopen(begin, "wb") as answers:
                pickle.dump(half, answers, protocol=5)
        finally:
            os._exit(0)
    os.close(begin)
    try:
        made = drawn({name: calls[name] for name in names[1::2]})
    finally:
        with os.fdopen(end, "rb") as answers:
            theirs = answers.read()
        os.waitpid(child, 0)
    try:
        made |= pickle.loads(theirs)
    except (EOFError, ValueError, pickle.UnpicklingError):  # it failed, and so will what it failed at
        made |= drawn({name: calls[name] for name in names[::2]})
    return {name: made[name] for name in names}


def _alone() -> bool:
    """Tell whether this process has one thread and can be forked; false where that is not known."""
    tasks = Path("/proc/self/task")
    return hasattr(os, "fork") and tasks.is_dir() and len(list(tasks.iterdir())) == 1
