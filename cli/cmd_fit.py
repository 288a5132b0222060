"""ferryid fit."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from ferryid.cli.options import (
    OUT,
    Accept,
    Basis,
    Delta,
    Estimator,
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
    Verify,
    Vessel,
    WeakWindow,
    Zeta,
    given,
    ranges,
)
from ferryid.cli.output import emit, progress, tell


def command(
    logs: MaybeLogs = None,
    vessel: Vessel = None,
    from_: From = None,
    to: To = None,
    name: Annotated[str, typer.Option(help="Name of the model in the store; the vessel's if left out.")] = "",
    basis: Basis = "modulus",
    structure: Structure = "decoupled",
    components: Annotated[
        str,
        typer.Option(help="Number of SIMPLS components, or auto: by cross-validation of the training rows."),
    ] = "auto",
    window: Annotated[str, typer.Option(help="Smoothing window [s], or auto: see ferryid sweep.")] = "1.0",
    smoother: Smoother = "square",
    residual: Residual = "measured",
    split: Annotated[str, typer.Option(help="blocks, logs, or every-kth as in the thesis.")] = "blocks",
    rate: Rate = None,
    inertia: Inertia = "auto",
    estimator: Estimator = "auto",
    weak_window: WeakWindow = None,
    accept: Accept = "full",
    delta: Delta = 1.0,
    sigma: Sigma = 1.0,
    zeta: Zeta = 1.0,
    seed: Annotated[int, typer.Option(help="Seed of the bootstrap.")] = 0,
    require_accept: Annotated[
        bool, typer.Option("--require-accept", help="Exit with 3 if the model is not accepted.")
    ] = False,
    archive: Annotated[
        bool,
        typer.Option(
            "--archive",
            help="Fit to what is kept of every log ingested to --out, or of those named; reads no log.",
        ),
    ] = False,
    report: Annotated[
        bool, typer.Option("--report/--no-report", help="Write the page, or store the model alone, which is faster.")
    ] = True,
    verify: Verify = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Fit a model to one or more logs, validate it, store it and write a report."""
    from ferryid import api
    from ferryid.identify import FitSettings, parse_window

    settings = FitSettings(
        basis=basis, structure=structure, components=components, **parse_window(window), smoother=smoother, residual=residual,
        split=split, inertia=inertia, estimator=estimator, accept=accept, rate_hz=rate, delta=delta, sigma=sigma,
        zeta=zeta, seed=seed, weak_window_s=weak_window,
    )  # fmt: skip
    chosen = logs or () if archive else given(logs)
    outcome = api.fit(
        chosen,
        vessel or None,
        settings,
        out,
        name=name,
        archive=archive,
        command=("ferryid", *sys.argv[1:]),
        report=report,
        verify=verify,
        ranges=ranges(from_, to),
        progress=progress,
        announce=tell,
    )
    emit(outcome, json)
    if require_accept and not outcome.accepted:
        raise typer.Exit(3)
