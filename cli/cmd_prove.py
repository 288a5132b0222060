"""ferryid prove."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli.completion import effect_names
from ferryid.cli.options import OUT, Json, Out, Vessel
from ferryid.cli.output import emit, progress, tell


def command(
    seed: Annotated[
        int | None, typer.Option(help="Draw these cases, or go on with them; a fresh draw if left out.")
    ] = None,
    runs: Annotated[float, typer.Option(help="Runs of each size of each effect; other cells in proportion.")] = 1.0,
    only: Annotated[
        str,
        typer.Option(
            autocompletion=effect_names,
            help="Cells (wind, clean, ...: see the page) or kinds of them, with commas between; all if left out.",
        ),
    ] = "",
    processes: Annotated[int, typer.Option(help="Processes to share the work among.")] = 2,
    dask: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler whose workers do the work; they must share --out.")
    ] = None,
    real: Annotated[
        str | None,
        typer.Option(help="Conceal the effects in real recordings: a TOML file that lists them, or a log."),
    ] = None,
    vessel: Vessel = None,
    check: Annotated[
        Path | None,
        typer.Option(help="Only check the answers.json of this folder against the commitment in its seal.json."),
    ] = None,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Inject effects into simulated trials or real recordings, diagnose them without the answers, and score what is found."""
    if check is not None:
        from ferryid.validation.commitment import verified_answers

        cases = verified_answers(check)["cases"]
        typer.echo(f"{check}: the answers to {len(cases)} cases match their commitment")
        return
    from ferryid import api

    cells = tuple(name.strip() for name in only.split(",") if name.strip())
    outcome = api.prove(
        out,
        seed=seed,
        runs=runs,
        only=cells,
        real=real,
        vessel=vessel or None,
        processes=processes,
        dask=dask,
        progress=progress,
        announce=tell,
    )
    emit(outcome, json)
