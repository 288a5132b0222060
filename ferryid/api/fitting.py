"""Models fitted to recordings, judged and compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ferryid.api.arguments import (
    OUT,
    Logs,
    Progress,
    Ranges,
    chosen_vessel,
    given_of,
    model_of,
    outcome_of,
    paths_of,
    profile_of,
    quiet,
    refuse_no_logs,
    refuse_ranges_of_archive,
    run_context,
    vessel_beside_model,
    vessel_of_archive,
)
from ferryid.side_by_side import blas_on_one_thread

if TYPE_CHECKING:
    from ferryid.identify import FitSettings
    from ferryid.models import Model
    from ferryid.report.fit_report import FitReport
    from ferryid.report.outcome import Outcome, Report
    from ferryid.vessel.profile import Profile


@blas_on_one_thread
def fit(
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    settings: FitSettings | None = None,
    out: str | Path = OUT,
    *,
    name: str = "",
    archive: bool = False,
    command: Sequence[str] = (),
    report: bool = True,
    verify: bool = False,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> FitReport:
    """Fit a model to logs, validate it, store it and write its report.

    Parameters
    ----------
    logs
        What to fit to; with `archive`, which of the ingested logs, all where empty.
    vessel
        Name of a profile, the path of a TOML file, or a profile; found by the logs where None, see
        `ferryid.vessel.choose_vessel`, and with `archive` by what was ingested.
    settings
        How to fit: `ferryid.identify.FitSettings`, its defaults where None.
    out
        Output folder.
    name
        Name of the model in the store; the vessel's where empty.
    archive
        Fit to the sums kept of ingested logs; no log is read.
    command
        The words that the page says it was asked for with.
    report
        Write the page, also on a log that is refused; without it the model alone is stored.
    verify
        Read whole files and check every checksum.
    announce
        Called with the vessel that was found.
    """
    from ferryid.identify import FitSettings
    from ferryid.report.fit_report import fit_and_report, fit_archive_and_report
    from ferryid.report.refusal import shown_where_refused

    settings, run, paths = (
        settings or FitSettings(),
        run_context(out, progress, verify, ranges, command, given_of(() if archive else logs, vessel, out, ranges)),
        paths_of(logs),
    )
    if archive:
        refuse_ranges_of_archive(ranges)
        return fit_archive_and_report(
            vessel_of_archive(run.out, vessel, announce), settings, run, paths, name=name, page=report
        )
    profile = chosen_vessel(paths, vessel, announce)

    def fitted() -> FitReport:
        return fit_and_report(paths, profile, settings, run, name=name, page=report)

    return shown_where_refused(fitted, "fitted", paths, profile, run, command) if report else fitted()


@blas_on_one_thread
def evaluate(
    model: str | Path | Model,
    logs: Logs,
    out: str | Path = OUT,
    *,
    vessel: str | Path | Profile | None = None,
    window_s: float | None = None,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Outcome:
    """Judge a model on other logs: mean square of the force errors and R² per axis, errors of free runs.

    `window_s` is the smoothing window of the test data [s], the model's own where None; `vessel` reads logs whose topics are
    not those of the model's profile.
    """
    from ferryid.compare import evaluate as evaluate_model
    from ferryid.report.evaluation_text import render_evaluation

    run, judged, paths = run_context(out, progress, ranges=ranges), model_of(model, Path(out)), paths_of(logs)
    refuse_no_logs(paths)
    profile = vessel_beside_model(judged, paths, vessel, announce)
    result = evaluate_model(judged, paths, run, profile=profile, window_s=window_s)
    return outcome_of(result, render_evaluation(result))


@blas_on_one_thread
def compare(
    models: Sequence[str],
    on: Logs = (),
    out: str | Path = OUT,
    *,
    vessel: str | Path | Profile | None = None,
    window_s: float = 1.0,
    command: Sequence[str] = (),
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Report:
    """Compare models on the same rows of logs, and by their coefficients; without logs by their coefficients alone.

    Parameters
    ----------
    models
        Each a path, name or name@version.
    on
        Logs.
    out
        Output folder.
    vessel
        In place of the models' own profile.
    window_s
        Smoothing window of the logs [s].
    command
        The words that the page says it was asked for with.
    """
    from ferryid.compare import compare as compare_models
    from ferryid.compare import select_candidates
    from ferryid.models.store import load
    from ferryid.report.comparison_report import report

    run, paths = run_context(out, progress, ranges=ranges), paths_of(on)
    loaded = [load(name, run.out) for name in models]
    profile = None if vessel is None else profile_of(vessel)
    if profile is None and loaded and paths:
        profile = vessel_beside_model(loaded[0], paths, None, announce)
    field = select_candidates(models, loaded, profile)
    comparison = compare_models(field, paths, run, window_s=window_s)
    progress("writing the report")
    outcome = report(comparison, run.out, command, paths)
    progress("")
    return outcome


@blas_on_one_thread
def sweep(
    what: Literal["components", "window", "both", "basis"] | str,
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    settings: FitSettings | None = None,
    out: str | Path = OUT,
    *,
    windows_s: Sequence[float] = (),
    folds: int | None = None,
    archive: bool = False,
    command: Sequence[str] = (),
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Report:
    """Cross-validate component counts, smoothing windows [s], or bases and structures, and mark which to fit with."""
    from ferryid.identify import FOLDS, FitSettings
    from ferryid.report.structures_report import structures_and_report
    from ferryid.report.sweep_report import sweep_and_report

    paths = paths_of(logs)
    if archive:
        refuse_ranges_of_archive(ranges)
    profile = vessel_of_archive(Path(out), vessel, announce) if archive else chosen_vessel(paths, vessel, announce)
    asked = given_of(() if archive else logs, vessel, out, ranges)
    run = run_context(out, progress, ranges=ranges, command=command, given=asked)
    arguments = (paths, profile, settings or FitSettings(), run)
    given = {"windows_s": windows_s, "folds": FOLDS if folds is None else folds, "archive": archive}
    if what == "basis":
        return structures_and_report(*arguments, **given)  # type: ignore[arg-type]
    return sweep_and_report(what, *arguments, **given)  # type: ignore[arg-type]
