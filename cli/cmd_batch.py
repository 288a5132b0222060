"""ferryid batch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli.options import OUT, From, Json, Out, To, Vessel, ranges
from ferryid.cli.output import emit, progress, tell


def command(
    logs: Annotated[
        list[str],
        typer.Argument(
            help='Patterns in quotes ("season/**/*.mcap"), logs, or a manifest: a CSV table with a column log, and vessel, '
            "date or note if you like, or a text file with a path a line."
        ),
    ],
    recipe: Annotated[
        Path | None,
        typer.Option(help="TOML file: which steps, with which settings; all with their defaults if left out."),
    ] = None,
    vessel: Vessel = None,
    from_: From = None,
    to: To = None,
    processes: Annotated[int, typer.Option(help="Processes to share the logs among.")] = 2,
    dask: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler whose workers do the work; they must share logs and --out."),
    ] = None,
    memory: Annotated[
        str, typer.Option(help="Most memory of one process; a log that needs more is marked in its row.")
    ] = "4G",
    again: Annotated[bool, typer.Option("--again", help="Try again what went wrong before.")] = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Fit, evaluate and diagnose every log of an archive; what is done stays done, whatever interrupts it."""
    from ferryid import api

    outcome = api.batch(
        logs, out, vessel=vessel or None, recipe=recipe, processes=processes, dask=dask, memory_limit=memory, again=again,
        ranges=ranges(from_, to), progress=progress, tell=tell,
    )  # fmt: skip
    emit(outcome, json)
    counts = outcome.json["counts"]
    if not counts["done"] + counts["partly"]:
        raise typer.Exit(2)
