"""Running the command line in this process."""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest

from ferryid.cli import main


@dataclass(frozen=True)
class Run:
    """Exit code and what was printed."""

    code: int
    out: str
    err: str


def invoke(*arguments: str | Path) -> Run:
    """Run ``ferryid <arguments>`` for a fixture that several tests share; what it prints is kept here."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", ["ferryid", *map(str, arguments)])
        code = exit_code()
    return Run(code, out.getvalue(), err.getvalue())


def exit_code() -> int:
    """Run ``ferryid`` with the words that `sys.argv` has, and return its exit code."""
    try:
        main.run()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 0 if stop.code is None else 1
    return 0
