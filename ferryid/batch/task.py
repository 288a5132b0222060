"""One log of a batch, in whatever process and on whatever machine: from its path to a row, whatever is wrong with it."""

from __future__ import annotations

import errno
import json
import threading
import time
import traceback
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.batch import memory
from ferryid.batch.kept import clear, read_row, write_row
from ferryid.batch.log_result import LogFile, LogResult
from ferryid.batch.recipe import Recipe
from ferryid.errors import FerryIdError, UnwritableError, one_line
from ferryid.files import alone, unwritable, write_text

if TYPE_CHECKING:
    from ferryid.signals.data_quality import LostData
    from ferryid.signals.stream import Recording
    from ferryid.types import TimeRanges
    from ferryid.vessel.profile import Profile

# Heavy packages are imported by the work itself, so that what it needs of memory is counted.

DONE, PARTLY, REFUSED, FAILED, MEMORY, LOST = STATUSES = ("done", "partly", "refused", "failed", "memory", "lost")
"""How a log ends: done; some steps cannot use it; it cannot be used; a bug of ours; more memory than there may be; its process
died."""
TRACEBACK = "traceback.txt"
_one_at_a_time = threading.Lock()
"""Memory is counted by process: a worker of a cluster with several threads does one log after the other."""


@dataclass(frozen=True)
class Task:
    """A log, and what is done with it.

    Attributes
    ----------
    log, name
        Absolute path, and name.
    files
        The log's.
    folder, tables
        For its results, and the output folder whose ``logs`` keep ingested tables; absolute.
    vessel
        What the profile was asked for by; empty where the model brought it.
    profile_text, profile_path
        The profile.
    model_text
        The model to evaluate and to diagnose from, as JSON; None for the profile's hull.
    recipe
        The steps and their settings.
    stamp
        Hashes of all of it.
    memory_bytes
        The bound.
    again
        True: done again if it went wrong.
    problem
        Why the log cannot be used, where that is known before it is read.
    ranges
        What of the log is used; all of it where empty.
    """

    log: str
    name: str
    files: tuple[LogFile, ...]
    folder: Path
    tables: Path
    vessel: str
    profile_text: str
    profile_path: str
    model_text: str | None
    recipe: Recipe
    stamp: Mapping[str, str]
    memory_bytes: int
    again: bool = False
    problem: str = ""
    ranges: TimeRanges = ()

    def row(self, status: str, reason: str = "") -> LogResult:
        """Return a row without results."""
        return LogResult(
            name=self.name,
            files=self.files,
            stamp=dict(self.stamp),
            status=status,
            reason=reason,
            sha256=None,
            start_ns=None,
            duration_s=None,
            memory_bytes=self.memory_bytes,
            peak_bytes=0,
            seconds={},
        )

    def stands(self, row: LogResult | None) -> bool:
        """Return whether a row tells of this log as it is now, and nothing of it is to be tried again."""
        if row is None or row.stamp != dict(self.stamp) or row.files != self.files:
            return False
        more = row.status in (MEMORY, LOST) and self.memory_bytes > row.memory_bytes
        return row.status == DONE or not (self.again or more)


def work(task: Task) -> LogResult:
    """Carry out a task, and return its row when all of it is on disk.

    Raises
    ------
    UnwritableError
        For a full disk and a folder that cannot be written: these say nothing of the log.
    """
    memory.count_what_is_used()
    # Another process may be at it still, whose cluster has lost sight of it.
    with _one_at_a_time, alone(task.folder):
        before = read_row(task.folder)
        if before is not None and task.stands(before):
            return before
        clear(task.folder)
        row = _row(task)
        write_row(task.folder, row)
        return row


def lost(task: Task) -> LogResult:
    """Return the row of a log whose processes died."""
    reason = (
        "its process died, time and again: most likely of too little memory. "
        "Fix: give fewer --processes, or diagnose the log by itself with ferryid diagnose"
    )
    with alone(task.folder):
        clear(task.folder)
        row = task.row(LOST, reason)
        write_row(task.folder, row)
    return row


def _row(task: Task) -> LogResult:
    memory.forget_peak()
    row = task.row(DONE)
    try:
        with warnings.catch_warnings(), memory.bounded(task.memory_bytes):
            # What NumPy cannot compute becomes NaN, and is told where it matters.
            warnings.simplefilter("ignore", RuntimeWarning)
            for so_far in _carry_out(task, row):
                row = so_far
    except UnwritableError:
        raise
    except Exception as error:  # noqa: BLE001 - whatever one log shows is told in its row, and the others go on
        status, reason = _how(task, error)
        row = replace(row, status=status, reason=reason)
        if status == FAILED:
            write_text(task.folder / TRACEBACK, "".join(traceback.format_exception(error)))
    return replace(row, peak_bytes=memory.peak_bytes())


def _carry_out(task: Task, row: LogResult) -> Iterator[LogResult]:
    """Yield the row of a task each time that something is added to it, so that an error loses nothing."""
    from ferryid.batch.steps import CARRY_OUT, Job
    from ferryid.models import model_from_json
    from ferryid.signals.cache import folder_of
    from ferryid.signals.recording import record
    from ferryid.vessel import parse_profile

    if task.problem:
        raise FerryIdError(task.problem)
    profile = parse_profile(task.profile_text, task.profile_path)
    model = None if task.model_text is None else model_from_json(json.loads(task.model_text), "the model of the recipe")
    begun = time.perf_counter()
    recording = record(task.log, profile, task.tables, ranges=task.ranges)
    row = replace(
        row,
        sha256=recording.sha256,
        start_ns=recording.start_ns,
        duration_s=(recording.end_ns - recording.start_ns) * 1e-9,
        lost=_lost(recording, profile),
    )
    row = row.after("read", time.perf_counter() - begun)
    yield row
    recorded = folder_of(task.tables, recording.name, recording.sha256, profile.sha256)
    del recording
    job = Job(
        task.log, task.name, task.vessel, profile, model, task.recipe, task.folder, task.tables, recorded, task.ranges
    )
    refused = {}
    for step in task.recipe.steps:
        begun, found = time.perf_counter(), None
        try:
            found = CARRY_OUT[step](job)
        except UnwritableError:
            raise
        except FerryIdError as error:
            status, reason = _how(task, error)
            if status != REFUSED:
                raise
            # A log too short for a fit may well be evaluated.
            refused[step] = reason
        row = row.after(step, time.perf_counter() - begun, found)
        yield row
    if refused:
        status = REFUSED if len(refused) == len(task.recipe.steps) else PARTLY
        reason = "; ".join(f"{step}: {reason}" for step, reason in refused.items())
        if len(set(refused.values())) == 1 and status == REFUSED:
            reason = next(iter(refused.values()))
        yield replace(row, status=status, reason=reason)


def _lost(recording: Recording, profile: Profile) -> LostData:
    """Return what of a log could not be read, and which rows no step uses; of one that is refused only the first."""
    from ferryid.signals.data_quality import LostData
    from ferryid.signals.prepare import track_of

    try:
        measured = track_of(recording, profile).measured
    except FerryIdError:
        return LostData.of(recording.losses, (), 0)
    rows = sum(one.rows for one in measured.left_out)
    return LostData.of(recording.losses, measured.left_out, rows + int(measured.usable.sum()))


def _how(task: Task, error: Exception) -> tuple[str, str]:
    """Return how a log ends with an error, and why; whoever reports it names the log."""
    status, reason = how_it_ended(error, task.folder, task.log, task.memory_bytes)
    if status == REFUSED and isinstance(error, FerryIdError):
        reason = reason.removeprefix(f"{task.log}: ").removeprefix(f"{task.name}: ")
    return status, reason


def how_it_ended(error: Exception, folder: Path, subject: str, memory_bytes: int) -> tuple[str, str]:
    """Return how work ends with an error, of `STATUSES`, and why in one line.

    Parameters
    ----------
    error
        What was raised.
    folder
        Where the results were to go.
    subject
        What the work was on, for a system's error that names no file.
    memory_bytes
        What the process was allowed.

    Raises
    ------
    UnwritableError
        Where the disk is full.
    """
    for cause in _causes(error):
        if isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT):
            raise unwritable(folder, cause) from error
        if isinstance(cause, MemoryError) or str(cause) == "can't start new thread":
            return MEMORY, f"needs more than {memory.told_bytes(memory_bytes)} of memory. Fix: give more with --memory"
    if isinstance(error, FerryIdError):
        return REFUSED, str(error)
    if isinstance(error, OSError):
        return REFUSED, one_line(
            f"{error.filename or subject}: {error.strerror or error}. Fix: check the file and the disk"
        )
    place = traceback.extract_tb(error.__traceback__)[-1]
    return FAILED, one_line(
        f"a bug of ferryid: {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"
    )


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__
