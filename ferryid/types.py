"""What every part of the program shares: array aliases, the names of the axes, and the context of a run."""

from __future__ import annotations

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


def no_progress(_stage: str) -> None:
    """Show no progress."""


@dataclass(frozen=True)
class RunContext:
    """Where a run writes and how it tells of itself.

    Attributes
    ----------
    out
        Output folder, whose ``logs`` keep the ingested tables.
    progress
        Called with the name of each stage.
    verify
        Check every checksum of the logs.
    """

    out: Path
    progress: Callable[[str], None] = no_progress
    verify: bool = False


def by_axis(values: Sequence[float] | Floats) -> dict[str, float]:
    """Return three values under the names of the axes."""
    return {axis: float(value) for axis, value in zip(AXES, values, strict=True)}
