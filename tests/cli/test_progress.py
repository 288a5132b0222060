"""The line of the present stage on a terminal: how long the command has run, and what stands after it."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ferryid.cli import output
from ferryid.cli.output import StageLine, told_seconds
from tests.command_line.in_process import Run


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[StageLine]:
    """Return the line on what is taken for a terminal."""
    line = StageLine()
    monkeypatch.setattr(output, "_line", line)
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True, raising=False)
    yield line
    line.show("")


def test_a_stage_tells_how_long_the_command_has_run(terminal: StageLine, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = time.monotonic()
    terminal.show("locating")
    assert terminal.text() == "locating"
    monkeypatch.setattr(output.time, "monotonic", lambda: begun + 72.5)
    assert terminal.text() == "locating (1:12 min so far)"


def test_a_long_stage_stays_on_its_line(terminal: StageLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    terminal.show("comparing on " + "x" * 100)
    assert len(terminal.text()) == 39
    assert terminal.text().endswith("…")


def test_the_clock_goes_on_while_a_stage_lasts(
    terminal: StageLine, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(StageLine, "SHOWN_S", 0.0)
    output.progress("locating")
    time.sleep(1.3)
    output.progress("")
    time.sleep(1.1)
    drawn = capsys.readouterr().err.split("\r\033[K")
    assert drawn == ["", "locating (0 s so far)", "locating (1 s so far)", ""]


@pytest.mark.usefixtures("terminal")
def test_an_error_stands_on_a_line_of_its_own(ferryid: Callable[..., Run], tmp_path: Path) -> None:
    log = tmp_path / "broken.mcap"
    log.write_bytes(b"\x89MCAP0\r\n")
    told = ferryid("fit", log, "--vessel", "milliampere", "--out", tmp_path / "out").err
    assert re.search(r"\r\033\[Kferryid: ", told), told


def test_seconds_in_words() -> None:
    assert [told_seconds(one) for one in (0.9, 59.9, 60.0, 3725.0)] == ["0 s", "59 s", "1:00 min", "62:05 min"]
