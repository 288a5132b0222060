"""ferryid compare."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import OUT, Json, MaybeVessel, Out
from ferryid.cli.output import emit, progress


def command(
    model_a: Annotated[str, typer.Argument(help="Path, name or name@version of the first model.")],
    model_b: Annotated[str, typer.Argument(help="Path, name or name@version of the second model.")],
    on: Annotated[list[str] | None, typer.Option("--on", help="A log to compare them on; may be given again.")] = None,
    vessel: MaybeVessel = None,
    window: Annotated[float, typer.Option(help="Smoothing window [s] of the test data, the same for both.")] = 1.0,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Compare two models: coefficients, and on logs their errors on the same rows."""
    from ferryid.identify.compare import compare, render_comparison
    from ferryid.identify.store import load
    from ferryid.vessel import load_profile

    profile = load_profile(vessel) if vessel else None
    result = compare(
        load(model_a, out),
        load(model_b, out),
        on or [],
        out,
        profile=profile,
        window_s=window,
        progress=progress,
    )
    emit(result, render_comparison(result), json)
