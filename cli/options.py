"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Logs = Annotated[
    list[str],
    typer.Argument(help="Bags, MCAP files, CSV or Parquet tables, or folders; parts of one log joined by +."),
]
Vessel = Annotated[str, typer.Option("--vessel", help="Name of a bundled vessel profile, or the path of a TOML file.")]
MaybeVessel = Annotated[
    str | None, typer.Option("--vessel", help="Name of a bundled vessel profile, or the path of a TOML file.")
]
Out = Annotated[Path, typer.Option("--out", help="Folder for tables, models and reports.")]
Json = Annotated[
    str | None, typer.Option("--json", help="Write the result as JSON to this file, - for standard output.")
]
Verify = Annotated[bool, typer.Option("--verify", help="Read the whole file and check every checksum.")]

OUT = Path("ferryid-out")
