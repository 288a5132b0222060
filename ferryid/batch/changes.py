"""What changed in a vessel over the dates of its logs: logs before and after a step, or the first and the last, as two groups.

Single logs are often too short to show what many together do, so that groups are compared where no log by itself shows a
change, too: see `ferryid.diagnose.versus`.
"""

from __future__ import annotations

import json
import os
import shutil
import traceback
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ferryid import __version__
from ferryid.batch import memory
from ferryid.batch.kept import key_of
from ferryid.batch.task import FAILED, TRACEBACK, how_it_ended
from ferryid.batch.trend import FEWEST
from ferryid.counts import counted
from ferryid.errors import UnwritableError
from ferryid.files import dump_json, write_text
from ferryid.models import Model
from ferryid.report.batch_rows import Change, SummaryRow, Trend, by_date
from ferryid.signals.time_ranges import as_text
from ferryid.types import RunContext, TimeRanges
from ferryid.vessel.profile import Profile

MOST = 6
"""Logs of a group: those next to a step, or the first and the last, so that a batch of years takes no longer for it."""
CHANGE = "change.json"


@dataclass(frozen=True)
class GroupTask:
    """Two groups of logs of a vessel, and where the comparison goes.

    Attributes
    ----------
    before, after
        Paths of the logs; parts of one recording joined by ``+``.
    change
        What is known of the result before: vessel, names of the logs, how they were chosen.
    folder, tables
        For the results; the output folder that has the ingested tables.
    profile_text, profile_path, model_text
        The vessel, and the model that is examined; the profile's hull where None.
    withhold, ranges
        Signals to hide, and what of every log is used.
    memory_bytes
        The bound.
    """

    before: tuple[str, ...]
    after: tuple[str, ...]
    change: Change
    folder: Path
    tables: Path
    profile_text: str
    profile_path: str
    model_text: str | None
    withhold: tuple[str, ...]
    ranges: TimeRanges
    memory_bytes: int


def groups_of(rows: Sequence[SummaryRow], trends: Sequence[Trend]) -> tuple[list[SummaryRow], list[SummaryRow], str]:
    """Return two groups of the logs of one vessel, and how they were chosen; empty where its logs allow none.

    Parameters
    ----------
    rows
        Of one vessel.
    trends
        Of its findings: logs are divided where the clearest of them steps.
    """
    own, dated = by_date([row for row in rows if row.diagnose])
    changed = [one for one in trends if one.kind]
    if len({row.sha256 for row in own}) < FEWEST or not (dated or changed):
        return [], [], ""
    steps = sorted((one for one in changed if one.kind == "steps"), key=lambda one: one.change["chance"])
    if steps:
        cut = _place_of(steps[0])
        before, after = _once(own[:cut])[-MOST:], _once(own[cut:])[:MOST]
        title = f"{steps[0].title[:1].lower()}{steps[0].title[1:]}"
        return before, after, f"{counted(len(after), 'log')} after the step of {title} against {len(before)} before it"
    every = _once(own)
    third = min(len(every) // 3, MOST)
    return every[:third], every[-third:], f"the last {counted(third, 'log')} against the first {third}"


def _place_of(step: Trend) -> int:
    """Return how many logs are before a step."""
    places = [point.place for point in step.points if point.value is not None]
    places += [one.place for one in step.absent] if step.neutral is not None else []
    return sorted(places)[int(step.change["at"])]


def _once(rows: Sequence[SummaryRow]) -> list[SummaryRow]:
    """Return rows without further copies of a log."""
    return list({row.sha256: row for row in reversed(rows)}.values())[::-1]


def group_tasks(
    rows: Sequence[SummaryRow],
    logs: Mapping[str, str],
    trends: Sequence[Trend],
    vessels: Mapping[str, tuple[Profile, Model | None]],
    folder: Path,
    tables: Path,
    withhold: tuple[str, ...],
    ranges: TimeRanges,
    memory_bytes: int,
) -> list[GroupTask]:
    """Return the comparisons of a batch, one a vessel whose logs allow one.

    Parameters
    ----------
    rows, trends
        Of the batch.
    logs
        Paths of the logs by those of their rows.
    vessels
        Profile and model by the names of the vessels.
    folder
        For the folders of the comparisons.
    tables, withhold, ranges, memory_bytes
        As of `GroupTask`.
    """
    from ferryid.models import model_to_json

    tasks = []
    for vessel, (profile, model) in vessels.items():
        before, after, chosen = groups_of(
            [row for row in rows if row.vessel == vessel], [one for one in trends if one.vessel == vessel]
        )
        if not (before and after):
            continue
        text = None if model is None else dump_json(model_to_json(model))
        stamp = {
            "version": __version__,
            "profile": profile.sha256,
            "model": text or "",
            "withhold": " ".join(withhold),
            "ranges": as_text(ranges) if ranges else "",
            **{
                f"{side}{k}": str(row.sha256)
                for side, group in (("A", before), ("B", after))
                for k, row in enumerate(group)
            },
        }
        names = [tuple(row.name for row in group) for group in (before, after)]
        tasks.append(
            GroupTask(
                tuple(logs[row.log] for row in before),
                tuple(logs[row.log] for row in after),
                Change(vessel, names[0], names[1], chosen),
                folder / f"{vessel}-{key_of([], stamp)}",
                tables,
                profile.text,
                profile.path,
                text,
                withhold,
                ranges,
                memory_bytes,
            )
        )
    return tasks


def kept_change(folder: Path) -> Change | None:
    """Return what an earlier run found; None where it did not end."""
    try:
        return Change.from_json(json.loads((folder / CHANGE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return None


def forget_others(folder: Path, tasks: Sequence[GroupTask]) -> None:
    """Remove comparisons of other groups, which no page leads to any more."""
    stay = {task.folder for task in tasks}
    for one in folder.glob("*"):
        if one not in stay and one.is_dir() and not one.is_symlink():
            shutil.rmtree(one, ignore_errors=True)


def compare_groups_of(task: GroupTask) -> Change:
    """Compare two groups and write the report; what goes wrong stands in the result.

    Raises
    ------
    UnwritableError
        For a full disk and a folder that cannot be written.
    """
    change = task.change
    try:
        with warnings.catch_warnings(), memory.bounded(task.memory_bytes):
            warnings.simplefilter("ignore", RuntimeWarning)
            change = _compared(task)
    except UnwritableError:
        raise
    except Exception as error:  # noqa: BLE001 - the batch has its table and page without it
        status, reason = how_it_ended(error, task.folder, "diagnose", task.memory_bytes)
        change = replace(change, problem=reason)
        if status == FAILED:
            write_text(task.folder / TRACEBACK, "".join(traceback.format_exception(error)))
    write_text(task.folder / CHANGE, dump_json(change.to_json()))
    return change


def lost_groups(task: GroupTask) -> Change:
    """Return what stands for groups whose process died."""
    return replace(
        task.change,
        problem="its process died, time and again: most likely of too little memory. "
        "Fix: give fewer --processes, or compare the logs with ferryid diagnose --versus",
    )


def _compared(task: GroupTask) -> Change:
    from ferryid.diagnose import DiagnosisSettings
    from ferryid.models import model_from_json
    from ferryid.report.versus_report import compare_and_report
    from ferryid.vessel import parse_profile

    profile = parse_profile(task.profile_text, task.profile_path)
    model = None if task.model_text is None else model_from_json(json.loads(task.model_text), "the model of the recipe")
    made = compare_and_report(
        task.before,
        task.after,
        profile,
        DiagnosisSettings(model=model, withhold=task.withhold),
        RunContext(task.folder, tables_out=task.tables, ranges=task.ranges),
        command=["ferryid", "diagnose", *task.before, "--versus", *task.after, "--vessel", profile.name],
    )
    return replace(
        task.change,
        verdict=made.json["verdict"],
        summary=made.json["summary"],
        differences=tuple(
            one["says"] if one["confirmed"] else f"Hint: {one['says']}" for one in made.json["differences"]
        ),
        report=Path(os.path.relpath(made.report, task.folder.parent.parent)).as_posix(),
    )
