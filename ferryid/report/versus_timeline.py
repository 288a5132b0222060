"""Interactive figure of the differences between two groups of logs, from one property to the next."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose import Versus
from ferryid.report.figures import ROLES
from ferryid.report.timeline import Axis, Strip, Timeline, Trace
from ferryid.report.versus_figures import COLOURS, property_rows, reach_of


def versus_timeline(found: Versus) -> Timeline | None:
    """Return every parameter of every difference in usual sizes from none, with its 95 % interval; None without any."""
    rows = property_rows(found)
    if not rows:
        return None
    said = np.array([row.verdict for row in rows])
    values = np.array([(row.value, row.low, row.high) for row in rows])
    traces = []
    for verdict, colour in COLOURS.items():
        value, low, high = np.where(said == verdict, values.T, np.nan)
        if (said == verdict).any():
            traces.append(Trace(verdict, value, ROLES[colour], style="points", low=low, high=high))
    none = Trace("no difference", np.zeros(len(rows)), "grey", dash=(4.0, 3.0))
    reach = 1.05 * reach_of(rows)
    strip = Strip("difference, in usual sizes of the effect", (*traces, none), frame=(-reach, reach))
    axis = Axis("property of B relative to A", "name", tuple(row.name for row in rows))
    return Timeline("differences", np.arange(1.0, len(rows) + 1.0), (strip,), axis=axis)
