"""Simulated trials, and studies made of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.api.arguments import OUT, Progress, announced, model_of, outcome_of, quiet
from ferryid.side_by_side import blas_on_one_thread

if TYPE_CHECKING:
    from ferryid.models import Model
    from ferryid.report.outcome import Outcome


def scenarios() -> Outcome:
    """Return the bundled scenarios of the simulator."""
    from ferryid.simulate import render_scenarios, scenario_listing

    listing = scenario_listing()
    return outcome_of(listing, render_scenarios(listing))


def simulate(
    scenario: str | Path,
    out: str | Path = OUT,
    *,
    log: Path | None = None,
    storage: str = "sqlite3",
    truth: Path | None = None,
    seed: int | None = None,
    model: str | Path | Model | None = None,
    models: str | Path | None = None,
    conditions: str = "",
    overwrite: bool = False,
    json: Path | None = None,
    progress: Progress = quiet,
) -> Outcome:
    """Simulate a trial and write a log like a recording. See `ferryid.simulate.commands.run_scenario` for the arguments.

    `models` is the output folder in whose store `model` is looked for, `out` where None.
    """
    from ferryid.simulate import render_simulation, run_scenario

    result = run_scenario(
        str(scenario), Path(out), log=log, storage=storage, truth=truth, seed=seed,
        model=None if model is None else model_of(model, Path(models or out)), conditions=conditions, overwrite=overwrite,
        json=json, progress=progress,
    )  # fmt: skip
    return outcome_of(result, render_simulation(result))


@blas_on_one_thread
def reproduce(
    what: str,
    out: str | Path = OUT,
    *,
    only: Sequence[str] = (),
    repetitions: int = 7,
    processes: int = 2,
    progress: Progress = quiet,
) -> Outcome:
    """Fly published trials again in the simulator and set the results side by side. See `ferryid.reproduce.run.reproduce`."""
    from ferryid.reproduce.run import render_reproduction
    from ferryid.reproduce.run import reproduce as fly_again

    result = fly_again(what, Path(out), only=only, repetitions=repetitions, processes=processes, progress=progress)
    return outcome_of(result, render_reproduction(result))


@blas_on_one_thread
def prove(
    out: str | Path = OUT,
    *,
    seed: int | None = None,
    runs: float = 1.0,
    only: Sequence[str] = (),
    real: str | None = None,
    vessel: str | None = None,
    processes: int = 1,
    dask: str | None = None,
    progress: Progress = quiet,
    announce: Progress = quiet,
) -> Outcome:
    """Inject effects into simulated trials or real recordings, diagnose them blind and score what is found.

    See `ferryid.validation.run.run_validation` for the arguments; `real` and `vessel` are those of
    `ferryid.validation.recorded.evaluators.recorded_pipeline`.
    """
    from ferryid.errors import FerryIdError
    from ferryid.validation import evaluators
    from ferryid.validation.recorded.evaluators import recorded_pipeline
    from ferryid.validation.run import render_summary, run_validation
    from ferryid.vessel import choose_vessel

    if real is None and vessel is not None:
        raise FerryIdError("--vessel: the profile of a real recording, found no --real. Fix: give --real with its log")
    if real is not None and vessel is None and Path(real).suffix.lower() != ".toml":
        choice = choose_vessel([real], None)
        announced(choice, announce)
        vessel = choice.reference
    pipeline = evaluators.pipeline() if real is None else recorded_pipeline(real, vessel)
    result = run_validation(
        Path(out), pipeline, seed=seed, runs=runs, only=only, processes=processes, dask=dask, progress=progress,
        announce=announce,
    )  # fmt: skip
    return outcome_of(result, render_summary(result))
