"""What came of one log: the content of ``row.json``, from which a batch goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

from ferryid.batch.recipe import STEPS
from ferryid.json_record import Number, Record
from ferryid.report.batch_rows import DiagnosisSummary, EvaluationSummary, FitSummary
from ferryid.signals.data_quality import LostData

StepSummary: TypeAlias = FitSummary | EvaluationSummary | DiagnosisSummary


class LogFile(NamedTuple):
    """A file of a log, by which an unchanged log is known: path, size, and time of change [ns]."""

    path: str
    size_bytes: int
    changed_ns: int


@dataclass(frozen=True, kw_only=True)
class LogResult(Record):
    """What came of one log.

    Attributes
    ----------
    name
        Of the log.
    files
        Its files; none for a log that is not there.
    stamp
        Version of ferryid, and hashes of recipe, profile and model.
    status, reason
        How it ended, of `ferryid.batch.task.STATUSES`, and why.
    sha256, start_ns, duration_s, lost
        Hash of its content, its first time [ns], its length [s], and what of it could not be read or is not used; None
        where it could not be read.
    memory_bytes, peak_bytes
        Most memory that its process was allowed, and that it needed.
    seconds
        Time of each step [s].
    fit, evaluate, diagnose
        Results of the steps; None for one that is not in the recipe or has no result, which is not written.
    """

    name: str
    files: tuple[LogFile, ...]
    stamp: Mapping[str, str]
    status: str
    reason: str
    sha256: str | None
    start_ns: int | None
    duration_s: Number | None
    lost: LostData | None = None
    memory_bytes: int
    peak_bytes: int
    seconds: Mapping[str, Number]
    fit: FitSummary | None = None
    evaluate: EvaluationSummary | None = None
    diagnose: DiagnosisSummary | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {key: value for key, value in super().to_json().items() if key not in STEPS or value is not None}

    def after(self, step: str, seconds: float, found: StepSummary | None = None) -> LogResult:
        """Return it with the time of a step [s], and its result where it has one."""
        more: dict[str, Any] = {} if found is None else {step: found}
        return replace(self, seconds={**self.seconds, step: seconds}, **more)
