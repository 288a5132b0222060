"""A batch: the same steps for every log of an archive, each finished result kept, one table and one page of all.

All of it lies in ``<out>/batch``: ``results``, a folder for each log, and ``summary.parquet`` and ``index.html``. Tables of the
logs are in ``<out>/logs``, scripts of the page's interactive figures in ``<out>/reports/assets``, as those of every command.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from statistics import median
from typing import Any

from ferryid import __version__
from ferryid.batch import memory
from ferryid.batch.changes import (
    compare_groups_of,
    forget_others,
    group_tasks,
    kept_change,
    lost_groups,
)
from ferryid.batch.kept import Kept, key_of
from ferryid.batch.log_result import LogResult
from ferryid.batch.logs import Entry, entries_of
from ferryid.batch.recipe import Recipe, load_recipe
from ferryid.batch.remaining import Remaining, told_time
from ferryid.batch.spread import spread
from ferryid.batch.summary import summary_row, table_of, write_table
from ferryid.batch.task import DONE, STATUSES, Task, lost, work
from ferryid.batch.trend import trends_of
from ferryid.counts import counted
from ferryid.errors import FerryIdError, one_line
from ferryid.files import alone, dump_json, remove_abandoned, resolved, write_text
from ferryid.ingest import open_log
from ferryid.ingest.hashing import content_hash
from ferryid.models import Model, model_to_json
from ferryid.report.batch_findings import copies_in, found_in, losses_in
from ferryid.report.batch_page import render, timelines
from ferryid.report.batch_rows import BatchResult, Change, MemoryUse
from ferryid.report.diagnosis_report import patient
from ferryid.report.interactive import make_interactive
from ferryid.signals.recording import log_name
from ferryid.signals.time_ranges import as_text
from ferryid.types import TimeRanges
from ferryid.vessel import choose_vessel
from ferryid.vessel.profile import Profile

SCHEMA = "ferryid.batch/1"
SHOWN = 2
"""Names of logs at work that are shown."""
LONGEST = 28
"""Characters of such a name."""


def batch(
    asked: Sequence[str],
    out: Path,
    *,
    vessel: str | None = None,
    recipe: Path | None = None,
    processes: int = 2,
    dask: str | None = None,
    memory_limit: str = "4G",
    again: bool = False,
    ranges: TimeRanges = (),
    progress: Callable[[str], None],
    tell: Callable[[str], None],
) -> BatchResult:
    """Fit, evaluate and diagnose every log of an archive that is not done yet, and sum up all of it.

    Parameters
    ----------
    asked
        Paths, patterns and manifests: see `ferryid.batch.logs.entries_of`.
    out
        Output folder. On a cluster, all workers must see it, and the logs, under the same path.
    vessel
        Of logs whose manifest names none; found for each log where None, see `ferryid.vessel.choose_vessel`.
    recipe
        What is done: see `ferryid.batch.recipe`; all steps with their defaults where None.
    processes, dask
        What to spread the work over: see `ferryid.batch.spread.spread`.
    memory_limit
        Most memory of one process, like ``4G``.
    again
        Try again what went wrong before, though nothing has changed.
    ranges
        What is used of every log; all of it where empty.
    progress
        Called with what is done, what is at work and the time left.
    tell
        Called with single lines that are to be kept: what is done already, and each log that went wrong.

    Raises
    ------
    FerryIdError
        For a question, recipe, profile, model or cluster that cannot be used, and a disk that is full. A log that cannot be
        used is told in its row.
    """
    begun = time.monotonic()
    limit = memory.size_bytes(memory_limit)
    chosen = Recipe() if recipe is None else load_recipe(recipe)
    entries = entries_of(asked, vessel, tell)
    if not chosen.model:
        entries = _with_vessels(entries, tell)
    patients = _patients(entries, chosen, out)
    folder = resolved(out / "batch")
    with alone(folder, wait=False):
        remove_abandoned(out / "logs")
        kept = Kept(folder / "results")
        # The same for all logs, of which there may be thousands.
        asked_for, place = _hash(dump_json(chosen.plain())), resolved(out)
        tasks = [
            _task(entry, patients.get(entry.vessel), chosen, asked_for, limit, again, place, ranges)
            for entry in entries
        ]
        rows: dict[int, tuple[Path, LogResult]] = {}
        for number, (entry, task) in enumerate(zip(entries, tasks, strict=True)):
            table = None if entry.problem else patients[entry.vessel][0].table
            found = kept.of(task.folder, task.files, task.stamp, partial(_content, task.log, table))
            if found is not None and task.stands(found[1]):
                rows[number] = found
        left = [number for number in range(len(tasks)) if number not in rows]
        already = len(rows)
        _tell_done(tell, [row.status for _, row in rows.values()], [tasks[number] for number in left], kept)
        if left:
            _carry_out([tasks[number] for number in left], left, rows, len(tasks), processes, dask, progress, tell)
        results = [rows[number] for number in range(len(entries))]
        result = _summed_up(entries, results, already, patients, chosen, limit, out, begun)
        logs = {row.log: task.log for row, task in zip(result.rows, tasks, strict=True)}
        groups = partial(_changes, result, logs, patients, chosen, resolved(out), ranges, limit, processes, dask)
        result = replace(result, changes=groups(again, progress, tell), seconds=time.monotonic() - begun)
        progress("writing the summary")
        write_table(folder / "summary.parquet", table_of(result.rows))
        interactive = make_interactive(timelines(result), folder, resolved(out))
        for file, text in interactive.files().items():
            write_text(folder / file, text)
        write_text(folder / "index.html", render(result, interactive))
        write_text(folder / "batch.json", dump_json(result.to_json()))
    progress("")
    return result


def _with_vessels(entries: Sequence[Entry], tell: Callable[[str], None]) -> list[Entry]:
    """Return logs each with its vessel, or why none could be found; one line for every vessel that was found."""
    found, lines = list[Entry](), Counter[str]()
    for entry in entries:
        if entry.vessel is not None:
            found.append(entry)
            continue
        try:
            choice = choose_vessel(["+".join(map(str, entry.paths))])
        except FerryIdError as error:
            found.append(replace(entry, problem=str(error)))
            continue
        lines[choice.reason] += 1
        found.append(replace(entry, vessel=choice.reference))
    for line, count in lines.items():
        tell(f"{counted(count, 'log')} of {line}")
    return found


def _patients(entries: Sequence[Entry], recipe: Recipe, out: Path) -> dict[str | None, tuple[Profile, Model | None]]:
    """Return profile and model for the vessel of every log that has one."""
    found: dict[str | None, tuple[Profile, Model | None]] = {}
    for entry in entries:
        if entry.vessel not in found and not entry.problem:
            found[entry.vessel] = patient(entry.vessel, recipe.model or None, out)
    return found


def _task(
    entry: Entry,
    of: tuple[Profile, Model | None] | None,
    recipe: Recipe,
    recipe_hash: str,
    limit: int,
    again: bool,
    out: Path,
    ranges: TimeRanges,
) -> Task:
    profile, model = (None, None) if of is None else of
    text = None if model is None else dump_json(model_to_json(model))
    stamp = {
        "version": __version__,
        "recipe": recipe_hash,
        "profile": _hash(entry.problem) if profile is None else profile.sha256,
        "model": "" if text is None else _hash(text),
    }
    if ranges:
        stamp["ranges"] = as_text(ranges)
    log, paths = "+".join(map(str, entry.paths)), entry.paths
    name = log_name(log)
    place = out / "batch" / "results" / f"{name[:60]}-{key_of(paths, stamp)}"
    return Task(
        log,
        name,
        entry.files,
        place,
        out,
        entry.vessel or "",
        "" if profile is None else profile.text,
        "" if profile is None else profile.path,
        text,
        recipe,
        stamp,
        limit,
        again,
        entry.problem,
        ranges,
    )


def _hash(text: str) -> str:
    return sha256(text.encode()).hexdigest()


def _content(log: str, layout: Any) -> str | None:
    """Return the hash of a log as its recording has it; None where it cannot be read."""
    with suppress(FerryIdError, OSError):
        return content_hash(open_log(log, layout).paths)
    return None


def _tell_done(tell: Callable[[str], None], statuses: Sequence[str], left: Sequence[Task], kept: Kept) -> None:
    if statuses:
        bad = sum(status != DONE for status in statuses)
        vain = f", {bad} of them in vain (--again tries these again)" if bad else ""
        tell(f"{len(statuses)} of {counted(len(statuses) + len(left), 'log')} done already{vain}; {len(left)} left")
    differing = [kept.differing(task.files, task.stamp) for task in left]
    others = sum(map(bool, differing))
    if others:
        names = {"version": "version of ferryid"}
        what = " and ".join(names.get(one, one) for one in sorted(set().union(*differing)))
        tell(f"{others} of the logs left were done with another {what}, and are done again")


def _carry_out(
    tasks: Sequence[Task],
    numbers: Sequence[int],
    rows: dict[int, tuple[Path, LogResult]],
    count: int,
    processes: int,
    dask: str | None,
    progress: Callable[[str], None],
    tell: Callable[[str], None],
) -> None:
    """Do what is left, and put its rows to the others."""
    remaining = Remaining([sum(file.size_bytes for file in task.files) for task in tasks])
    start, at_work = time.monotonic(), list[int]()
    left = ""

    def show() -> None:
        names = [tasks[one].name[:LONGEST] for one in at_work[:SHOWN]]
        more = f" and {len(at_work) - SHOWN} more" if len(at_work) > SHOWN else ""
        now = f"; {', '.join(names)}{more}" if names else ""
        progress(f"{len(rows)} of {counted(count, 'log')}{left}{now}")

    def begin(number: int) -> None:
        if number not in at_work:
            at_work.append(number)
        show()

    with spread(processes, dask, apart=True) as workers:
        show()
        for number, row in workers.over(work, tasks, begun=begin, lost=lost):
            if number in at_work:
                at_work.remove(number)
            rows[numbers[number]] = tasks[number].folder, row
            left = f", {told_time(remaining.seconds(number, time.monotonic() - start))} left"
            if row.status != DONE:
                tell(one_line(f"{row.status}: {tasks[number].log}: {row.reason}"))
            show()


def _changes(
    result: BatchResult,
    logs: Mapping[str, str],
    patients: Mapping[str | None, tuple[Profile, Model | None]],
    recipe: Recipe,
    out: Path,
    ranges: TimeRanges,
    limit: int,
    processes: int,
    dask: str | None,
    again: bool,
    progress: Callable[[str], None],
    tell: Callable[[str], None],
) -> tuple[Change, ...]:
    """Return what changed in each vessel whose logs allow a comparison; what an earlier run found is not done again."""
    if not recipe.versus or "diagnose" not in recipe.steps:
        return ()
    vessels = {profile.name: (profile, model) for profile, model in patients.values()}
    folder = out / "batch" / "changes"
    tasks = group_tasks(result.rows, logs, result.trends, vessels, folder, out, recipe.withhold, ranges, limit)
    forget_others(folder, tasks)
    found: dict[int, Change] = {}
    for number, task in enumerate(tasks):
        change = kept_change(task.folder)
        if change is not None and not (again and change.problem):
            found[number] = change
    left = [number for number in range(len(tasks)) if number not in found]
    if left:
        with spread(processes, dask, apart=True) as workers:
            progress(f"comparing the first and the last logs of {counted(len(left), 'vessel')}")
            for number, change in workers.over(compare_groups_of, [tasks[one] for one in left], lost=lost_groups):
                found[left[number]] = change
                if change.problem:
                    tell(one_line(change.sentence))
    return tuple(found[number] for number in range(len(tasks)))


def _summed_up(
    entries: Sequence[Entry],
    found: Sequence[tuple[Path, LogResult]],
    done_before: int,
    patients: Mapping[str | None, tuple[Profile, Model | None]],
    recipe: Recipe,
    limit: int,
    out: Path,
    begun: float,
) -> BatchResult:
    root = out / "batch"
    vessels = ["" if entry.problem else patients[entry.vessel][0].name for entry in entries]
    rows = tuple(
        summary_row(entry, name, row, folder.name)
        for entry, name, (folder, row) in zip(entries, vessels, found, strict=True)
    )
    counts = Counter(row.status for row in rows)
    return BatchResult(
        schema=SCHEMA,
        ferryid_version=__version__,
        counts={"logs": len(rows), **{status: counts[status] for status in STATUSES}, "done_before": done_before},
        recipe={**recipe.plain(), "model": recipe.model},
        memory=MemoryUse(limit, memory.can_be_bounded(), max((row.peak_bytes for row in rows), default=0)),
        folder=str(root),
        summary=str(root / "summary.parquet"),
        page=str(root / "index.html"),
        rows=rows,
        trends=trends_of(rows, {profile.name: profile for profile, _ in patients.values()}),
        changes=(),
        seconds=time.monotonic() - begun,
    )


def render_batch(result: BatchResult) -> str:
    """Return a short account of a batch as text."""
    counts = result.counts
    bad = [f"{counts[status]} {status}" for status in STATUSES if status != DONE and counts[status]]
    lines = [f"{counted(counts['logs'], 'log')}: {counts[DONE]} done{''.join(f', {one}' for one in bad)}"]
    if damaged := losses_in(result.rows):
        lines.append(f"  {damaged}")
    if copies := copies_in(result.rows):
        lines.append(f"  {copies}")
    verdicts = Counter(row.diagnose.verdict for row in result.rows if row.diagnose)
    if verdicts:
        lines.append("  " + ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in sorted(verdicts.items())))
    if found := found_in(result.rows):
        lines.append(f"  {found}")
    fits = [row.fit for row in result.rows if row.fit]
    if fits:
        lines.append(f"  {sum(fit.accepted for fit in fits)} of {len(fits)} fits accepted")
    judged = [row.evaluate for row in result.rows if row.evaluate]
    ratios = [one.normalised_mse for one in judged if one.normalised_mse is not None]
    if ratios:
        told = f"{median(ratios):.3f} of its base model's, median of {counted(len(ratios), 'log')}"
        lines.append(f"  force MSE of {judged[0].evaluated}: {told}")
    lines += [f"  {trend.sentence}" for trend in result.trends if trend.sentence]
    for change in result.changes:
        if not change.problem:
            lines += [f"  {change.sentence}", *(f"    {one}" for one in change.differences)]
    peak = result.memory.peak_bytes
    bound = f"at most {memory.told_bytes(result.memory.limit_bytes)} allowed"
    held = bound if result.memory.bounded else "no bound: this system keeps none"
    lines.append(f"memory  {memory.told_bytes(peak)} for the largest log ({held} to a process)")
    lines += [f"table   {result.summary}", f"page    {result.page}"]
    return "\n".join(lines)
