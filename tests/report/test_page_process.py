"""The page of a fit, made by a second process: the same page, or none at all."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ferryid.diagnose import Diagnosis
from ferryid.identify import FitOutcome, FitSettings, fit_logs
from ferryid.report import diagnosis_figures, figures, fit_report, page_process
from ferryid.report.diagnosis_page import render
from ferryid.report.drawings import Drawings
from ferryid.report.page import Page, page_of
from ferryid.types import RunContext
from ferryid.vessel import load_profile
from tests.report.test_diagnosis import diagnosis

pytestmark = pytest.mark.slow

LOG = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"
COMMAND = ("ferryid", "fit", "a log.mcap")


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> FitOutcome:
    out = tmp_path_factory.mktemp("out")
    return fit_logs([str(LOG)], load_profile("milliampere"), FitSettings(components="3"), RunContext(out))


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch) -> Iterator[page_process.PageProcess]:
    """Return one as the command line starts it on two cores."""
    monkeypatch.setattr(page_process, "_allowed", True)
    monkeypatch.setattr(page_process, "_cores", lambda: 2)
    with page_process.started(page_process.PageProcess) as one:
        assert one is not None
        yield one


def undated(page: Page) -> Page:
    return (re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", "", page[0]), *page[1:])


def test_a_second_process_makes_the_same_page(
    result: FitOutcome, process: page_process.PageProcess, tmp_path: Path
) -> None:
    given = (result, tmp_path / "reports" / "milliampere-v1", tmp_path, COMMAND)
    found = process.page_of(*given)
    assert found is not None
    assert undated(found) == undated(page_of(*given))
    assert len(found[1]) >= 8
    assert "timeline.js" in found[2]


def test_where_the_process_was_killed_the_page_is_made_here(
    result: FitOutcome, process: page_process.PageProcess, tmp_path: Path
) -> None:
    os.kill(process._process.pid, signal.SIGKILL)
    folder = tmp_path / "reports" / "milliampere-v1"
    assert process.page_of(result, folder, tmp_path, COMMAND) is None
    fit_report._write_page(result, folder, {}, RunContext(tmp_path, command=COMMAND), process)
    assert "a log.mcap" in (folder / "report.html").read_text(encoding="utf-8")


class Ends:
    """Ends the process that reads it."""

    def __reduce__(self) -> tuple[Callable[[int], object], tuple[int]]:
        return os._exit, (3,)


def test_a_process_that_ends_at_its_request_makes_no_page(
    result: FitOutcome, process: page_process.PageProcess, tmp_path: Path
) -> None:
    command: Any = (Ends(),)
    assert process.page_of(result, tmp_path / "page", tmp_path, command) is None


def asked(monkeypatch: pytest.MonkeyPatch, one: Diagnosis, *, killed: bool = False) -> dict[str, dict[str, str]]:
    """Return the drawings that a process makes of a diagnosis, by what is asked for after it has begun."""
    monkeypatch.setattr(page_process, "_allowed", True)
    monkeypatch.setattr(page_process, "_cores", lambda: 2)
    with page_process.started(page_process.DrawingProcess) as process:
        assert process is not None
        if killed:
            os.kill(process._process.pid, signal.SIGKILL)
        process.begin((one,))
        later = {
            "same": (replace(one, notes=("learned",)),),
            "other findings": (replace(one, findings=tuple(map(replace, one.findings))),),
            "more": (one, one),
        }
        return {name: dict(process.drawings(some)) for name, some in later.items()}


def test_a_second_process_draws_what_a_diagnosis_found(monkeypatch: pytest.MonkeyPatch) -> None:
    one = diagnosis("explained")
    found = asked(monkeypatch, one)
    assert found["same"] == render((one,), "trial")[1]
    assert len(found["same"]) > 3
    assert found["other findings"] == found["more"] == {}


def test_where_the_process_was_killed_the_drawings_are_made_here(monkeypatch: pytest.MonkeyPatch) -> None:
    assert asked(monkeypatch, diagnosis("explained"), killed=True)["same"] == {}


def test_a_page_takes_the_drawings_that_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    one = diagnosis("explained")
    page, every = render((one,), "trial")
    monkeypatch.setattr(figures, "svg_text", None)
    monkeypatch.setattr(diagnosis_figures, "svg_text", None)
    assert render((one,), "trial", drawings=Drawings(every)) == (page, every)


def test_long_logs_are_not_handed_over(
    result: FitOutcome, process: page_process.PageProcess, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(page_process, "MOST_ROWS", len(result.logs[0].motion.t) - 1)
    assert process.page_of(result, tmp_path / "page", tmp_path, COMMAND) is None


def test_it_is_started_for_the_command_line_alone_and_ends_with_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page_process, "_cores", lambda: 2)
    with page_process.started(page_process.PageProcess) as one:
        assert one is None
    for allowed, cores, wanted in ((True, 2, False), (False, 2, True), (True, 1, True)):
        monkeypatch.setattr(page_process, "_allowed", allowed)
        monkeypatch.setattr(page_process, "_cores", lambda cores=cores: cores)
        with page_process.started(page_process.PageProcess, wanted) as one:
            assert one is None
    monkeypatch.setattr(page_process, "_allowed", True)
    monkeypatch.setattr(page_process, "_cores", lambda: 2)
    with page_process.started(page_process.PageProcess) as one:
        assert one is not None
        assert one._process.poll() is None
    assert one._process.poll() is not None


def test_the_command_line_draws_nothing_itself_on_two_cores(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "import ferryid.cli.main as line\n"
        "from ferryid.report import page_process\n"
        "page_process._cores = lambda: 2\n"
        "try: line.main()\n"
        "except SystemExit as end: assert not end.code\n"
        "assert 'matplotlib' not in sys.modules\n"
    )
    words = ("fit", str(LOG), "--vessel", "milliampere", "--components", "3", "--out", str(tmp_path))
    subprocess.run([sys.executable, "-c", program, *words], check=True, capture_output=True)
    assert (tmp_path / "reports" / "milliampere-v1" / "forces-short.svg").stat().st_size > 10_000
