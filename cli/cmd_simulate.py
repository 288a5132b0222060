"""ferryid simulate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli.completion import model_names, scenario_names
from ferryid.cli.options import OUT, Json
from ferryid.cli.output import emit, progress


def command(
    scenario: Annotated[
        str,
        typer.Argument(autocompletion=scenario_names, help="Name of a bundled scenario, or the path of a TOML file."),
    ] = "",
    out: Annotated[Path, typer.Option("--out", help="Folder for the log, which is SCENARIO.mcap there.")] = OUT,
    log: Annotated[
        Path | None, typer.Option("--log", help="Log to write instead: .mcap, .bag (ROS1), or a folder (ROS2).")
    ] = None,
    storage: Annotated[str, typer.Option(help="Storage of a ROS2 folder: sqlite3 or mcap.")] = "sqlite3",
    truth: Annotated[Path | None, typer.Option(help="Write the true states to this Parquet file as well.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the noise, instead of the scenario's.")] = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names,
            help="A diagnosed model that is the vessel: path, name or name@version. Its effects act, its hull moves.",
        ),
    ] = None,
    conditions: Annotated[
        str, typer.Option(help="With --model: a log that it was diagnosed on, whose wind, payload and so on prevail.")
    ] = "",
    models: Annotated[
        Path | None, typer.Option(help="Output folder in whose store --model finds names; --out if left out.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing log.")] = False,
    list_: Annotated[bool, typer.Option("--list", help="List the bundled scenarios.")] = False,
    json: Json = None,
) -> None:
    """Simulate a trial and write a log like a recording."""
    from ferryid import api

    if list_:
        emit(api.scenarios(), json)
        return
    if not scenario:
        raise typer.BadParameter("give a scenario, or --list")
    outcome = api.simulate(
        scenario,
        out,
        log=log,
        storage=storage,
        truth=truth,
        seed=seed,
        model=model or None,
        models=models,
        conditions=conditions,
        overwrite=overwrite,
        json=None if json in (None, "-") else Path(json),
        progress=progress,
    )
    emit(outcome, json)
