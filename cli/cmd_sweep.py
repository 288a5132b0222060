"""ferryid sweep."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from ferryid.cli.options import (
    OUT,
    Basis,
    Delta,
    From,
    Inertia,
    Json,
    MaybeLogs,
    Out,
    Rate,
    Residual,
    Sigma,
    Smoother,
    Structure,
    To,
    Vessel,
    WeakWindow,
    Zeta,
    given,
    ranges,
)
from ferryid.cli.output import emit, progress, tell
from ferryid.errors import FerryIdError


def command(
    what: Annotated[str, typer.Argument(help="components, window, both at once, or basis.")],
    logs: MaybeLogs = None,
    vessel: Vessel = None,
    from_: From = None,
    to: To = None,
    windows: Annotated[str, typer.Option(help="Windows to try [s], as 0.5,1,2; a usual range if left out.")] = "",
    window: Annotated[float, typer.Option(help="Smoothing window [s] for sweeps of components or basis.")] = 1.0,
    components: Annotated[
        str, typer.Option(help="Number of components for sweeps of window or basis, or auto.")
    ] = "auto",
    folds: Annotated[int, typer.Option(help="Number of contiguous stretches that test in turn.")] = 5,
    basis: Basis = "modulus",
    structure: Structure = "decoupled",
    smoother: Smoother = "square",
    residual: Residual = "measured",
    rate: Rate = None,
    estimator: Annotated[
        str,
        typer.Option(
            "--estimator",
            help="derivative, or weak: windows are then those of the weak form; auto: the one that fit uses for these logs.",
        ),
    ] = "auto",
    weak_window: WeakWindow = None,
    inertia: Inertia = "auto",
    delta: Delta = 1.0,
    sigma: Sigma = 1.0,
    zeta: Zeta = 1.0,
    archive: Annotated[
        bool,
        typer.Option(
            "--archive", help="Sweep what is kept of every log ingested to --out, or of those named; reads no log."
        ),
    ] = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Cross-validate windows, component counts, or all bases in both structures, and mark which to fit with."""
    from ferryid import api
    from ferryid.identify import FitSettings, parse_windows

    settings = FitSettings(
        basis=basis, structure=structure, components=components, window_s=window, smoother=smoother, residual=residual,
        inertia=inertia, rate_hz=rate, delta=delta, sigma=sigma, zeta=zeta, estimator=estimator, weak_window_s=weak_window,
    )  # fmt: skip
    if Path(what).exists():
        raise FerryIdError(
            f"{what}: a log stands where WHAT does, which says what is swept. Fix: ferryid sweep components {what}, or "
            "window, both or basis in the place of components"
        )
    chosen = logs or () if archive else given(logs)
    outcome = api.sweep(
        what,
        chosen,
        vessel or None,
        settings,
        out,
        windows_s=parse_windows(windows),
        folds=folds,
        archive=archive,
        command=("ferryid", *sys.argv[1:]),
        ranges=ranges(from_, to),
        progress=progress,
        announce=tell,
    )
    emit(outcome, json)
