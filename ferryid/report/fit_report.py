"""From logs to a stored model and its report: what ``ferryid fit`` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ferryid.effects.wording import listed
from ferryid.files import alone
from ferryid.identify import FitOutcome, FitSettings, fit_archive, fit_logs
from ferryid.models import model_to_json
from ferryid.models.store import StoredModel, assign_version, plan, save
from ferryid.report.folder import PAGE, write_folder
from ferryid.report.headline import headline_of
from ferryid.report.interactive import write_assets
from ferryid.report.model_text import describe_settings, error_ratio
from ferryid.report.other_vessels import other_vessels
from ferryid.report.outcome import Report
from ferryid.report.page_process import PageProcess, started
from ferryid.types import AXES, RunContext
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    import pandas as pd


JUDGED = "errors are those of a fit to the training rows alone, which judges the model"
"""Of a model whose coefficients are from all rows, as the end of a sentence."""
RELATIVE_LOADS = (
    "relative to the hull that all logs share, positive or negative: what was aboard in every log is in that hull"
)
"""What the loads of single logs are, as the end of a sentence."""


@dataclass(frozen=True, repr=False)
class FitReport(Report):
    """What a fit leaves: its report, unless none was wanted, and the stored model."""

    stored: StoredModel

    @property
    def accepted(self) -> bool:
        """Verdict of the fit."""
        return self.stored.model.accepted

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Those of the result, and the ``coefficients`` of the model with their intervals."""
        from ferryid.report.tables import tables_of

        return {**tables_of(model_to_json(self.stored.model)), **super().tables}


def fit_and_report(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    name: str = "",
    page: bool = True,
) -> FitReport:
    """Fit a model to logs, store it in the output folder, and write its report.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    profile
        The vessel.
    settings
        How to fit.
    run
        Output folder, in which ``logs``, ``models`` and ``reports`` are made; progress; whether to check every checksum.
    name
        Name of the model; the profile's where empty.
    page
        Whether a report is written; without it, the model alone is.

    Raises
    ------
    FerryIdError
        For unusable input or an output folder that cannot be written; nothing half-written is left.
    """
    with started(PageProcess, page) as process:
        found = fit_logs(logs, profile, settings, run, name=name, odd=other_vessels(profile, run))
        return _reported(found, run, page, process)


def fit_archive_and_report(
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    logs: Sequence[str] = (),
    *,
    name: str = "",
    page: bool = True,
) -> FitReport:
    """Fit a model to the block sums of the logs in the output folder, else as `fit_and_report`."""
    with started(PageProcess, page) as process:
        return _reported(fit_archive(profile, settings, run, logs, name=name), run, page, process)


def _reported(result: FitOutcome, run: RunContext, page: bool, process: PageProcess | None) -> FitReport:
    run.progress("writing the report" if page else "storing the model")
    out = run.out
    with alone(out / "models"):
        result = replace(result, model=assign_version(result.model, out))
        report = out / "reports" / f"{result.model.name}-v{result.model.version}" / PAGE
        stored = plan(result.model, out)
        plain = as_json(result, stored, report if page else None)
        if page:
            _write_page(result, report.parent, plain, run, process)
        else:
            save(result.model, out)
    run.progress("")
    return FitReport(plain, as_text(result, stored, report if page else None), report, stored)


def _write_page(
    result: FitOutcome, folder: Path, plain: Mapping[str, Any], run: RunContext, process: PageProcess | None
) -> None:
    """Write the report of a fit, and store its model."""
    out = run.tables_out or run.out
    page = None if process is None else process.page_of(result, folder, out, run.command, run.given)
    if page is None:
        # What draws takes half a second to import.
        from ferryid.report.page import page_of

        page = page_of(result, folder, out, run.command, run.given)
    text, drawings, scripts = page
    if scripts:
        write_assets(out)
    write_folder(folder, text, drawings, plain, "fit.json", lambda: save(result.model, run.out), scripts)


def as_json(result: FitOutcome, stored: StoredModel, report: Path | None) -> dict[str, Any]:
    """Return the result of a fit in the form of schema ``ferryid.fit/1``."""
    model = result.model
    return {
        "schema": "ferryid.fit/1",
        "model": {
            "name": model.name,
            "version": model.version,
            "path": str(stored.path),
            "current": stored.current,
            "accepted": model.accepted,
        },
        "headline": headline_of(result),
        "reasons": list(result.acceptance.reasons),
        "acceptance": result.acceptance.to_json(),
        "warnings": list(result.warnings),
        **({"notes": list(result.notes)} if result.notes else {}),
        **({"logs_left_out": _left_out(result)} if result.logs_left_out else {}),
        "scores": result.scores.to_json(),
        "settings": {**model.settings, **model.scale},
        "free_run": {
            "base": result.free_run_base.to_json(),
            "model": result.free_run_model.to_json(),
        },
        "components": {
            "chosen": result.curve.chosen,
            "training": result.curve.training.tolist(),
            "validation": result.curve.validation.tolist(),
        },
        "excitation": {
            "singular_values": result.excitation.singular_values.tolist(),
            "heading_coverage": result.excitation.heading_coverage,
            "undetermined": dict(result.excitation.undetermined),
            "ranges": {name: list(span) for name, span in result.excitation.ranges.items()},
        },
        "logs": [{"name": log.motion.log, **log.data_quality} for log in result.logs],
        **({"archive": [log.to_json() for log in result.archive]} if result.archive else {}),
        **({"estimators": [one.to_json() for one in result.estimators]} if result.estimators else {}),
        **({"conditions": conditions} if (conditions := result.conditions_by_log()) else {}),
        **({"condition_kinds": [one.to_json() for one in result.condition_kinds]} if result.condition_kinds else {}),
        **({"order_responses": [one.to_json() for one in result.order_responses]} if result.order_responses else {}),
        "report": None if report is None else str(report),
    }


def _left_out(result: FitOutcome) -> list[dict[str, str]]:
    return [{"log": path, "says": says} for path, says in result.logs_left_out.items()]


def as_text(result: FitOutcome, stored: StoredModel, report: Path | None) -> str:
    """Return the verdict for a terminal."""
    model, scores = result.model, result.scores.force
    lines = [
        headline_of(result),
        *(f"  {reason}" for reason in result.acceptance.reasons),
        "",
        f"fitted with {describe_settings(model)}",
        "",
    ]
    lines.append(f"{'on validation rows':<28}" + "".join(f"{axis:>12}" for axis in AXES))
    lines.append(f"{'':<28}" + "".join(f"{unit:>12}" for unit in ("[N]", "[N]", "[N·m]")))
    errors = [(f"rms {result.scores.measure} error, base", scores.mse_base)]
    errors.append((f"rms {result.scores.measure} error, new", scores.mse_model))
    if np.isfinite(scores.mse_constant_velocity).any():
        errors.append(("the same, constant velocity", scores.mse_constant_velocity))
    for name, mse in errors:
        lines.append(f"{name:<28}" + "".join(f"{_three_digits(value):>12}" for value in np.sqrt(mse).tolist()))
    lines.append(
        f"{'R² against applied force':<28}" + "".join(f"{_number(value):>12}" for value in scores.r2_model.tolist())
    )
    if model.settings.get("estimated_from"):
        lines.append(JUDGED)
    lines.append("")
    for one in result.estimators:
        held_out = error_ratio(one.held_out) if np.isfinite(one.held_out) else "–"
        folds = (
            f"{error_ratio(one.folds)} on folds of the training rows"
            if np.isfinite(one.folds)
            else "unknown on folds of the training rows, which are too short for it"
        )
        lines.append(
            f"estimator {one.name}: squared prediction error over the base model's: {folds}, {held_out} held out"
            f"{'' if one.possible else '; no hull has such inertia or damping'}{'; chosen' if one.chosen else ''}"
        )
    lines.extend(f"wind, estimated: {one}" for one in result.winds)
    lines.extend(f"{one.title}, estimated: {one}" for one in result.conditions)
    if any(one.kind == "payload" and one.significant for one in result.conditions):
        lines.append(f"loads are {RELATIVE_LOADS}")
    if result.condition_kinds and not result.conditions:
        # What each was left out for stands in the report.
        left = listed([one.title for one in result.condition_kinds])
        lines.append(f"conditions of single logs beside the wind: none estimated of {left}")
    lines.extend([""] if result.estimators or result.winds or result.condition_kinds else [])
    lines.extend(f"warning: {warning}" for warning in result.warnings)
    lines.extend(f"note: {note}" for note in result.notes)
    state = "current" if stored.current else ("stored" if model.accepted else "stored, marked as rejected")
    if stored.current and stored.previous not in (None, model.version):
        state += f"; before it was @{stored.previous}, compare them on a log that neither was trained on"
    lines.append(f"model   {stored.path} ({model.name}@{model.version}, {state})")
    if report is not None:
        lines.append(f"report  {report}")
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "–"


def _three_digits(value: float) -> str:
    """Return a number with three significant digits, those of its integer part all written."""
    if not np.isfinite(value):
        return "–"
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:#.3g}".rstrip(".")
