"""ferryid doctor."""

from __future__ import annotations

import typer

from ferryid.cli.options import OUT, AnyOut, Json
from ferryid.cli.output import emit


def command(out: AnyOut = OUT, json: Json = None) -> None:
    """Show versions, optional parts, compile cache, cores, memory and disk; exit code 2 where one of them stops commands."""
    from ferryid import api

    outcome = api.doctor(out)
    emit(outcome, json)
    if outcome.json["problems"]:
        raise typer.Exit(2)
