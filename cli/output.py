"""Printing: results to standard output, progress to standard error."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ferryid.errors import one_line, printable

if TYPE_CHECKING:
    from ferryid.report.outcome import Outcome


def emit(outcome: Outcome, json: str | None) -> None:
    """Print a result as text, or with ``--json -`` as JSON instead; with ``--json FILE`` also write the JSON there."""
    from ferryid.files import dump_json, write_result

    if json == "-":
        typer.echo(dump_json(outcome.json), nl=False)
        return
    if json is not None:
        write_result(Path(json), dump_json(outcome.json))
    typer.echo(printable(outcome.text, keep="\n"))


def text_width() -> int:
    """Columns of the terminal, at least 80; 160 when the output goes elsewhere."""
    return max(80, shutil.get_terminal_size((160, 24)).columns)


class StageLine:
    """The present stage on a terminal, and for how long the command has run; drawn again every second.

    A stage may last for minutes: a clock that goes on says that the command does.
    """

    SHOWN_S = 2.0
    """Time from which on it is told."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._stage = ""
        self._begun = time.monotonic()
        self._clock: threading.Thread | None = None

    def show(self, stage: str) -> None:
        """Show a stage; an empty one clears the line."""
        with self._lock:
            self._stage = one_line(stage)
            self._draw()
            if self._stage and self._clock is None:
                self._clock = threading.Thread(target=self._tick, daemon=True)
                self._clock.start()

    def text(self) -> str:
        """Return what stands there, no longer than a line, as only one line can be cleared."""
        seconds = time.monotonic() - self._begun
        since = f" ({told_seconds(seconds)} so far)" if seconds >= self.SHOWN_S else ""
        room = max(20, shutil.get_terminal_size((80, 24)).columns - 1 - len(since))
        stage = self._stage if len(self._stage) <= room else f"{self._stage[: room - 1]}…"
        return f"{stage}{since}"

    def _draw(self) -> None:
        sys.stderr.write(f"\r\033[K{self.text() if self._stage else ''}")
        sys.stderr.flush()

    def _tick(self) -> None:
        while True:
            time.sleep(1.0)
            with self._lock:
                if self._stage:
                    self._draw()


_line = StageLine()


def progress(stage: str) -> None:
    """Show the present stage on a terminal, nothing when piped; an empty stage clears the line."""
    if sys.stderr.isatty():
        _line.show(stage)


def told_seconds(seconds: float) -> str:
    """Return a time that has passed, such as ``1:05 min``."""
    whole = int(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60}:{whole % 60:02d} min"


def tell(line: str) -> None:
    """Print a line that is no result to standard error, above the present stage."""
    progress("")
    typer.echo(one_line(line), err=True)
