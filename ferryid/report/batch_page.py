"""The page of a batch: one row a log, to be filtered and sorted, and what changes over the dates; it needs nothing else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from itertools import groupby
from os.path import commonpath
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from ferryid.counts import counted
from ferryid.diagnose import JUDGING
from ferryid.report import batch_figures
from ferryid.report.diagnosis_words import title
from ferryid.report.html import template
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


def render(result: Mapping[str, Any]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    result
        Schema ``ferryid.batch/1``.
    """
    rows = [_row(row) for row in result["rows"]]
    # What could not be read may lie anywhere, and keeps the path that was given.
    root = _common([row["log"] for row in rows if not row["bare"]])
    for row in rows:
        row["path"] = row["log"].removeprefix(root)
    counts, memory = result["counts"], result["memory"]
    return template("batch.html").render(
        rows=rows,
        root=root,
        made=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC, ferryid {result['ferryid_version']}",
        headline=_headline(counts),
        counts=[(WORDS[name], counts[name]) for name in WORDS if counts[name] and counts["logs"] != counts[name]],
        verdicts=sorted(Counter(row["verdict"] for row in rows if row["verdict"]).items()),
        accepted=Counter(row["fit"] for row in rows if row["fit"]),
        trends=[trend["says"] for trend in result["trends"] if trend["says"]],
        figures=[*_findings(result["trends"]), *_errors(result["rows"])],
        choices={name: sorted({row[name] for row in rows if row[name]}) for name in ("vessel", "status", "verdict")},
        effects=sorted({effect for row in rows for effect in row["effects"]}),
        dated=any(row["date"] for row in rows),
        vessels=sorted({row["vessel"] for row in rows}),
        noted=any(row["note"] for row in rows),
        steps=[step for step in ("fit", "evaluate", "diagnose") if step in result["recipe"]["steps"]],
        model=_examined(result),
        columns=_columns(result["recipe"]),
        memory=memory,
        gigabyte=1 << 30,
        took=sum(row["seconds"] for row in rows),
    )


def _columns(recipe: Mapping[str, Any]) -> int:
    """Return how many columns tell of results."""
    steps = recipe["steps"]
    return 2 * ("diagnose" in steps) + 2 * ("fit" in steps) + (1 + bool(recipe["model"])) * ("evaluate" in steps)


def _examined(result: Mapping[str, Any]) -> str:
    """Return the name of the model that logs were evaluated against, empty for the hull of the profile."""
    names = [row["evaluate"]["of"] for row in result["rows"] if row["evaluate"]]
    return "" if not result["recipe"]["model"] else next(iter(names), result["recipe"]["model"])


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


def _row(row: Mapping[str, Any]) -> dict[str, Any]:
    fit, evaluation, diagnosis = row["fit"], row["evaluate"], row["diagnose"]
    findings = diagnosis["findings"] if diagnosis else []
    sure = [one for one in findings if one["probability"] > JUDGING.hint_probability]
    links = [
        (name, quote(f"{row['folder']}/{made[key]}"))
        for name, made, key in (
            ("fit", fit, "report"),
            ("diagnosis", diagnosis, "report"),
            ("evaluation", evaluation, "result"),
        )
        if made
    ]
    if row["status"] == "failed":
        links.append(("traceback", quote(f"{row['folder']}/traceback.txt")))
    return {
        **{name: row[name] for name in ("log", "name", "status", "reason", "vessel", "note")},
        "date": (row["date"] or "")[:10],
        "time": _time(row),
        "minutes": None if row["duration_s"] is None else row["duration_s"] / 60.0,
        "verdict": (diagnosis["verdict"] if diagnosis else "").replace("_", " "),
        "found": _named(sure),
        "perhaps": _named([one for one in findings if one not in sure]),
        "effects": list(dict.fromkeys(title(one["effect"]) for one in findings)),
        "fit": "" if fit is None else "accepted" if fit["accepted"] else "not accepted",
        "fit_mse": None if fit is None else fit["normalised_mse"],
        "warnings": list(dict.fromkeys(said for made in (fit, evaluation) if made for said in made["warnings"])),
        "lost": _lost(row.get("lost")),
        "evaluated": None if evaluation is None else _mean_error(evaluation),
        "links": links,
        "bare": not (fit or evaluation or diagnosis),
        "seconds": sum(row["seconds"].values()),
        "peak": row["peak_bytes"],
    }


def _lost(lost: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return what a log lost, what of it is left out, both short, all sentences, and seconds of both to sort by."""
    if lost is None:
        return {"messages": "", "left_out": "", "says": [], "seconds": None}
    parts = [counted(lost["messages"], "message")] if lost["messages"] else ["unknown"] if lost["unknown"] else []
    parts += [f"{lost['seconds']:.1f} s"] if lost["seconds"] else []
    return {
        "messages": ", ".join(parts) + (" or more" if lost["unknown"] and lost["messages"] else ""),
        "left_out": f"{lost['seconds_left_out']:.1f} s left out" if lost["rows_left_out"] else "",
        "says": lost["says"],
        "seconds": lost["seconds"] + lost["seconds_left_out"],
    }


def _time(row: Mapping[str, Any]) -> str:
    """Return when a log begins; of a manifest that gives the day, no more than the day."""
    time = (row["date"] or "")[:16].replace("T", " ")
    return time.removesuffix(" 00:00") if row["date_from"] == "manifest" else time


def _named(findings: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    """Return names, each once, and what is said of them."""
    told: dict[str, list[str]] = {}
    for one in findings:
        name = title(one["effect"], one["instance"])
        told.setdefault(name[:1].lower() + name[1:], []).append(one["says"])
    return [{"name": name, "says": " ".join(says)} for name, says in told.items()]


def _mean_error(evaluation: Mapping[str, Any]) -> dict[str, Any]:
    """Return root-mean-square errors of an evaluation, and its squared error over the base model's where that is another."""
    mse = evaluation["mse"]
    return {
        "rms": [None if mse[axis] is None else mse[axis] ** 0.5 for axis in AXES],
        "ratio": evaluation["normalised_mse"],
    }


def _findings(trends: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    shown = []
    for (vessel, head), group in groupby(trends, lambda one: (one["vessel"], one["title"])):
        every = [one for one in group if len(one["points"]) >= FEWEST_DRAWN]
        if not every:
            continue
        logs = {point["log"] for one in every for point in one["points"]}
        order = "" if every[0]["dated"] else " Not all logs have a date, so that they stand in their order."
        shown.append(
            {
                "title": f"{head}, {vessel}",
                "svg": batch_figures.findings(every),
                "caption": f"{head} in {counted(len(logs), 'log')}, with their 95 % intervals. Hollow: a "
                "hint, less likely than not. "
                f"Grey: logs whose diagnosis did not find it.{order}",
            }
        )
    return shown


def _errors(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    shown = []
    for vessel in dict.fromkeys(row["vessel"] for row in rows):
        own = [row for row in rows if row["vessel"] == vessel and (row["fit"] or row["evaluate"])]
        dated = all(row["date"] for row in own)
        if len(own) < FEWEST_DRAWN:
            continue
        own.sort(key=lambda row: datetime.fromisoformat(row["date"]) if dated else 0)
        of = next((row["evaluate"]["of"] for row in own if row["evaluate"]), "")
        evaluated = f" Crosses: {of}, on the whole log." if of else ""
        fitted = (
            "Circles: the base model, and the model fitted to the log itself, on the log's validation rows."
            if any(row["fit"] for row in own)
            else ""
        )
        shown.append(
            {
                "title": f"Force errors, {vessel}",
                "svg": batch_figures.errors(own, dated),
                "caption": f"Root-mean-square force error of {counted(len(own), 'log')}. {fitted}{evaluated}",
            }
        )
    return shown
