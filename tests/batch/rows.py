"""Rows of a batch by hand."""

from __future__ import annotations

from typing import Any

from ferryid.batch.log_result import LogResult
from ferryid.batch.logs import Entry
from ferryid.batch.summary import summary_row
from ferryid.report.batch_rows import BatchResult, Change, MemoryUse, SummaryRow, Trend
from ferryid.types import AXES


def axes(value: float) -> dict[str, float]:
    return dict.fromkeys(AXES, value)


def row(log: str, day: int = 1, *, findings: tuple[dict[str, Any], ...] = (), **more: Any) -> SummaryRow:
    """Return the row of a log that was done on a day of May 2024."""
    kept = {
        "name": log.rpartition("/")[2],
        "files": [[log, 1000 * day, 5]],
        "stamp": {},
        "status": "done",
        "reason": "",
        "sha256": f"{day:064x}",
        "start_ns": 1_714_521_600_000_000_000 + (day - 1) * 86_400_000_000_000,
        "duration_s": 60.0 * day,
        "fit": {
            "model": "models/m/1.json", "report": "reports/m-v1/report.html", "accepted": day % 2 == 1, "headline": "",
            "warnings": ["one"], "normalised_mse": 0.1 * day, "per_axis": axes(0.1 * day),
            "mse": {"base": axes(100.0 * day), "model": axes(10.0 * day)},
        },
        "evaluate": {
            "of": "the hull of milliampere", "result": "evaluation.json", "normalised_mse": None, "per_axis": {},
            "mse": axes(81.0 * day), "warnings": [],
        },
        "diagnose": {
            "report": "reports/diagnosis-m/report.html", "model": None, "verdict": "explained" if findings else "matched",
            "findings": list(findings), "before": axes(4.0), "after": axes(1.0),
        },
        "seconds": {"fit": 2.0, "diagnose": 3.5},
        "memory_bytes": 4 << 30,
        "peak_bytes": 3 << 28,
    }  # fmt: skip
    entry = {name: more.pop(name) for name in ("date", "note") if name in more}
    return summary_row(
        Entry(log, **entry), "milliampere", LogResult.from_json({**kept, **more}), f"{kept['name']}-0123"
    )


def finding(
    effect: str, instance: str | None = None, probability: float = 0.99, says: str = "", **values: float
) -> dict[str, Any]:
    """Return a finding whose interval is 1 to either side."""
    parameters = {name: {"value": v, "low": v - 1.0, "high": v + 1.0, "unit": "-"} for name, v in values.items()}
    return {"effect": effect, "instance": instance, "probability": probability, "parameters": parameters, "says": says}


def result(
    *rows: SummaryRow, trends: tuple[Trend, ...] = (), changes: tuple[Change, ...] = (), model: str = ""
) -> BatchResult:
    """Return the result of a batch with these rows."""
    statuses = ("done", "partly", "refused", "failed", "memory", "lost")
    return BatchResult(
        schema="ferryid.batch/1",
        ferryid_version="0.1.0",
        counts={
            "logs": len(rows), "done_before": 0,
            **{status: sum(one.status == status for one in rows) for status in statuses},
        },
        recipe={"steps": ["fit", "evaluate", "diagnose"], "model": model},
        memory=MemoryUse(4 << 30, True, 3 << 28),
        folder="out/batch", summary="out/batch/summary.parquet", page="out/batch/index.html", seconds=1.0,
        rows=rows, trends=trends, changes=changes,
    )  # fmt: skip
