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
    from ferryid import api

    emit(api.show_model(model, out) if model else api.models(out), json)
