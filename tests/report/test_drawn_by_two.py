"""Drawings made by a process and its copy: the same as by one, each made once."""

from __future__ import annotations

import json
import subprocess
import sys
import threading

import pytest

from ferryid.report import drawn_by_two

PROGRAM = """
import json, os
from functools import partial
from ferryid.report.drawn_by_two import drawn_by_two

own = os.getpid()

def draw(name):
    if {fails} and os.getpid() != own:
        raise ValueError(name)
    return f"{{name}} {{'here' if os.getpid() == own else 'beside'}}"

print(json.dumps(list(drawn_by_two({{name: partial(draw, name) for name in "abcde"}}).values())))
"""


def drawn(*, fails: bool) -> list[str]:
    program = PROGRAM.format(fails=fails)
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return list(json.loads(run.stdout))


@pytest.mark.skipif(sys.platform != "linux", reason="threads of a process are counted on Linux alone")
def test_a_copy_makes_every_other_drawing() -> None:
    assert drawn(fails=False) == ["a beside", "b here", "c beside", "d here", "e beside"]


def test_what_the_copy_fails_at_is_drawn_here() -> None:
    assert drawn(fails=True) == ["a here", "b here", "c here", "d here", "e here"]


def test_a_process_with_other_threads_is_not_copied(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fork", None)
    ended = threading.Event()
    other = threading.Thread(target=ended.wait)
    other.start()
    try:
        assert drawn_by_two.drawn_by_two({"a": lambda: "a"}) == {"a": "a"}
    finally:
        ended.set()
        other.join()
