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
    from ferryid.identify.catalogue import listing, render_listing, render_model
    from ferryid.identify.model import to_json
    from ferryid.identify.store import load

    if model:
        loaded = load(model, out)
        emit(to_json(loaded), render_model(loaded), json)
    else:
        result = listing(out)
        emit(result, render_listing(result, out), json)
