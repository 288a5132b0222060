"""Printing: results to standard output, progress to standard error."""

from __future__ import annotations

import shutil
import sys
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


def progress(stage: str) -> None:
    """Show the present stage on a terminal, nothing when piped; an empty stage clears the line."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\033[K{one_line(stage)}")
        sys.stderr.flush()


def tell(line: str) -> None:
    """Print a line that is no result to standard error, above the present stage."""
    progress("")
    typer.echo(one_line(line), err=True)
