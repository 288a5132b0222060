"""Code blocks in the documents run: python as it stands, console commands with the output that is shown."""

from __future__ import annotations

import doctest
import os
import re
import shlex
import subprocess
import sys
from decimal import Decimal
from pathlib import Path

import pytest

from tests.command_line.in_process import Run, invoke
from tests.docs.pages import PAGES, ROOT, Block, Call, blocks, calls

RUN = ("python", "console")
LONGEST_S = 1800.0
DECIMAL = re.compile(r"\d+\.\d+")


def _cases() -> list[object]:
    """Return the pages that have something to run; what follows a slow block on its page may need what that has left."""
    cases = []
    for page in PAGES:
        run = [one for one in blocks(page) if one.language in RUN]
        slow = [pytest.mark.slow] if any(one.slow for one in run) else []
        if run:
            cases.append(pytest.param(page, run, id=page.relative_to(ROOT).as_posix(), marks=slow))
    return cases


def agrees(shown: str, printed: str) -> bool:
    """Tell whether printed lines are those shown, where ``...`` stands for anything, also in a line.

    Decimals may differ by two of their last digit: machines round a fit differently.
    """
    lines = [line.rstrip() for line in printed.strip().splitlines()]
    wanted = [line.rstrip() for line in shown.strip().splitlines()]
    return _matched(wanted, lines)


def _matched(wanted: list[str], lines: list[str]) -> bool:
    if not wanted:
        return not lines
    if wanted[0] == "...":
        return any(_matched(wanted[1:], lines[k:]) for k in range(len(lines) + 1))
    if not lines:
        return False
    one = doctest.OutputChecker().check_output(wanted[0] + "\n", lines[0] + "\n", doctest.ELLIPSIS)
    return (one or _rounded(wanted[0], lines[0])) and _matched(wanted[1:], lines[1:])


def _rounded(wanted: str, line: str) -> bool:
    """Tell whether two lines are the same but for the last digits of their decimals."""
    if DECIMAL.sub("", wanted) != DECIMAL.sub("", line):
        return False
    pairs = zip(DECIMAL.findall(wanted), DECIMAL.findall(line), strict=True)
    return all(
        len(a) == len(b) and abs(Decimal(a) - Decimal(b)) <= 2 * Decimal(1).scaleb(-len(a.partition(".")[2]))
        for a, b in pairs
    )


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("at 717.4 s", "at 717.3 s", True),
        ("at 717.4 s", "at 717.1 s", False),
        ("at 717.4 s", "at 717 s", False),
        ("7 logs", "8 logs", False),
        ("a 1.0 b", "a 1.0 c", False),
    ],
)
def test_decimals_may_differ_by_what_machines_round(shown: str, printed: str, same: bool) -> None:
    assert agrees(shown, printed) is same


def called(call: Call, folder: Path) -> None:
    """Run a command in a folder, where the tests are already, and hold what it prints against what is shown."""
    words = shlex.split(call.command)
    # Without a process that begins by importing everything, but where a shell has something to do.
    here = words[0] == "ferryid" and shlex.join(words) == call.command and words != ["ferryid", "--help"]
    run = invoke(*words[1:]) if here else in_a_shell(call.command, folder)
    assert run.code == 0, f"{call.command}: exit code {run.code}\n{run.err}"
    assert agrees(call.shown, run.out), f"{call.command} is shown with\n{call.shown}\nand printed\n{run.out}"


def in_a_shell(command: str, folder: Path) -> Run:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )
    return Run(run.returncode, run.stdout, run.stderr)


@pytest.mark.slow
@pytest.mark.parametrize(("page", "run"), _cases())
def test_blocks_of_a_page_run_in_order(
    page: Path, run: list[Block], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "fixtures").symlink_to(ROOT / "fixtures")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    names: dict[str, object] = {"__name__": "page"}
    for block in run:
        if block.language == "python":
            # Lines as on the page, for tracebacks; a module of that name, for dataclasses.
            code = compile("\n" * block.line + block.text, str(page), "exec")
            monkeypatch.setitem(sys.modules, "page", type(sys)("page"))
            exec(code, names)
        else:
            for call in calls(block):
                called(call, tmp_path)


def test_every_fence_has_a_language() -> None:
    assert [f"{page.name}:{one.line}" for page in PAGES for one in blocks(page) if not one.language] == []


def test_output_is_compared_line_by_line() -> None:
    assert agrees("a\n...\nd", "a\nb\nc\nd\n")
    assert agrees("a ... c\n...", "a b c\n")
    assert agrees("...", "")
    assert not agrees("a\n...\nd", "a\nb\nc\n")
    assert not agrees("a", "a\nb\n")
    assert not agrees("a 1.0", "a 1.5\n")
