"""ferryid vessel."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ferryid import interrupts
from ferryid.cli.completion import vessel_names
from ferryid.cli.options import From, Json, To, ranges
from ferryid.cli.output import emit, progress, tell
from ferryid.cli.plain_values import PlainCommand, PlainGroup

if TYPE_CHECKING:
    from ferryid.draft import Question

app = typer.Typer(
    cls=PlainGroup,
    help="Draft, check, show and list vessel profiles.",
    no_args_is_help=True,
    rich_markup_mode=None,
    add_completion=False,
)
File = Annotated[
    str,
    typer.Argument(
        autocompletion=vessel_names, help="Path of a profile (TOML), or the name of one: see ferryid vessel list."
    ),
]


@app.command(cls=PlainCommand)
def new(
    log: Annotated[str, typer.Argument(help="A bag, MCAP file, table or folder; parts of one log joined by +.")],
    like: Annotated[
        str | None,
        typer.Option(
            "--like",
            autocompletion=vessel_names,
            help="Profile to take hull, thrust and the layout of tables from: a name, or a TOML file.",
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the vessel; of the log's folder if left out.")] = "",
    file: Annotated[
        Path | None,
        typer.Option(help="Where to write the profile, - for standard output; vessel.toml beside the log if left out."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a profile that is there.")] = False,
    from_: From = None,
    to: To = None,
    ask: Annotated[
        bool, typer.Option("--ask/--no-ask", help="Ask on a terminal for what no log shows; else its lines are marked.")
    ] = True,
    json: Json = None,
) -> None:
    """Draft a profile from a log, with the evidence for each signal.

    Names show which topics may be pose, velocity, heading, rates, orders, feedback and wind; units, frames and signs are
    those in which they move together. What no log shows is asked on a terminal, or left as lines marked FILL IN.
    """
    from ferryid import api

    asking = _asked if ask and sys.stdin.isatty() and sys.stderr.isatty() else None
    outcome = api.new_vessel(
        log, like, name=name, file=file, overwrite=overwrite, ask=asking, ranges=ranges(from_, to), progress=progress
    )
    if str(file) == "-" and json != "-":
        typer.echo(outcome.json["toml"], nl=False)
        return
    emit(outcome, json)


def _asked(question: Question) -> str:
    """Ask a person, until the answer is one; nothing, or the end of the input, leaves it open."""
    progress("")
    while True:
        try:
            answer = str(
                typer.prompt(f"{question.text}, empty to leave open", default="", show_default=False, err=True)
            )
        except typer.Abort:
            if interrupts.received():
                raise
            return ""
        if question.accepts(answer):
            return answer
        tell(f"{answer!r} is no answer here: give {question.wanted}")


@app.command(cls=PlainCommand)
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
    """Explain every fault of a profile, each with its line.

    Warnings alone do not fail it.
    """
    from ferryid import api

    outcome = api.check_vessel(file, identifiable=identifiable, progress=progress)
    emit(outcome, json)
    if any(not fault["warning"] for fault in outcome.json["faults"]):
        raise typer.Exit(2)


@app.command(cls=PlainCommand)
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


@app.command("list", cls=PlainCommand)
def list_(json: Json = None) -> None:
    """List the profiles that have a name.

    These are the bundled ones and your own in the folder for configuration (~/.config/ferryid/vessels).
    """
    from ferryid import api

    emit(api.vessels(), json)
