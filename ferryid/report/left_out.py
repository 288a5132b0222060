"""Stretches of a log that are not used, for reports: as rows of a table, and as shading in figures over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ferryid.counts import counted
from ferryid.signals.track import Interval, LeftOut

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEFT_OUT = "#f7dcc8"
"""Colour of the shading, light orange beside the light blue of validation."""
MOST_SHOWN = 10
"""Stretches that are listed, the longest; the rest are counted."""


def intervals_of(left_out: Sequence[LeftOut]) -> tuple[Interval, ...]:
    """Return all stretches in order of time."""
    return tuple(sorted((one for every in left_out for one in every.intervals), key=lambda one: one.start_s))


def left_out_table(left_out: Sequence[LeftOut]) -> dict[str, Any]:
    """Return the longest stretches in order of time as `rows` of text, and what the others sum to as `rest`."""
    every = sorted(intervals_of(left_out), key=lambda one: one.start_s - one.end_s)
    shown, others = every[:MOST_SHOWN], every[MOST_SHOWN:]
    seconds = sum(one.end_s - one.start_s for one in others)
    return {
        "rows": [
            {
                "start": f"{one.start_s:.2f}",
                "end": f"{one.end_s:.2f}",
                "seconds": f"{one.end_s - one.start_s:.2f}",
                "signals": ", ".join(one.signals),
                "reason": one.reason,
            }
            for one in sorted(shown, key=lambda one: one.start_s)
        ],
        "rest": f"And {counted(len(others), 'shorter stretch')}, {seconds:.1f} s in all." if others else "",
    }


def shade_left_out(ax: Axes, left_out: Sequence[LeftOut], first_s: float, last_s: float) -> None:
    """Shade the stretches that are not used between two times, with one entry in the legend."""
    label: str | None = "left out"
    for one in intervals_of(left_out):
        start, end = np.clip([one.start_s, one.end_s], first_s, last_s).tolist()
        if end > start:
            # The line keeps a stretch of a second visible in a log of an hour.
            ax.axvspan(start, end, color=LEFT_OUT, linewidth=0.6, label=label)
            label = None
