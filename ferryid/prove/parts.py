"""What a proof is put together from: what draws, writes, judges and scores."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ferryid.prove.case import Case


class Written(Protocol):
    """A log that was written.

    Attributes
    ----------
    log, profile
        The log, and the TOML file of its vessel.
    acted
        What effects did that a case does not say, by effect and parameter.
    """

    @property
    def log(self) -> Path: ...
    @property
    def profile(self) -> Path: ...
    @property
    def acted(self) -> Mapping[str, Mapping[str, float]]: ...


class Generate(Protocol):
    """Writes the log of a case into a folder; `again` makes another of the same truth, with other noise."""

    def __call__(self, case: Case, folder: Path, *, again: bool = False) -> Written: ...


@dataclass(frozen=True)
class Trial:
    """A case that was diagnosed, with its answer: what a judge is given.

    Attributes
    ----------
    case, acted
        The answer, and what its effects did.
    log, profile
        What was diagnosed.
    diagnosis
        What was said, as `ferryid.prove.blind.diagnosed` has it.
    model
        The model that came of it, None where none did.
    folder
        Where a judge may write, and another log of the same truth goes; it is kept until the proof ends.
    """

    case: Case
    acted: Mapping[str, Mapping[str, float]]
    log: Path
    profile: Path
    diagnosis: Mapping[str, Any]
    model: Path | None
    folder: Path


Judge = Callable[[Trial], Any]


@dataclass(frozen=True)
class Parts:
    """What a proof is put together from; all but `draw` and `score` are functions that another process can import.

    Attributes
    ----------
    draw
        Returns the cases of a seed, of so many runs and of these cells only, all where there are none.
    generate
        Writes the log of a case.
    judges
        By name: what is asked of every trial once the answers are open, as plain data.
    score
        Makes ``targets`` and ``scores`` of all trials, each a mapping with ``case``, ``acted``, ``diagnosis`` and what every
        judge said under the name of the judge.
    tell
        Makes texts of the result and all trials, by the names of their files in the folder of the proof; None makes none.
    """

    draw: Callable[[int, float, Sequence[str]], Sequence[Case]]
    generate: Generate
    judges: Mapping[str, Judge]
    score: Callable[[Sequence[Mapping[str, Any]]], Mapping[str, Any]]
    tell: Callable[[Mapping[str, Any], Sequence[Mapping[str, Any]]], Mapping[str, str]] | None = None
