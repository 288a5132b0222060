"""Physics that a model leaves out, differences of groups, and the trial that would tell most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.api.arguments import (
    OUT,
    Logs,
    Progress,
    Ranges,
    chosen_vessel,
    model_of,
    paths_of,
    profile_of,
    quiet,
    refuse_no_logs,
    run_context,
    vessel_beside_model,
)
from ferryid.side_by_side import blas_on_one_thread

if TYPE_CHECKING:
    from ferryid.diagnose import DiagnosisSettings
    from ferryid.report.outcome import Outcome, Report
    from ferryid.vessel.profile import Profile


@blas_on_one_thread
def diagnose(
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    out: str | Path = OUT,
    *,
    model: str | None = None,
    settings: DiagnosisSettings | None = None,
    name: str = "",
    command: Sequence[str] = (),
    verify: bool = False,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Report:
    """Say which physics a model left out of recordings, what shows it, and store the model that has it.

    Parameters
    ----------
    logs
        Recordings of one vessel.
    vessel
        Its profile; that of `model`, or found by the recordings, where None.
    out
        Output folder.
    model
        The model to examine: path, name or name@version; the profile's hull where None.
    settings
        Against a simulated log, every log by itself, signals to withhold, references: `ferryid.diagnose.DiagnosisSettings`.
        Its model is `model`.
    name
        Name of the model with the findings.
    command
        The words that the page says it was asked for with.
    verify
        Check every checksum of the logs.
    """
    from ferryid.report.diagnosis_report import diagnose_and_report
    from ferryid.report.refusal import shown_where_refused

    paths = paths_of(logs)
    profile, examined = _examined(paths, vessel, model, out, settings, announce)
    run = run_context(out, progress, verify, ranges)
    outcome = shown_where_refused(
        lambda: diagnose_and_report(paths, profile, examined, run, name=name, command=command),
        "diagnosed",
        paths,
        profile,
        run,
        command,
    )
    progress("")
    return outcome


@blas_on_one_thread
def compare_groups(
    logs: Logs,
    versus: Logs,
    vessel: str | Path | Profile | None = None,
    out: str | Path = OUT,
    *,
    model: str | None = None,
    settings: DiagnosisSettings | None = None,
    name: str = "",
    command: Sequence[str] = (),
    verify: bool = False,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Report:
    """Estimate in which properties and loads two groups of recordings of one vessel differ: ``diagnose LOGS --versus VERSUS``.

    Parameters
    ----------
    logs, versus
        Recordings of the vessel, group A and group B; differences are those of B relative to A.
    vessel, out, model, command, verify
        As of `diagnose`.
    settings
        Signals to withhold; neither ``against`` nor ``each`` goes with two groups.
    name
        Refused where not empty: no model comes of a comparison.
    """
    from ferryid.report.versus_report import compare_and_report

    paths, others = paths_of(logs), paths_of(versus)
    profile, examined = _examined([*paths, *others], vessel, model, out, settings, announce)
    run = run_context(out, progress, verify, ranges)
    outcome = compare_and_report(paths, others, profile, examined, run, name=name, command=command)
    progress("")
    return outcome


def _examined(
    logs: Sequence[str],
    vessel: str | Path | Profile | None,
    model: str | None,
    out: str | Path,
    settings: DiagnosisSettings | None,
    announce: Progress,
) -> tuple[Profile, DiagnosisSettings]:
    """Return the vessel of a diagnosis, and its settings with the model that is examined."""
    from ferryid.diagnose import DiagnosisSettings
    from ferryid.report.diagnosis_report import patient

    refuse_no_logs(logs)
    if not model:
        vessel = chosen_vessel(logs, vessel, announce)
    elif not vessel:
        vessel = vessel_beside_model(model_of(model, Path(out)), logs, None, announce)
    profile, examined = patient(vessel, model, Path(out))
    return profile, replace(settings or DiagnosisSettings(), model=examined)


@blas_on_one_thread
def plan(
    vessel: str | Path | Profile | None = None,
    after: Logs = (),
    out: str | Path = OUT,
    *,
    model: str | None = None,
    minutes: float = 12.0,
    area: tuple[float, float] | None = None,
    separate: Sequence[tuple[str, str]] = (),
    origin: tuple[float, float] | None = None,
    bearing_deg: float = 0.0,
    seed: int = 1,
    name: str = "",
    overwrite: bool = False,
    verify: bool = False,
    ranges: Ranges = (),
    progress: Progress = quiet,
    announce: Progress = quiet,
) -> Outcome:
    """Design the trial that would tell most about a vessel, and write it to ``plans/<name>`` of the output folder.

    Parameters
    ----------
    vessel
        Its profile; that of `model`, or found by the recordings, where None.
    after
        What was recorded already: what it tells of the hull counts, and effects that it cannot separate are to be separated.
    model
        The diagnosed model that brings the hull: path, name or name@version; the profile's hull where None.
    minutes
        Longest time of the trial.
    area
        Length and breadth of the water there is [m].
    separate
        Further pairs of effects to separate, as ``("wind", "current")`` or ``("thruster_gain(bow)", "fouling")``.
    origin, bearing_deg
        Latitude and longitude of the middle of the area [deg], for a mission; bearing of its longer side from north [deg].
    seed
        Of the simulated noise.
    name
        Of the plan; the vessel's where empty.
    overwrite
        Replace an earlier plan.
    """
    from ferryid.errors import FerryIdError
    from ferryid.planning import PlanSettings
    from ferryid.report.plan_report import plan_and_report
    from ferryid.vessel import parse_profile

    paths = paths_of(after)
    known = model_of(model, Path(out)) if model else None
    if known is not None and vessel is None:
        profile = vessel_beside_model(known, paths, None, announce) or parse_profile(known.profile_text, known.name)
    elif vessel is None and not paths:
        raise FerryIdError("--vessel: a plan is of a vessel, found none. Fix: give --vessel PROFILE, or --after LOG")
    else:
        profile = chosen_vessel(paths, vessel, announce) if paths else profile_of(vessel or "")
    settings = PlanSettings(minutes, area, tuple(separate), known, seed)
    outcome = plan_and_report(
        profile, paths, settings, run_context(out, progress, verify, ranges),
        origin=origin, bearing_deg=bearing_deg, name=name, overwrite=overwrite,
    )  # fmt: skip
    progress("")
    return outcome
