"""Running the command line in this process."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest

from ferryid.cli import main

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


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
        code = _exit_code()
    return Run(code, out.getvalue(), err.getvalue())


@pytest.fixture
def ferryid(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Run]:
    """Return a function that runs ``ferryid <arguments>``."""

    def run(*arguments: str | Path) -> Run:
        monkeypatch.setattr(sys, "argv", ["ferryid", *map(str, arguments)])
        capsys.readouterr()
        code = _exit_code()
        printed = capsys.readouterr()
        return Run(code, printed.out, printed.err)

    return run


def _exit_code() -> int:
    try:
        main.run()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 0 if stop.code is None else 1
    return 0


@pytest.fixture(scope="session")
def fixtures() -> Path:
    """Folder of the small logs."""
    return FIXTURES
