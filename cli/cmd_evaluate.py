"""ferryid evaluate."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.completion import model_names
from ferryid.cli.options import OUT, From, Json, Logs, ModelVessel, Out, To, ranges
from ferryid.cli.output import emit, progress, tell


def command(
    model: Annotated[
        str, typer.Argument(autocompletion=model_names, help="Path of a model file, name, or name@version.")
    ],
    logs: Logs,
    vessel: ModelVessel = None,
    from_: From = None,
    to: To = None,
    window: Annotated[
        float | None, typer.Option(help="Smoothing window [s] of the test data; the model's own if left out.")
    ] = None,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Judge a model on other logs: force MSE and R² per axis, free-run error."""
    from ferryid import api

    outcome = api.evaluate(
        model,
        logs,
        out,
        vessel=vessel or None,
        window_s=window,
        ranges=ranges(from_, to),
        progress=progress,
        announce=tell,
    )
    emit(outcome, json)
