"""What a validation run is put together from: what draws, writes, evaluates and scores its cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from ferryid.json_record import Record
from ferryid.validation.case import Case
from ferryid.validation.records import CaseResult, Diagnosis


class WrittenLog(Protocol):
    """A log that was written, and the TOML file of its vessel."""

    @property
    def log(self) -> Path: ...
    @property
    def profile(self) -> Path: ...
    @property
    def more(self) -> tuple[Path, ...]:
        """Further logs, which are a campaign with the first."""
        ...

    @property
    def before(self) -> tuple[Path, ...]:
        """Logs that these are compared with: what changed between the groups is asked for then."""
        ...


class Generate(Protocol):
    """Writes the log of a case into a folder; `transfer` makes another of the same truth, with other noise."""

    def __call__(self, case: Case, folder: Path, *, transfer: bool = False) -> WrittenLog: ...


@dataclass(frozen=True)
class Trial:
    """A case that was diagnosed, with its answer: what an evaluator is given.

    Attributes
    ----------
    case
        The answer.
    log, profile
        What was diagnosed.
    diagnosis
        The blind diagnosis.
    model
        The model that it wrote, None where it wrote none.
    folder
        Where an evaluator may write; it is kept until the run ends.
    more
        Further logs, which are a campaign with the first.
    """

    case: Case
    log: Path
    profile: Path
    diagnosis: Diagnosis
    model: Path | None
    folder: Path
    more: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Evaluator:
    """An evaluation of every trial once the answers are published: a function, and the type of what it returns."""

    function: Callable[[Trial], Record | None]
    result: type[Record]


@dataclass(frozen=True)
class Pipeline:
    """What a validation run is put together from; functions of single cases are such that another process can import them.

    Attributes
    ----------
    draw
        Returns the cases of a seed, of so many runs and of these cells only, all where there are none.
    generate
        Writes the log of a case.
    realise
        Returns parameters by effect that are part of the answer and that only a simulated trial gives.
    evaluators
        By name.
    score
        Makes scores of all results.
    targets
        Makes of the scores which targets were reached: mappings of ``what``, ``reached``, ``sure`` and ``tested``.
    render
        Makes texts of the result and the scores, by the names of their files in the folder of the run; None makes none.
    folder
        Name of the run's folder in the output folder; its page has the same.
    recordings
        Options by which real recordings were given, ``real`` and ``vessel``; empty for simulated trials.
    fingerprint
        Hash by which these recordings are recognised.
    remarks
        Returns, after the draw, lines on what could not be drawn.
    """

    draw: Callable[[int, float, Sequence[str]], Sequence[Case]]
    generate: Generate
    realise: Callable[[Case], Mapping[str, Mapping[str, float]]]
    evaluators: Mapping[str, Evaluator]
    score: Callable[[Sequence[CaseResult]], Record]
    targets: Callable[[Any], Sequence[Record]]
    render: Callable[[Mapping[str, Any], Any], Mapping[str, str]] | None = None
    folder: str = "proof"
    recordings: Mapping[str, str] = field(default_factory=dict)
    fingerprint: str = ""
    remarks: Callable[[], Sequence[str]] = lambda: ()
