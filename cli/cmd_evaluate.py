"""ferryid evaluate."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import OUT, Json, Logs, MaybeVessel, Out
from ferryid.cli.output import emit, progress


def command(
    model: Annotated[str, typer.Argument(help="Path of a model file, name, or name@version.")],
    logs: Logs,
    vessel: MaybeVessel = None,
    window: Annotated[
        float | None, typer.Option(help="Smoothing window [s] of the test data; the model's own if left out.")
    ] = None,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Judge a model on other logs: force MSE and R² per axis, free-run error."""
    from ferryid.compare import evaluate
    from ferryid.models.store import load
    from ferryid.report.evaluation_text import render_evaluation
    from ferryid.types import RunContext
    from ferryid.vessel import load_profile

    profile = load_profile(vessel) if vessel else None
    result = evaluate(load(model, out), logs, RunContext(out, progress), profile=profile, window_s=window)
    emit(result, render_evaluation(result), json)
