"""ferryid inspect."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import From, Json, To, Verify, Vessel, ranges
from ferryid.cli.output import emit, tell, text_width


def command(
    log: Annotated[str, typer.Argument(help="A bag, MCAP file, table or folder.")],
    vessel: Vessel = None,
    from_: From = None,
    to: To = None,
    verify: Verify = False,
    json: Json = None,
) -> None:
    """Show topics, types, counts, rates, gaps, clocks, and the signals that a vessel profile finds."""
    from ferryid import api

    emit(
        api.inspect(log, vessel or None, verify=verify, ranges=ranges(from_, to), width=text_width(), announce=tell),
        json,
    )
