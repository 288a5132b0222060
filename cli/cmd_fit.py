"""ferryid fit."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.options import OUT, Json, Logs, Out, Verify, Vessel
from ferryid.cli.output import emit, progress
from ferryid.identify.bases import names


def command(
    logs: Logs,
    vessel: Vessel,
    name: Annotated[str, typer.Option(help="Name of the model in the store; the vessel's if left out.")] = "",
    basis: Annotated[str, typer.Option(help=f"Basis functions: {', '.join(names())}.")] = "modulus",
    structure: Annotated[
        str, typer.Option(help="coupled: every term in every axis; decoupled: each where physics has it.")
    ] = "decoupled",
    components: Annotated[str, typer.Option(help="Number of SIMPLS components, or auto.")] = "auto",
    window: Annotated[float, typer.Option(help="Smoothing window [s].")] = 1.0,
    smoother: Annotated[str, typer.Option(help="square, savgol or kalman.")] = "square",
    residual: Annotated[str, typer.Option(help="Lack-of-fit residual: measured, commanded or parallel.")] = "measured",
    split: Annotated[str, typer.Option(help="blocks, logs, or every-kth as in the thesis.")] = "blocks",
    rate: Annotated[
        float | None, typer.Option(help="Rate of the uniform grid [Hz]; the navigation's if left out.")
    ] = None,
    inertia: Annotated[
        str, typer.Option(help="auto: keep the base model's inertia where the fitted one cannot be right; or fitted.")
    ] = "auto",
    delta: Annotated[float, typer.Option(help="Factor on the base model's M and C.")] = 1.0,
    sigma: Annotated[float, typer.Option(help="Factor on the base model's D.")] = 1.0,
    zeta: Annotated[float, typer.Option(help="Factor on the base model's force.")] = 1.0,
    seed: Annotated[int, typer.Option(help="Seed of the bootstrap.")] = 0,
    require_accept: Annotated[
        bool, typer.Option("--require-accept", help="Exit with 3 if the model is not accepted.")
    ] = False,
    verify: Verify = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Fit a model to one or more logs, validate it, store it and write a report."""
    from ferryid.identify.settings import FitSettings
    from ferryid.report.fit_report import fit_and_report
    from ferryid.vessel import load_profile

    settings = FitSettings(
        basis=basis, structure=structure, components=components, window_s=window, smoother=smoother, residual=residual,
        split=split, inertia=inertia, rate_hz=rate, delta=delta, sigma=sigma, zeta=zeta, seed=seed,
    )  # fmt: skip
    outcome = fit_and_report(logs, load_profile(vessel), settings, out, name=name, verify=verify, progress=progress)
    emit(outcome.json, outcome.text, json)
    if require_accept and not outcome.accepted:
        raise typer.Exit(3)
