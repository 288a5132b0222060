"""What is done with a single case, in whatever process or on whatever machine it is done."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.files import finite, replacing
from ferryid.prove.ask import blind_of
from ferryid.prove.case import Case
from ferryid.prove.parts import Generate, Judge, Trial


@dataclass(frozen=True)
class Log:
    """A log to be diagnosed.

    Attributes
    ----------
    proof
        Folder of the proof.
    sources
        Hash of the sources that it has to be diagnosed with.
    name, log, profile
        Of the case, and of the two files in its folder.
    """

    proof: Path
    sources: str
    name: str
    log: str
    profile: str

    @property
    def folder(self) -> Path:
        """Return the folder of log and profile."""
        return self.proof / "logs" / self.name

    @property
    def out(self) -> Path:
        """Return the folder for the model that comes of it."""
        return self.proof / "models" / self.name


def write(generate: Generate, logs: Path, case: Case) -> dict[str, Any]:
    """Write the log of a case into a folder of its own, whole or not at all.

    Returns
    -------
    dict
        Names of ``log`` and ``profile`` in that folder, and ``acted``.
    """
    with replacing(logs / case.name) as temporary:
        temporary.mkdir(parents=True)
        made = generate(case, temporary)
        more = {path.name for path in temporary.iterdir()} - {made.log.name, made.profile.name}
        if more:  # it may be an answer
            raise ValueError(f"beside a log there may be its profile only, found {', '.join(sorted(more))}")
    return {"log": made.log.name, "profile": made.profile.name, "acted": finite(dict(made.acted))}


def diagnosed(log: Log) -> dict[str, Any]:
    """Return what a blind process says of a log: see `ferryid.prove.ask.Blind.ask`.

    Raises
    ------
    FerryIdError
        Where the log is not to be seen from here, or ferryid is not the one that the seal names.
    """
    path = log.folder / log.log
    if not path.exists():
        raise FerryIdError(
            f"{path}: is not there for the process that is to diagnose it. "
            "Fix: give an --out that all workers of the cluster see under the same path"
        )
    # A model of an earlier try, which was killed before its line was written, must not make this one the second.
    shutil.rmtree(log.out, ignore_errors=True)
    blind = blind_of(log.proof)
    answer = blind.ask(path, log.folder / log.profile, log.out)
    if blind.sources != log.sources:
        raise FerryIdError(
            f"prove: a worker has other sources of ferryid ({blind.sources}) than those of the seal ({log.sources}). "
            "Fix: install the same version on all workers, and start them again"
        )
    return answer


def judged(judge: Judge, trial: Trial) -> Any:
    """Return what a judge says of a trial; where its input cannot be used, ``error`` says why.

    Raises
    ------
    UnwritableError
        Where it could not write what it needs.
    """
    trial.folder.mkdir(parents=True, exist_ok=True)
    try:
        return judge(trial)
    except UnwritableError:
        # A full disk says nothing of the trial.
        raise
    except FerryIdError as error:
        return {"error": str(error)}
