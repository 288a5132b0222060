"""ferryid models."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import OUT, Json, Out
from ferryid.cli.output import emit


def command(
    model: Annotated[str, typer.Argument(help="A name, name@version or path to show; none lists all.")] = "",
    out: Out = OUT,
    json: Json = None,
) -> None:
    """List the stored models and which is current, or show one."""
    from ferryid.models import model_to_json
    from ferryid.models.store import list_versions, load
    from ferryid.report.model_text import render_listing, render_model

    if model:
        loaded = load(model, out)
        emit(model_to_json(loaded), render_model(loaded), json)
    else:
        result = list_versions(out)
        emit(result, render_listing(result, out), json)
