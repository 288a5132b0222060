"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli import completion
from ferryid.cli.completion import vessel_names
from ferryid.errors import FerryIdError
from ferryid.regression.bases import basis_names


def _folder(context: typer.Context, out: Path) -> Path:
    """Refuse a place for results that is no folder before anything is done."""
    if not context.resilient_parsing:
        from ferryid.files import check_folder

        check_folder(out)
    return out


def _result(context: typer.Context, json: str | None) -> str | None:
    """Refuse a place for a JSON result that cannot take one before anything is done."""
    if json not in (None, "-") and not context.resilient_parsing:
        from ferryid.files import check_result

        check_result(Path(json))
    return json


Logs = Annotated[
    list[str],
    typer.Argument(help="Bags, MCAP files, CSV or Parquet tables, or folders; parts of one log joined by +."),
]
MaybeLogs = Annotated[
    list[str] | None,
    typer.Argument(help="Bags, MCAP files, CSV or Parquet tables, or folders; parts of one log joined by +."),
]


Vessel = Annotated[
    str | None,
    typer.Option(
        "--vessel",
        autocompletion=vessel_names,
        help="Vessel profile: a name, or the path of a TOML file; found from the logs if left out (vessel.toml or ferryid.toml "
        "beside them or above, $FERRYID_VESSEL, or the one profile that fits).",
    ),
]
ModelVessel = Annotated[
    str | None,
    typer.Option(
        "--vessel",
        autocompletion=vessel_names,
        help="Vessel profile of the logs, in place of the model's: a name, or the path of a TOML file.",
    ),
]
Out = Annotated[Path, typer.Option("--out", help="Folder for tables, models and reports.", callback=_folder)]
PageOut = Annotated[Path, typer.Option("--out", help="Folder for the page and its figures.", callback=_folder)]
AnyOut = Annotated[Path, typer.Option("--out", help="Folder for tables, models and reports.")]
"""For commands that tell themselves what is wrong with a folder."""
Json = Annotated[
    str | None,
    typer.Option("--json", help="Write the result as JSON to this file, - for standard output.", callback=_result),
]
Verify = Annotated[bool, typer.Option("--verify", help="Read the whole file and check every checksum.")]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        help="Use every log from here on: seconds from its start, from its end if negative, or a clock time in UTC; several "
        "ranges with commas.",
    ),
]
To = Annotated[str | None, typer.Option("--to", help="Use every log up to here: as --from.")]
Basis = Annotated[str, typer.Option("--basis", help=f"Basis functions: {', '.join(basis_names())}.")]
Structure = Annotated[
    str, typer.Option("--structure", help="coupled: every term in every axis; decoupled: each where physics has it.")
]
Smoother = Annotated[str, typer.Option("--smoother", help="square, savgol or kalman.")]
Residual = Annotated[str, typer.Option("--residual", help="Lack-of-fit residual: measured, commanded or parallel.")]
Rate = Annotated[
    float | None, typer.Option("--rate", help="Rate of the uniform grid [Hz]; the navigation's if left out.")
]
Inertia = Annotated[
    str,
    typer.Option(
        "--inertia", help="auto: keep the base model's inertia where the fitted one cannot be right; or fitted."
    ),
]
WeakWindow = Annotated[
    float | None,
    typer.Option(
        "--weak-window", help="Length of the windows of the weak form [s]; 8 s for a vessel of 5 m if left out."
    ),
]
Estimator = Annotated[
    str,
    typer.Option(
        "--estimator",
        help="derivative: smooth, differentiate, regress, as in the thesis; weak: average the equations of motion over "
        "windows, nothing is differentiated; auto: the one of less error on folds of the training rows.",
    ),
]
Accept = Annotated[
    str,
    typer.Option(
        "--accept",
        help="full: held-out error, inertia, damping, free runs and the amount of held-out data decide; thesis: the "
        "held-out error alone.",
    ),
]
Delta = Annotated[float, typer.Option("--delta", help="Factor on the base model's M and C.")]
Sigma = Annotated[float, typer.Option("--sigma", help="Factor on the base model's D.")]
Zeta = Annotated[float, typer.Option("--zeta", help="Factor on the base model's force.")]

OUT = completion.OUT


def ranges(first: str | None, last: str | None) -> Sequence[tuple[str | float | None, str | float | None]]:
    """Return the ranges of ``--from`` and ``--to``."""
    if first is None and last is None:
        return ()
    from ferryid.signals.time_ranges import parse_ranges

    return parse_ranges(first, last)


def given(logs: list[str] | None) -> list[str]:
    """Return the logs of a command line, which must name one unless it takes an archive."""
    if not logs:
        raise FerryIdError(
            "LOGS: no log was given. Fix: name one or more, or give --archive for all that were ingested to --out"
        )
    return logs
