"""The result of a batch: a row a log, trends over the rows, and what changed. The page shows it, ``batch.json`` has it all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from ferryid.json_record import Number, Record, json_key
from ferryid.signals.data_quality import LostData

ByAxis = Mapping[str, Number | None]
"""Values by the names of the axes; None for one that is not known."""
Key = tuple[str, str | None]
"""Effect and instance of a finding."""


@dataclass(frozen=True)
class BaseAndModel(Record):
    """Mean square errors of a base model, of a model, and of a constant velocity where it is known [N², N², N²m²]."""

    base: ByAxis
    model: ByAxis
    constant_velocity: ByAxis | None = None


@dataclass(frozen=True)
class FitSummary(Record):
    """What a batch keeps of the fit to a log.

    Attributes
    ----------
    model, report
        Paths of model file and page, relative to the folder of the log's results; no page where the recipe wants none.
    accepted
        Verdict.
    headline, warnings
        Sentences of the page.
    normalised_mse, per_axis
        Mean square force error over the base model's: mean over the axes, and of each.
    mse
        Mean square force errors.
    """

    model: str
    report: str | None
    accepted: bool
    headline: str
    warnings: tuple[str, ...]
    normalised_mse: Number | None
    per_axis: ByAxis
    mse: BaseAndModel


@dataclass(frozen=True)
class EvaluationSummary(Record):
    """What a batch keeps of an evaluation on a log.

    Attributes
    ----------
    evaluated
        Label of the model, or of the hull of the profile.
    file
        Path of the evaluation as JSON, relative to the folder of the log's results.
    normalised_mse, per_axis
        Mean square force error over the base model's, as of a fit; None and empty for the hull of the profile.
    mse
        Mean square force error by axis [N², N², N²m²].
    warnings
        Sentences.
    """

    evaluated: str = field(metadata=json_key("of"))
    file: str = field(metadata=json_key("result"))
    normalised_mse: Number | None
    per_axis: ByAxis
    mse: ByAxis
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class ParameterEstimate(Record):
    """A parameter with its 95 % interval; None for an end or a value that is not known."""

    value: Number | None
    low: Number | None
    high: Number | None
    unit: str


@dataclass(frozen=True)
class FindingSummary(Record):
    """What a batch keeps of a finding: effect, probability, estimates of its parameters, and the sentence on it."""

    effect: str
    instance: str | None
    probability: Number
    parameters: Mapping[str, ParameterEstimate]
    sentence: str = field(metadata=json_key("says"))

    @property
    def key(self) -> Key:
        """Effect and instance."""
        return self.effect, self.instance


@dataclass(frozen=True)
class DiagnosisSummary(Record):
    """What a batch keeps of the diagnosis of a log.

    Attributes
    ----------
    report, model
        Paths of page and model file, relative to the folder of the log's results; no model where nothing was left out.
    verdict
        As in ``ferryid.diagnosis/1``.
    findings
        The likeliest first.
    before, after
        Mean square force errors without and with the findings, by axis [N², N², N²m²]; empty where they are not known.
    """

    report: str
    model: str | None
    verdict: str
    findings: tuple[FindingSummary, ...]
    before: ByAxis
    after: ByAxis


@dataclass(frozen=True)
class SummaryRow(Record):
    """The row of one log.

    Attributes
    ----------
    log, name
        Path as it was given, and name.
    status, reason
        How it ended, and why.
    sha256
        Hash of its content; None where it could not be read.
    bytes
        Size of its files.
    date, date_from
        When it was recorded, ISO 8601, and whether ``log`` or ``manifest`` says so; None where neither does.
    duration_s
        From its first to its last message [s].
    lost
        What could not be read and what is not used; None where it could not be opened.
    vessel, note
        Name of the profile, and the manifest's note.
    folder
        Of its results, relative to that of the batch.
    fit, evaluate, diagnose
        Results of the steps; None for one that is not in the recipe or has no result.
    seconds
        Time of each step [s].
    peak_bytes
        Most memory of its process.
    """

    log: str
    name: str
    status: str
    reason: str
    sha256: str | None
    bytes: int
    date: str | None
    date_from: str | None
    duration_s: Number | None
    lost: LostData | None
    vessel: str
    note: str
    folder: str
    fit: FitSummary | None
    evaluate: EvaluationSummary | None
    diagnose: DiagnosisSummary | None
    seconds: Mapping[str, Number]
    peak_bytes: int

    @property
    def findings(self) -> tuple[FindingSummary, ...]:
        """Findings of its diagnosis; none without one."""
        return () if self.diagnose is None else self.diagnose.findings

    @property
    def work_s(self) -> Number:
        """Time of all steps [s]."""
        return sum(self.seconds.values())

    def finding(self, key: Key) -> FindingSummary | None:
        """Return the first finding of an effect, None where there is none."""
        return next((one for one in self.findings if one.key == key), None)


def date_text(row: SummaryRow) -> str:
    """Return when a log began, without a time of day where none is known; empty where it has no date."""
    time = (row.date or "")[:16].replace("T", " ")
    return time.removesuffix(" 00:00") if row.date_from == "manifest" else time


def by_date(rows: Sequence[SummaryRow]) -> tuple[list[SummaryRow], bool]:
    """Return rows in the order of their dates and True; in their own order and False where one has no date."""
    if not all(row.date for row in rows):
        return list(rows), False
    return sorted(rows, key=lambda row: datetime.fromisoformat(row.date or "")), True


@dataclass(frozen=True)
class TrendLog(Record):
    """A log in a trend: its name, its date, and its place in the order of the trend."""

    log: str
    date: str | None
    place: int


@dataclass(frozen=True)
class TrendPoint(Record):
    """A parameter that was found in a log, with the probability of its finding."""

    log: str
    date: str | None
    place: int
    value: Number | None
    low: Number | None
    high: Number | None
    unit: str
    probability: Number


@dataclass(frozen=True)
class Trend(Record):
    """A parameter of an effect over the logs of a vessel.

    Attributes
    ----------
    vessel, effect, instance, parameter
        Whose, and of which finding.
    title, unit
        Of the effect in words, and of the parameter.
    neutral
        Value where the effect is absent; None for a parameter that then has no meaning.
    dated
        Whether the logs are in the order of their dates; else they are in that of the batch.
    points, absent
        Logs with the finding, and those whose diagnosis did not find it.
    kind
        ``grows``, ``falls`` or ``steps``; None without a trend.
    change
        Numbers of the trend, as `ferryid.batch.trend.trend` returns them.
    sentence
        The trend in words; empty without one.
    """

    vessel: str
    effect: str
    instance: str | None
    parameter: str
    title: str
    unit: str
    neutral: Number | None
    dated: bool
    points: tuple[TrendPoint, ...]
    absent: tuple[TrendLog, ...]
    kind: str | None
    change: Mapping[str, Number]
    sentence: str = field(metadata=json_key("says"))


@dataclass(frozen=True)
class MemoryUse(Record):
    """Most memory that a process may have, whether the system holds it to that, and the most that a log needed [bytes]."""

    limit_bytes: int
    bounded: bool
    peak_bytes: int


@dataclass(frozen=True)
class Change(Record):
    """What two groups of logs of a vessel differ in, as ``ferryid diagnose --versus`` finds it.

    Attributes
    ----------
    vessel
        Its name.
    before, after
        Names of the logs, in their order.
    chosen
        How they were chosen, in words.
    verdict, summary, differences
        As in ``ferryid.versus/1``: whether they differ, one line, and a sentence for each difference; None and empty where
        they could not be compared.
    report
        Path of the page, relative to the folder of the batch.
    problem
        Why they could not be compared; empty where they were.
    """

    vessel: str
    before: tuple[str, ...]
    after: tuple[str, ...]
    chosen: str
    verdict: str | None = None
    summary: str = ""
    differences: tuple[str, ...] = ()
    report: str | None = None
    problem: str = ""

    @property
    def sentence(self) -> str:
        """Which logs, and what came of it."""
        return f"{self.vessel}, {self.chosen}: {self.problem or self.summary}"


@dataclass(frozen=True)
class BatchResult(Record):
    """Schema ``ferryid.batch/1``.

    Attributes
    ----------
    schema, ferryid_version
        Name of the form, and what made it.
    counts
        How many ``logs`` there are, how many ended in each status, and how many were ``done_before``.
    recipe
        What was done: ``steps``, their settings, and the ``model``.
    memory
        Of the processes.
    folder, summary, page
        Where all of it lies, and the paths of table and page.
    rows, trends, changes
        Of the logs, over them, and between the first and the last of them.
    seconds
        Time of the batch [s].
    """

    schema: str
    ferryid_version: str
    counts: Mapping[str, int]
    recipe: Mapping[str, Any]
    memory: MemoryUse
    folder: str
    summary: str
    page: str
    rows: tuple[SummaryRow, ...]
    trends: tuple[Trend, ...]
    changes: tuple[Change, ...]
    seconds: float
