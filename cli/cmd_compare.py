"""ferryid compare."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from ferryid.cli.completion import model_or_log
from ferryid.cli.options import OUT, From, Json, ModelVessel, Out, To, ranges
from ferryid.cli.output import emit, progress, tell
from ferryid.cli.several import several_after

Command = several_after("--on")


def command(
    models: Annotated[
        list[str],
        typer.Argument(
            autocompletion=model_or_log, help="Two or more models, before --on: path, name or name@version."
        ),
    ],
    on: Annotated[
        list[str] | None,
        typer.Option(
            "--on", help="Logs to compare them on, one or several; without them only coefficients are compared."
        ),
    ] = None,
    vessel: ModelVessel = None,
    from_: From = None,
    to: To = None,
    window: Annotated[float, typer.Option(help="Smoothing window [s] of the test data, the same for all.")] = 1.0,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Compare models on the same rows of logs, and by their coefficients.

    Every two models are compared: by the mean square of their force errors, and by how far they stray when run
    free. A ratio comes with a 95 % interval and a probability p: how likely a ratio this far from one is if both err alike,
    from resampling blocks of 30 s or more of each log, in pairs, and corrected for the number of comparisons (Holm).
    """
    from ferryid import api

    words = ("ferryid", *sys.argv[1:])
    outcome = api.compare(
        models,
        on or (),
        out,
        vessel=vessel or None,
        window_s=window,
        command=words,
        progress=progress,
        ranges=ranges(from_, to),
        announce=tell,
    )
    emit(outcome, json)
