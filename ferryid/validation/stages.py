"""What is done with a single case, in whatever process or on whatever machine it is done."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.files import replacing
from ferryid.json_record import Record
from ferryid.validation.case import Case
from ferryid.validation.interfaces import Generate, Trial
from ferryid.validation.records import Failure
from ferryid.validation.worker_client import worker_of


@dataclass(frozen=True)
class LogJob:
    """A log to be diagnosed.

    Attributes
    ----------
    run
        Folder of the run.
    sources
        Hash of the sources that it has to be diagnosed with.
    name, log, profile
        Of the case, and of the two files in its folder.
    more
        Further logs there, which are a campaign with the first.
    before
        Logs there that these are compared with: what changed is asked for then.
    """

    run: Path
    sources: str
    name: str
    log: str
    profile: str
    more: tuple[str, ...] = ()
    before: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """Return the folder of log and profile."""
        return self.run / "logs" / self.name

    @property
    def out(self) -> Path:
        """Return the folder for the model that comes of it."""
        return self.run / "models" / self.name


@dataclass(frozen=True)
class CaseFiles(Record):
    """Names in the folder of a case: log, vessel's profile, further logs of a campaign, and those it is compared with."""

    log: str
    profile: str
    more: tuple[str, ...] = ()
    before: tuple[str, ...] = ()


def write_case(generate: Generate, logs: Path, case: Case) -> dict[str, Any]:
    """Write the log of a case into a folder of its own, whole or not at all; return its `CaseFiles` as plain data."""
    with replacing(logs / case.name) as temporary:
        temporary.mkdir(parents=True)
        made = generate(case, temporary)
        more, before = (tuple(path.name for path in paths) for paths in (made.more, made.before))
        other = {path.name for path in temporary.iterdir()} - {made.log.name, made.profile.name, *more, *before}
        if other:  # it may be an answer
            raise ValueError(f"beside a log there may be its profile only, found {', '.join(sorted(other))}")
    return CaseFiles(made.log.name, made.profile.name, more, before).to_json()


def diagnose_case(job: LogJob) -> dict[str, Any]:
    """Return the diagnosis of a log by a process that is given nothing else, as plain data.

    Raises
    ------
    FerryIdError
        Where the log cannot be seen from here, or ferryid is not the one of the commitment.
    """
    path = job.folder / job.log
    if not path.exists():
        raise FerryIdError(
            f"{path}: not found by the process that is to diagnose it. "
            "Fix: give an --out that all workers of the cluster see under the same path"
        )
    # A model of an earlier try, which was killed before its line was written, must not make this one the second.
    shutil.rmtree(job.out, ignore_errors=True)
    worker = worker_of(job.run)
    more, before = (tuple(job.folder / name for name in names) for names in (job.more, job.before))
    diagnosis = worker.diagnose(path, job.folder / job.profile, job.out, more, before)
    if worker.sources != job.sources:
        raise FerryIdError(
            f"prove: a worker has other sources of ferryid ({worker.sources}) than those of the commitment "
            f"({job.sources}). Fix: install the same version on all workers, and start them again"
        )
    return diagnosis.to_json()


def evaluate_case(function: Callable[[Trial], Record | None], trial: Trial) -> dict[str, Any] | None:
    """Return what an evaluator makes of a trial as plain data; where its input cannot be used, a `Failure`.

    Raises
    ------
    UnwritableError
        Where it could not write what it needs.
    """
    trial.folder.mkdir(parents=True, exist_ok=True)
    try:
        found = function(trial)
    except UnwritableError:
        # A full disk is no property of the trial.
        raise
    except FerryIdError as error:
        found = Failure(str(error))
    return None if found is None else found.to_json()
