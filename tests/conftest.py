"""Shared fixtures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture
def shared_data() -> Callable[[str], Path]:
    """Return the path of a real recording, or skip the test where the recordings are absent."""

    def locate(relative: str) -> Path:
        path = SHARED_DATA / relative
        if not path.exists():
            pytest.skip(f"real recording not here: {relative}")
        return path

    return locate


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Show how a test with a seed is repeated, and what tests give notice of, whether they passed or failed."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.stats.get(outcome, []):
            for name, value in report.user_properties:
                if name == "repeat":
                    terminalreporter.write_line(f"{report.nodeid} drew its cases from a seed; to repeat it: {value}")
                elif name == "notice":
                    terminalreporter.write_line(f"notice: {value}", yellow=True)
