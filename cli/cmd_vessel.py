"""ferryid vessel."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import Json
from ferryid.cli.output import emit, progress

app = typer.Typer(
    help="Check, show and list vessel profiles.", no_args_is_help=True, rich_markup_mode=None, add_completion=False
)
File = Annotated[str, typer.Argument(help="Path of a profile (TOML), or the name of one: see ferryid vessel list.")]


@app.command()
def check(
    file: File,
    identifiable: Annotated[
        bool,
        typer.Option(
            "--identifiable", help="Simulate the vessel: which effects its sensors can distinguish, what would help."
        ),
    ] = False,
    json: Json = None,
) -> None:
    """Explain every fault of a profile with its line; warnings alone do not fail it."""
    from ferryid import api

    outcome = api.check_vessel(file, identifiable=identifiable, progress=progress)
    emit(outcome, json)
    if any(not fault["warning"] for fault in outcome.json["faults"]):
        raise typer.Exit(2)


@app.command()
def show(
    file: File,
    toml: Annotated[
        bool, typer.Option("--toml", help="Print the profile's own TOML, to start a new one from.")
    ] = False,
) -> None:
    """Show hull, actuators and signal map of a profile."""
    from ferryid.vessel import describe, load_profile

    profile = load_profile(file)
    typer.echo(profile.text if toml else describe(profile), nl=not toml)


@app.command("list")
def list_(json: Json = None) -> None:
    """List the profiles that have a name: bundled, and your own in the folder for configuration."""
    from ferryid import api

    emit(api.vessels(), json)
