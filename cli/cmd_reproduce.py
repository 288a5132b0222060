"""ferryid reproduce."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import OUT, Json, PageOut
from ferryid.cli.output import emit, progress

STUDIES = (
    *(
        "rounds",
        "master",
        "calm",
        "sensitivity",
        "tuning",
        "waves",
        "encoder",
        "residuals",
        "flows",
        "updates",
        "guidance",
    ),
    "algorithms",
)


def command(
    what: Annotated[str, typer.Argument(help="What to reproduce: thesis.")],
    out: PageOut = OUT,
    only: Annotated[
        list[str] | None, typer.Option("--only", help=f"A study by name: {', '.join(STUDIES)}. May be given again.")
    ] = None,
    seeds: Annotated[int, typer.Option(help="Repetitions of every study, each with other weather and noise.")] = 7,
    processes: Annotated[int, typer.Option(help="Processes to share the work among.")] = 2,
    json: Json = None,
) -> None:
    """Fly published trials again in the simulator and set the results side by side."""
    from ferryid import api

    outcome = api.reproduce(what, out, only=only or (), repetitions=seeds, processes=processes, progress=progress)
    emit(outcome, json)
