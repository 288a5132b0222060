"""Shared fixtures."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
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


@pytest.fixture(scope="session", autouse=True)
def nobody_waits_for_the_disk() -> Iterator[None]:
    """Sync nothing in this process: every result is synced, which takes minutes in all, and no test cuts the power.

    Where the order of what is synced is tested, calls are noted; processes that tests start do sync.
    """
    with pytest.MonkeyPatch.context() as patch:
        # What is no open file is an error still.
        patch.setattr(os, "fsync", lambda number: os.fstat(number) and None)
        yield


def pytest_collection_modifyitems(items: list[Any]) -> None:
    """Begin with the slow tests, one by one, and keep those together that share fixtures, or are quick, in a file.

    A worker that takes its last test early has nothing to do while the other one is at a slow test; a fixture of a file, and
    what a function in it keeps (`functools.cache`), is made again by every worker that takes a test of it.
    """
    for item in items:
        definitions = item._fixtureinfo.name2fixturedefs.values()
        shares = any(one[-1].scope in ("module", "class") for one in definitions) or _keeps(item.module)
        if shares or item.get_closest_marker("slow") is None:
            item.add_marker(pytest.mark.xdist_group(item.nodeid.partition("::")[0]))
    slow = {item.nodeid.partition("::")[0] for item in items if item.get_closest_marker("slow")}
    # Stable: files stay in their order, but that the two that compile most come first: nobody waits for what a worker compiles.
    items.sort(key=lambda item: (_compiles(item), item.nodeid.partition("::")[0] not in slow))


def _compiles(item: Any) -> int:
    """Return the place of a test among those that compile the simulators, which most others need; these come after them."""
    path, _, name = item.nodeid.partition("::")
    if path == "tests/simulate/test_reproducible.py":
        return 0
    return 1 if path == "tests/validation/test_case_sampling.py" and name.startswith("test_a_case_is_written") else 2


def _keeps(module: Any) -> bool:
    """Tell whether a file of tests has a function of its own whose results are kept."""
    return any(
        hasattr(one, "cache_clear") and getattr(one, "__module__", "") == module.__name__
        for one in vars(module).values()
    )


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Show how a test with a seed is repeated, and what tests give notice of, whether they passed or failed."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.stats.get(outcome, []):
            for name, value in report.user_properties:
                if name == "repeat":
                    terminalreporter.write_line(f"{report.nodeid} drew its cases from a seed; to repeat it: {value}")
                elif name == "notice":
                    terminalreporter.write_line(f"notice: {value}", yellow=True)
