"""Shared fixtures."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path
from typing import Any

import pytest

# Before NumPy is loaded: the commands use one thread, and a second one only waits on problems of this size, at full power.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")
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


@pytest.fixture(scope="session", autouse=True)
def one_thread_beside_another_worker() -> None:
    """Keep ingestion, fits and diagnoses in this process to one thread where other workers have the other cores.

    Threads on cores that are taken cost a fifth of a diagnosis. Commands and notebooks that tests start have theirs.
    """
    if WORKER:
        from ferryid.side_by_side import keep_to_one_thread

        keep_to_one_thread()


# But for tests that are marked as blank.
DRAWN = ("tests/report/", "tests/reproduce/", "tests/proof/", "tests/real/")
NOT_DRAWN = "not drawn: see tests/conftest.py"
BLANK = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"><title>{NOT_DRAWN}</title></svg>\n'


@pytest.fixture(scope="session", autouse=True)
def figures_are_drawn_where_they_are_looked_at(pytestconfig: pytest.Config) -> Iterator[None]:
    """Put figures together in every test, but write them as SVG only where a test looks at them, or at a real recording.

    Most commands write a page of ten to thirty figures, which takes most of the time of a fit of a short log.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    draw = FigureCanvasSVG.print_svg

    # Its signature is looked at.
    @wraps(draw)
    def print_svg(canvas: Any, filename: Any, **options: Any) -> None:
        if pytestconfig.stash[DRAWS]:
            draw(canvas, filename, **options)
        elif hasattr(filename, "write"):
            filename.write(BLANK)
        else:
            Path(filename).write_text(BLANK, encoding="utf-8")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FigureCanvasSVG, "print_svg", print_svg)
        yield


DRAWS = pytest.StashKey[bool]()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: Any) -> None:
    """Choose whether figures are drawn, before the fixtures of a file are made, which may write pages."""
    item.config.stash[DRAWS] = _draws(item)


def _draws(item: Any) -> bool:
    """Tell whether a test needs figures as they are."""
    if item.get_closest_marker("blank") is not None:
        return False
    return (
        item.get_closest_marker("draws") is not None
        or item.nodeid.startswith(DRAWN)
        or "shared_data" in item.fixturenames
    )


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Iterator[None]:
    """Look for no garbage while tests are collected, nor afterwards among what that has left: it stays until the end.

    The eight thousand tests and the modules are most of what a collection of garbage would go through, a second each time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Iterator[None]:
    """Let every other worker collect from the end.

    Each file is compiled, with what pytest adds to its assertions, by the first that gets to it: two that begin at the same end
    both compile all of them.
    """
    report: Any = yield
    if isinstance(collector, pytest.Session | pytest.Directory) and WORKER.removeprefix("gw") in BACKWARDS:
        report.result.reverse()
    return report


BACKWARDS = tuple("13579")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[Any]) -> None:
    """Begin with the files that have slow tests; a worker that takes its last file early has little to wait for.

    A file is the work of one worker (`--dist loadfile`): its fixtures, and what functions in it keep, are made once.
    """
    slow = {item.nodeid.partition("::")[0] for item in items if item.get_closest_marker("slow")}
    # Tests of a file stay in their order. The two that compile most come first: nobody waits for what a worker compiles.
    items.sort(key=lambda item: _place(item.nodeid.partition("::")[0], slow))


def _place(path: str, slow: set[str]) -> tuple[int, str]:
    """Return the place of a file, the same whichever way it was collected: those first that compile what most others need."""
    if path in COMPILE:
        return COMPILE.index(path), path
    return len(COMPILE) + (path not in slow), path


COMPILE = ("tests/simulate/test_reproducible.py", "tests/validation/test_case_sampling.py")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Show how a test with a seed is repeated, and what tests give notice of, whether they passed or failed."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.stats.get(outcome, []):
            for name, value in report.user_properties:
                if name == "repeat":
                    terminalreporter.write_line(f"{report.nodeid} drew its cases from a seed; to repeat it: {value}")
                elif name == "notice":
                    terminalreporter.write_line(f"notice: {value}", yellow=True)
