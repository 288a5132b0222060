"""What every part of the program shares: array aliases, the names of the axes, and the context of a run."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]
Nanoseconds = NDArray[np.int64]
"""Times since 1970 [ns]."""

AXES = ("surge", "sway", "yaw")
"""The three degrees of freedom of motion in the horizontal plane, in the order of every array over axes."""


TimeRange = tuple[str | float | None, str | float | None]
"""First and last time that are used of a log, each in seconds from its start, negative from its end, or as a clock time."""
TimeRanges = tuple[TimeRange, ...]
"""Several of them; none for all of a log."""


@dataclass(frozen=True)
class Given:
    """What a command was given, from which commands that follow it are made.

    Attributes
    ----------
    logs
        Logs as they were named; none of an archive.
    vessel
        Name or path of the profile; empty where it was found by the logs, or is no file.
    out
        Output folder; empty for the usual one.
    ranges
        What is used of every log; all of it where empty.
    """

    logs: tuple[str, ...] = ()
    vessel: str = ""
    out: str = ""
    ranges: TimeRanges = ()


NOTHING = Given()
"""What a call was given that is no command."""


def no_progress(_stage: str) -> None:
    """Show no progress."""


@dataclass(frozen=True)
class RunContext:
    """Where a run writes and how it tells of itself.

    Attributes
    ----------
    out
        Output folder.
    progress
        Called with the name of each stage.
    verify
        Check every checksum of the logs.
    tables_out
        Output folder whose ``logs`` keep the ingested tables, where that is another than `out`.
    keep_tables
        False reads the logs without keeping ingested tables.
    ranges
        What is used of every log; all of it where empty.
    command
        The words that it was asked for with, which its pages repeat.
    given
        Logs and options among them.
    """

    out: Path
    progress: Callable[[str], None] = no_progress
    verify: bool = False
    tables_out: Path | None = None
    keep_tables: bool = True
    ranges: TimeRanges = ()
    command: Sequence[str] = ()
    given: Given = NOTHING

    @property
    def tables(self) -> Path | None:
        """Output folder whose ``logs`` keep the ingested tables; None keeps none."""
        return (self.tables_out or self.out) if self.keep_tables else None


IN_MEMORY = RunContext(Path(os.devnull), keep_tables=False)
"""Context of a stage that keeps and writes nothing, and shows no progress."""


def by_axis(values: Sequence[float] | Floats) -> dict[str, float]:
    """Return three values under the names of the axes."""
    return {axis: float(value) for axis, value in zip(AXES, values, strict=True)}
