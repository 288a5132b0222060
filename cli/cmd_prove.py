"""ferryid prove."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli.options import OUT, Json, Out
from ferryid.cli.output import emit, progress, tell


def command(
    seed: Annotated[
        int | None, typer.Option(help="Draw these cases, or go on with them; a fresh draw if left out.")
    ] = None,
    runs: Annotated[float, typer.Option(help="Runs of each size of each effect; other cells in proportion.")] = 1.0,
    only: Annotated[
        str,
        typer.Option(
            help="Cells (wind, clean, ...: see the page) or kinds of them, with commas between; all if left out."
        ),
    ] = "",
    processes: Annotated[int, typer.Option(help="Processes to share the work among.")] = 2,
    dask: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler whose workers do the work; they must share --out.")
    ] = None,
    check: Annotated[
        Path | None, typer.Option(help="Only hash the answers.json of this folder, and compare its seal.json.")
    ] = None,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Conceal physics in trials, diagnose them without the answers, and score what was found against these."""
    if check is not None:
        from ferryid.prove.seal import verified

        cases = verified(check)["cases"]
        typer.echo(f"{check}: the answers to {len(cases)} cases are those that were sealed")
        return
    from ferryid.prove.judges import parts
    from ferryid.prove.run import prove, render_proof

    cells = tuple(name.strip() for name in only.split(",") if name.strip())
    result = prove(
        out, parts(), seed=seed, runs=runs, only=cells, processes=processes, dask=dask, progress=progress, tell=tell
    )
    emit(result, render_proof(result), json)
