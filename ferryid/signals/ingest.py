"""Read logs into Parquet tables: what ``ferryid ingest`` does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ferryid.counts import counted
from ferryid.signals import cache
from ferryid.signals.parquet import unit_of
from ferryid.signals.recording import data_quality, record
from ferryid.types import TimeRanges
from ferryid.vessel.profile import Profile


def ingest(
    logs: Sequence[str],
    profile: Profile,
    out: Path,
    *,
    verify: bool = False,
    ranges: TimeRanges = (),
    progress: Callable[[str], None],
) -> dict[str, Any]:
    """Read the mapped signals of logs into ``out/logs``, one Parquet table per topic.

    Parameters
    ----------
    logs, profile, out, verify
        As of `ferryid.signals.recording.record`.
    ranges
        What of each log is written; all of it where empty.
    progress
        Called with the name of each stage.

    Returns
    -------
    dict
        Schema ``ferryid.ingest/1``.

    Raises
    ------
    FerryIdError
        For the first log that cannot be used; those before it are kept.
    """
    entries = []
    for path in logs:
        progress(f"reading {Path(path).name}")
        recording = record(path, profile, None if ranges else out, verify=verify, ranges=ranges)
        if ranges:
            cache.store(out, recording, cache.signatures([Path(file) for file in recording.files]), verify=verify)
        entries.append(
            {
                "name": recording.name,
                "sha256": recording.sha256,
                "folder": str(cache.folder_of(out, recording.name, recording.sha256, profile.sha256)),
                "tables": [
                    {
                        "topic": stream.topic,
                        "rows": len(stream.time_ns),
                        "columns": {name: unit_of(name) for name in stream.columns},
                    }
                    for stream in recording.streams.values()
                ],
                "data_quality": data_quality(recording, None),
            }
        )
    progress("")
    return {"schema": "ferryid.ingest/1", "profile": profile.name, "logs": entries}


def render_ingest(result: dict[str, Any]) -> str:
    """Return the tables written as text."""
    lines = []
    for log in result["logs"]:
        lines.append(f"{log['name']} -> {log['folder']}")
        for table in log["tables"]:
            columns = ", ".join(f"{name} [{unit}]" for name, unit in table["columns"].items())
            lines.append(f"  {table['topic']:<28}{counted(table['rows'], 'row'):>14}  {columns}")
        lines.extend(f"  {remark}" for remark in log["data_quality"]["remarks"])
    return "\n".join(lines)
