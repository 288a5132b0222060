"""The page of a batch: one row a log, to be filtered and sorted, and what changes over the dates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby
from os.path import commonpath
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from ferryid.counts import counted
from ferryid.diagnose import JUDGING
from ferryid.report import batch_figures
from ferryid.report.batch_findings import copies_in, found_in, is_damaged, losses_in, sized_name
from ferryid.report.batch_rows import (
    BatchResult,
    EvaluationSummary,
    FindingSummary,
    SummaryRow,
    Trend,
    by_date,
    date_text,
)
from ferryid.report.batch_timeline import errors_timeline, findings_timeline, row_id
from ferryid.report.diagnosis_words import positive_words, title
from ferryid.report.html import template
from ferryid.report.interactive import STATIC, Interactive
from ferryid.report.timeline import Timeline
from ferryid.signals.data_quality import LostData
from ferryid.types import AXES

WORDS = {
    "done": "done",
    "partly": "done in part",
    "refused": "refused",
    "failed": "failed by a bug of ferryid",
    "memory": "needed more memory than allowed",
    "lost": "lost with their process",
}
FEWEST_DRAWN = 2
"""Logs with a finding below which it is not drawn over dates."""


@dataclass(frozen=True)
class Lost:
    """What of a log was lost and what is left out, both short, all sentences, and seconds of both to sort by."""

    messages: str = ""
    left_out: str = ""
    sentences: tuple[str, ...] = ()
    seconds: float | None = None


@dataclass(frozen=True)
class NamedFinding:
    """The name of a finding, and what is said of it."""

    name: str
    sentences: str


@dataclass(frozen=True)
class MeanError:
    """Root-mean-square errors of an evaluation by axis, and its squared error over the base model's where that is another."""

    rms: tuple[float | None, ...]
    ratio: float | None


@dataclass(frozen=True)
class TableRow:
    """A row of the table of logs, as the template shows it; ``bare`` without results."""

    id: str
    log: str
    name: str
    status: str
    reason: str
    vessel: str
    note: str
    date: str
    time: str
    minutes: float | None
    verdict: str
    found: tuple[NamedFinding, ...]
    perhaps: tuple[NamedFinding, ...]
    effects: tuple[str, ...]
    fit: str
    fit_mse: float | None
    warnings: tuple[str, ...]
    lost: Lost
    evaluated: MeanError | None
    links: tuple[tuple[str, str], ...]
    bare: bool
    seconds: float
    peak_bytes: int


@dataclass(frozen=True)
class Figure:
    """A figure with title and caption; `marks` tells of those of the drawing, `timeline` is the number of its other form."""

    title: str
    svg: str
    caption: str
    marks: str
    timeline: int


def timelines(result: BatchResult) -> dict[int, Timeline]:
    """Return the interactive figures of the page by the places of their figures."""
    places = {id(row): place for place, row in enumerate(result.rows)}
    found = []
    for head, every in _findings(result.trends):
        diagnosed, _ = by_date([row for row in result.rows if row.vessel == every[0].vessel and row.diagnose])
        found.append(findings_timeline(head, every, diagnosed, places))
    found += [errors_timeline(head, rows, dated, places) for head, rows, dated in _errors(result.rows)]
    return dict(enumerate(found))


def render(result: BatchResult, interactive: Interactive = STATIC) -> str:
    """Return the page as HTML."""
    rows = [_row(row, row_id(place)) for place, row in enumerate(result.rows)]
    counts = result.counts
    return template("batch.html").render(
        rows=rows,
        # What could not be read may lie anywhere, and keeps the path that was given.
        root=_common([row.log for row in rows if not row.bare]),
        made=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC, ferryid {result.ferryid_version}",
        headline=_headline(counts),
        counts=[(WORDS[name], counts[name]) for name in WORDS if counts[name] and counts["logs"] != counts[name]],
        damaged=losses_in(result.rows),
        copies=copies_in(result.rows),
        found=found_in(result.rows),
        verdicts=sorted(Counter(row.verdict for row in rows if row.verdict).items()),
        accepted=Counter(row.fit for row in rows if row.fit),
        trends=[trend.sentence for trend in result.trends if trend.sentence],
        changes=[
            {
                "sentence": one.sentence,
                "differences": one.differences,
                "link": "" if one.report is None else quote(one.report),
            }
            for one in result.changes
        ],
        figures=_figures(result, interactive),
        assets=interactive.assets,
        choices={
            "vessel": sorted({row.vessel for row in rows if row.vessel}),
            "status": sorted({row.status for row in rows if row.status}),
            "verdict": sorted({row.verdict for row in rows if row.verdict}),
        },
        effects=sorted({effect for row in rows for effect in row.effects}),
        dated=any(row.date for row in rows),
        vessels=sorted({row.vessel for row in rows}),
        noted=any(row.note for row in rows),
        steps=[step for step in ("fit", "evaluate", "diagnose") if step in result.recipe["steps"]],
        model=_examined(result),
        columns=_columns(result.recipe),
        memory=result.memory,
        gigabyte=1 << 30,
        took=sum(row.seconds for row in rows),
    )


def _columns(recipe: Mapping[str, Any]) -> int:
    """Return how many columns tell of results."""
    steps = recipe["steps"]
    return 2 * ("diagnose" in steps) + 2 * ("fit" in steps) + (1 + bool(recipe["model"])) * ("evaluate" in steps)


def _examined(result: BatchResult) -> str:
    """Return the name of the model that logs were evaluated against, empty for the hull of the profile."""
    names = [row.evaluate.evaluated for row in result.rows if row.evaluate]
    model = str(result.recipe["model"])
    return next(iter(names), model) if model else ""


def _common(logs: Sequence[str]) -> str:
    """Return the folder that all logs are in, with a slash at its end, or nothing."""
    if not logs:
        return ""
    try:
        root = commonpath([str(PurePath(log).parent) for log in logs])
    except ValueError:  # absolute and relative ones
        return ""
    return f"{root}/" if root.strip("./") else ""


def _headline(counts: Mapping[str, int]) -> str:
    logs = counted(counts["logs"], "log")
    return f"{logs}, all done" if counts["logs"] == counts["done"] else f"{logs}, {counts['done']} done"


def _row(row: SummaryRow, name: str) -> TableRow:
    fit, evaluation, diagnosis = row.fit, row.evaluate, row.diagnose
    sure = [one for one in row.findings if one.probability > JUDGING.hint_probability]
    links = [
        *([("fit", fit.report)] if fit and fit.report else []),
        *([("diagnosis", diagnosis.report)] if diagnosis else []),
        *([("evaluation", evaluation.file)] if evaluation else []),
        *([("traceback", "traceback.txt")] if row.status == "failed" else []),
    ]
    return TableRow(
        id=name,
        log=row.log,
        name=row.name,
        status=f"{row.status}, damaged" if is_damaged(row) else row.status,
        reason=row.reason,
        vessel=row.vessel,
        note=row.note,
        date=(row.date or "")[:10],
        time=date_text(row),
        minutes=None if row.duration_s is None else row.duration_s / 60.0,
        verdict=(diagnosis.verdict if diagnosis else "").replace("_", " "),
        found=_named(sure),
        perhaps=_named([one for one in row.findings if one not in sure]),
        effects=tuple(dict.fromkeys(title(one.effect) for one in row.findings)),
        fit="" if fit is None else "accepted" if fit.accepted else "not accepted",
        fit_mse=None if fit is None else fit.normalised_mse,
        warnings=tuple(dict.fromkeys(said for made in (fit, evaluation) if made for said in made.warnings)),
        lost=_lost(row.lost),
        evaluated=None if evaluation is None else _mean_error(evaluation),
        links=tuple((name, quote(f"{row.folder}/{file}")) for name, file in links),
        bare=not (fit or evaluation or diagnosis),
        seconds=row.work_s,
        peak_bytes=row.peak_bytes,
    )


def _lost(lost: LostData | None) -> Lost:
    if lost is None:
        return Lost()
    parts = [counted(lost.messages, "message")] if lost.messages else ["unknown"] if lost.unknown else []
    parts += [f"{lost.seconds:.1f} s"] if lost.seconds else []
    return Lost(
        messages=", ".join(parts) + (" or more" if lost.unknown and lost.messages else ""),
        left_out=f"{lost.seconds_left_out:.1f} s left out" if lost.rows_left_out else "",
        sentences=lost.sentences,
        seconds=lost.seconds + lost.seconds_left_out,
    )


def _named(findings: Sequence[FindingSummary]) -> tuple[NamedFinding, ...]:
    """Return names with sizes, each once, and what is said of them."""
    sentences: dict[str, list[str]] = {}
    for one in findings:
        sentences.setdefault(sized_name(one), []).append(one.sentence)
    return tuple(NamedFinding(name, " ".join(several)) for name, several in sentences.items())


def _mean_error(evaluation: EvaluationSummary) -> MeanError:
    mse = [evaluation.mse[axis] for axis in AXES]
    return MeanError(tuple(None if one is None else one**0.5 for one in mse), evaluation.normalised_mse)


def _findings(trends: Sequence[Trend]) -> list[tuple[str, list[Trend]]]:
    """Return what is drawn of findings: title, and the parameters of an effect of a vessel."""
    shown = []
    for (vessel, head), group in groupby(trends, lambda one: (one.vessel, one.title)):
        every = [one for one in group if len(one.points) >= FEWEST_DRAWN]
        if every:
            shown.append((f"{head}, {vessel}", every))
    return shown


def _errors(rows: Sequence[SummaryRow]) -> list[tuple[str, list[SummaryRow], bool]]:
    """Return what is drawn of errors: title, the logs of a vessel in their order, and whether that is of their dates."""
    shown = []
    for vessel in dict.fromkeys(row.vessel for row in rows):
        own, dated = by_date([row for row in rows if row.vessel == vessel and (row.fit or row.evaluate)])
        if len(own) >= FEWEST_DRAWN:
            shown.append((f"Force errors, {vessel}", own, dated))
    return shown


def _figures(result: BatchResult, interactive: Interactive) -> list[Figure]:
    shown = []
    for head, every in _findings(result.trends):
        logs = {point.log for one in every for point in one.points}
        order = "" if every[0].dated else " Not all logs have a date, so that they stand in their order."
        caption = f"{every[0].title} in {counted(len(logs), 'log')}, with their 95 % intervals.{order}"
        caption = f"{caption} {positive_words(every[0].effect)}".rstrip()
        marks = "Hollow: a hint, less likely than not. Grey: logs whose diagnosis did not find it."
        shown.append((head, batch_figures.findings(every), caption, marks))
    for head, own, dated in _errors(result.rows):
        of = next((row.evaluate.evaluated for row in own if row.evaluate), "")
        caption = f"Root-mean-square force error of {counted(len(own), 'log')}."
        tested = []
        if any(row.fit for row in own):
            caption += " The base model and the model fitted to the log itself are tested on the log's validation rows."
            tested.append("Circles: the base model (hollow) and the fit.")
        if of:
            caption += f" {of[:1].upper()}{of[1:]} is tested on the whole log."
            tested.append(f"Crosses: {of}.")
        shown.append((head, batch_figures.errors(own, dated), caption, " ".join(tested)))
    return [Figure(*one, interactive.number(place)) for place, one in enumerate(shown)]
