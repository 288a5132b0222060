"""The drawings of a page made by two processes: a forked copy of this one makes every other of them."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import ParamSpec, TypeVar

from ferryid.report.drawings import Drawings

P = ParamSpec("P")
Page = TypeVar("Page")


@dataclass(frozen=True)
class _Half(Drawings):
    """Every other drawing that a page asks for; the others are left empty."""

    first: int = 0
    made: dict[str, str] = field(default_factory=dict)
    _asked: list[str] = field(default_factory=list)

    def of(self, file: str, draw: Callable[P, str], *args: P.args, **named: P.kwargs) -> str:
        self._asked.append(file)
        if len(self._asked) % 2 == self.first:
            self.made[file] = draw(*args, **named)
        return self.made.get(file, "")


def drawn_by_two(page: Callable[[Drawings], Page]) -> Page:
    """Return what `page` makes of its drawings, half of which a forked process makes; what that one fails at is made here.

    For a process that is about to end. One with other threads is not forked: a lock that they hold would stay held in the copy.
    """
    if not _alone():
        return page(Drawings())
    end, begin = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            half = _Half(first=1)
            page(half)
            with os.fdopen(begin, "wb") as answers:
                pickle.dump(half.made, answers, protocol=5)
        finally:
            os._exit(0)
    os.close(begin)
    made = _Half()
    try:
        page(made)
    finally:
        with os.fdopen(end, "rb") as answers:
            theirs = answers.read()
        os.waitpid(child, 0)
    try:
        drawn = pickle.loads(theirs)
    except (EOFError, ValueError, pickle.UnpicklingError):  # it failed, and so will what it failed at
        drawn = {}
    return page(Drawings({**made.made, **drawn}))


def _alone() -> bool:
    """Tell whether this process has one thread and can be forked; false where that is not known."""
    tasks = Path("/proc/self/task")
    return hasattr(os, "fork") and tasks.is_dir() and len(list(tasks.iterdir())) == 1
