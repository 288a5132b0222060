"""What is done with one log: its fit, its evaluation, its diagnosis, each into the folder of its results."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.batch.log_result import StepSummary
from ferryid.batch.recipe import Recipe
from ferryid.files import dump_json, finite, write_text
from ferryid.report.batch_rows import BaseAndModel, DiagnosisSummary, EvaluationSummary, FindingSummary, FitSummary
from ferryid.types import RunContext, TimeRanges
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.models import Model

# Each step loads what it needs: a process that only fits loads no diagnosis, which takes a second.

LONGEST_NAME = 80


@dataclass(frozen=True)
class Job:
    """One log and what is done with it.

    Attributes
    ----------
    log, name
        Its path and its name.
    vessel
        What the profile was asked for by; empty where the model brought it.
    profile, model
        The vessel, and the model to evaluate and to diagnose from; the profile's hull where None.
    recipe
        The steps and their settings.
    folder
        For the results.
    tables
        Output folder whose ``logs`` keep the ingested tables.
    recorded
        The log's own folder of these.
    ranges
        What of the log is used; all of it where empty.
    """

    log: str
    name: str
    vessel: str
    profile: Profile
    model: Model | None
    recipe: Recipe
    folder: Path
    tables: Path
    recorded: Path
    ranges: TimeRanges = ()

    @property
    def context(self) -> RunContext:
        """Results go to the folder, ingested tables to those that all logs share."""
        return RunContext(self.folder, tables_out=self.tables, ranges=self.ranges)

    def below(self, path: str | Path) -> str:
        """Return a path relative to the folder."""
        return Path(os.path.relpath(path, self.folder)).as_posix()

    def model_name(self, end: str = "") -> str:
        """Return a name for a model of this log alone."""
        whole = re.sub(r"[^A-Za-z0-9_.-]+", "_", f"{self.profile.name}-{self.name}")
        return whole[: LONGEST_NAME - len(end)] + end


def _fitted(job: Job) -> FitSummary:
    from ferryid.identify import keep_for_archive
    from ferryid.report.fit_report import fit_and_report

    page = job.recipe.fit_report
    made = fit_and_report([job.log], job.profile, job.recipe.fit, job.context, name=job.model_name(), page=page)
    # What a fit over the whole archive adds up is made here, where logs are worked on side by side.
    if job.recorded.exists():
        keep_for_archive(job.recorded, job.profile, job.recipe.fit)
    told, scores = made.json, finite(made.json["scores"])
    return FitSummary(
        model=job.below(told["model"]["path"]),
        report=job.below(made.report) if page else None,
        accepted=made.accepted,
        headline=told["headline"],
        warnings=tuple(told["warnings"]),
        normalised_mse=scores["normalised_mse"],
        per_axis=scores["per_axis"],
        mse=BaseAndModel.from_json(scores["mse"]),
    )


def _evaluated(job: Job) -> EvaluationSummary:
    from ferryid.compare import evaluate
    from ferryid.models import blank_model

    model = job.model or blank_model(job.profile, job.profile.name)
    told = evaluate(model, [job.log], job.context, profile=job.profile)
    write_text(job.folder / "evaluation.json", dump_json(told))
    entry = finite(told["logs"][0])
    return EvaluationSummary(
        evaluated=job.model.label if job.model else f"the hull of {job.profile.name}",
        file="evaluation.json",
        normalised_mse=entry["normalised_mse"] if job.model else None,
        per_axis=entry["per_axis"] if job.model else {},
        mse=entry["mse"]["model"],
        warnings=tuple(entry["warnings"]),
    )


def _diagnosed(job: Job) -> DiagnosisSummary:
    from ferryid.diagnose import DiagnosisSettings
    from ferryid.report.diagnosis_report import diagnose_and_report

    words = ["ferryid", "diagnose", job.log, *(["--vessel", job.vessel] if job.vessel else [])]
    words += [word for option in _range_words(job.ranges) for word in option]
    words += [word for signal in job.recipe.withhold for word in ("--withhold", signal)]
    made = diagnose_and_report(
        [job.log],
        job.profile,
        DiagnosisSettings(model=job.model, withhold=job.recipe.withhold),
        job.context,
        name=job.model_name("-diagnosed"),
        command=[*words, *(["--model", job.recipe.model] if job.recipe.model else [])],
    )
    told = made.json
    kept = ("effect", "instance", "probability", "parameters", "says")
    return DiagnosisSummary(
        report=job.below(made.report),
        model=None if told["model"] is None else job.below(told["model"]),
        verdict=told["verdict"],
        findings=tuple(
            FindingSummary.from_json(finite({name: one[name] for name in kept})) for one in told["findings"]
        ),
        before=finite(told["before"]["mse"]),
        after=finite(told["after"]["mse"]),
    )


def _range_words(ranges: TimeRanges) -> list[tuple[str, str]]:
    """Return ranges as options of a command line."""
    sides = (("--from", [first for first, _ in ranges]), ("--to", [last for _, last in ranges]))
    return [(name, ",".join(map(str, times))) for name, times in sides if times and times[0] is not None]


CARRY_OUT: Mapping[str, Callable[[Job], StepSummary]] = {
    "fit": _fitted,
    "evaluate": _evaluated,
    "diagnose": _diagnosed,
}
"""Steps by their names: each returns what the summary tells of it, with paths relative to the folder."""
