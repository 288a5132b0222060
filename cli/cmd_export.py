"""ferryid export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli.completion import format_names, model_names, model_or_log
from ferryid.cli.options import OUT, From, Json, Out, Vessel, ranges
from ferryid.cli.output import emit, progress, tell
from ferryid.export.formats import names


def command(
    what: Annotated[
        str,
        typer.Argument(
            autocompletion=model_or_log,
            metavar="MODEL|LOG",
            help="Path, name or name@version of a model; with --mcap a log.",
        ),
    ],
    to: Annotated[
        str | None,
        typer.Option(
            autocompletion=format_names,
            help=f"Form of a model: {', '.join(names())}; with --mcap the end of the range.",
        ),
    ] = None,
    file: Annotated[Path | None, typer.Option(help="File for a model; one in exports/ of --out if left out.")] = None,
    mcap: Annotated[Path | None, typer.Option(help="MCAP file for a log: its forces, motion and findings.")] = None,
    model: Annotated[
        str | None, typer.Option(autocompletion=model_names, help="With --mcap: the model to compare with the log.")
    ] = None,
    vessel: Vessel = None,
    from_: From = None,
    diagnosis: Annotated[Path | None, typer.Option(help="With --mcap: JSON of ferryid diagnose on this log.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an export that is there.")] = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Write a model as code or parameters for other programs, or with --mcap a log and its forces for a viewer."""
    from ferryid import api
    from ferryid.export.commands import notes

    used = ranges(from_, None if mcap is None else to)
    outcome = api.export(
        what, out, to=to if mcap is None else None, file=file, mcap=mcap, model=model, vessel=vessel or None,
        diagnosis=diagnosis, overwrite=overwrite, json=None if json in (None, "-") else Path(json), ranges=used,
        progress=progress, announce=tell,
    )  # fmt: skip
    for note in notes(outcome.json):
        tell(f"ferryid: {note}")
    emit(outcome, json)
