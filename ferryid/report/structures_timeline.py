"""Interactive figure of compared structures, from one to the next."""

from __future__ import annotations

import numpy as np

from ferryid.identify.sweeps import StructureComparison
from ferryid.report.timeline import Axis, Strip, Timeline, Trace
from ferryid.types import AXES, Flags


def structures_timeline(one: StructureComparison) -> Timeline:
    """Return the error of every structure over the best one's, with its interval, a strip for each axis."""
    ratios = [structure.against_best for structure in one.structures]
    value, low, high = (
        np.array(parts) for parts in zip(*((ratio.value, ratio.low, ratio.high) for ratio in ratios), strict=True)
    )
    # A logarithm is of what is positive: an interval down to zero ends below all values, and what makes no error is not drawn.
    least = 0.5 * np.min(np.where(value > 0.0, value, np.inf), axis=0)
    value, high = (np.where(each > 0.0, each, np.nan) for each in (value, high))
    low = np.where(high > 0.0, np.maximum(low, least), np.nan)
    supported = np.array([structure is one.supported for structure in one.structures])
    kept = np.array([structure.kept for structure in one.structures])

    def marks(j: int, label: str, which: Flags, colour: str, *, hollow: bool = False) -> list[Trace]:
        if not which.any():
            return []
        middle, bottom, top = (np.where(which, each[:, j], np.nan) for each in (value, low, high))
        return [Trace(label, middle, colour, style="hollow" if hollow else "points", low=bottom, high=top)]

    strips = tuple(
        Strip(
            f"{axis}: MSE over the best structure's",
            (
                *marks(j, "supported", supported, "base"),
                *marks(j, "cannot be distinguished from the best", kept & ~supported, "new"),
                *marks(j, "poorer", ~kept & ~supported, "grey", hollow=True),
                Trace("as good as the best", np.ones(len(value)), "grey", dash=(4.0, 3.0)),
            ),
            "log",
        )
        for j, axis in enumerate(AXES)
    )
    names = tuple(structure.title for structure in one.structures)
    places = np.arange(1.0, len(names) + 1.0)
    return Timeline("structures", places, strips, axis=Axis("structure, the best first", "name", names))
