"""The command line as a fixture."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.command_line.in_process import Run, exit_code

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


@pytest.fixture
def ferryid(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Run]:
    """Return a function that runs ``ferryid <arguments>``."""

    def run(*arguments: str | Path) -> Run:
        monkeypatch.setattr(sys, "argv", ["ferryid", *map(str, arguments)])
        capsys.readouterr()
        code = exit_code()
        printed = capsys.readouterr()
        return Run(code, printed.out, printed.err)

    return run


@pytest.fixture(scope="session")
def fixtures() -> Path:
    """Folder of the small logs."""
    return FIXTURES


@pytest.fixture
def batch_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a batch work in this process; what it does in others is tested in tests/batch."""
    from tests.batch.archive import stay_here

    stay_here(monkeypatch)
