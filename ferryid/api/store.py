"""Stored models, which of them is current, and their forms for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.api.arguments import (
    OUT,
    Logs,
    Progress,
    Ranges,
    model_of,
    outcome_of,
    path_of,
    paths_of,
    profile_of,
    quiet,
    run_context,
    vessel_beside_model,
)

if TYPE_CHECKING:
    from ferryid.models import Model
    from ferryid.report.outcome import Outcome
    from ferryid.vessel.profile import Profile


def models(out: str | Path = OUT) -> Outcome:
    """Return the stored models, and which of each name is current."""
    from ferryid.models.store import list_versions
    from ferryid.report.model_text import render_listing

    result = list_versions(Path(out))
    return outcome_of(result, render_listing(result, Path(out)))


def show_model(model: str | Path | Model, out: str | Path = OUT) -> Outcome:
    """Return one model: its coefficients with their intervals, scores and settings."""
    from ferryid.models import model_to_json
    from ferryid.report.model_text import render_model

    loaded = model_of(model, Path(out))
    return outcome_of(model_to_json(loaded), render_model(loaded))


def promote(
    model: str,
    on: Logs = (),
    out: str | Path = OUT,
    *,
    vessel: str | Path | Profile | None = None,
    force: bool = False,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Outcome:
    """Make a stored version the current one, after a replay of it and of the present one on logs; ``json["promoted"]`` tells.

    Parameters
    ----------
    model
        ``name@version``.
    on
        Logs: a version that runs free worse on them than the current one is not promoted, and a rejected one only where it is
        better in something. Without logs an accepted one is.
    out
        Output folder.
    vessel
        In place of the models' own profile.
    force
        Promote whatever the verdict is; the history says so.
    """
    from ferryid.report.promotion import promote_version

    run = run_context(out, progress, ranges=ranges)
    paths, profile = paths_of(on), None if vessel is None else profile_of(vessel)
    if profile is None and paths and "@" in model:
        profile = vessel_beside_model(model_of(model, run.out), paths, None, announce)
    told = promote_version(model, paths, run, profile, force=force)
    progress("")
    return outcome_of(*told)


def roll_back(name: str, out: str | Path = OUT, *, to: int | None = None) -> Outcome:
    """Make the version current that was it before, or an earlier one that was it once."""
    from ferryid.report.promotion import roll_back_version

    return outcome_of(*roll_back_version(name, Path(out), to))


def export(
    what: str | Path,
    out: str | Path = OUT,
    *,
    to: str | None = None,
    file: Path | None = None,
    mcap: Path | None = None,
    model: str | None = None,
    vessel: str | None = None,
    diagnosis: Path | None = None,
    overwrite: bool = False,
    json: Path | None = None,
    progress: Progress = quiet,
    ranges: Ranges = (),
    announce: Progress = quiet,
) -> Outcome:
    """Write a model as code or parameters for other programs, or with `mcap` a log and its forces for a viewer.

    See `ferryid.export.commands.export` for the arguments.
    """
    from ferryid.export.commands import export as write_export
    from ferryid.export.commands import render_export

    result = write_export(
        str(what) if mcap is None else path_of(what), Path(out), to=to,
        file=file, mcap=mcap, model=model, vessel=vessel, diagnosis=diagnosis,
        overwrite=overwrite, json=json, ranges=tuple(ranges), progress=progress, announce=announce,
    )  # fmt: skip
    progress("")
    return outcome_of(result, render_export(result))
