"""Figure of the differences between two groups of logs, with their intervals."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl

from ferryid.diagnose import GROUPS, Difference, Versus
from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, margins, svg_text

REACH, LEAST_REACH = 3.0, 0.1
"""Where the axis ends at most and at least, in usual sizes of a parameter; arrows point to what lies beyond."""
ROW, EDGES = 0.24, 0.9
"""Height of a row and of the margins [in]."""


def intervals(found: Versus) -> str:
    """Draw every parameter of every difference in usual sizes from none, with its 95 % interval."""
    rows: list[tuple[str, float, float, float, str]] = []
    for one in found.judged.differences:
        rows += _rows(one, BASE if one.doubt else NEW)
    for one in found.judged.compared:
        rows += _rows(one, MEASURED)
    reach = min(REACH, max([LEAST_REACH, *(max(-low, high) for _, _, low, high, _ in rows)]))
    with mpl.rc_context(STYLE):
        figure = margins(EDGES + ROW * max(1, len(rows)), left=2.9, top=0.3)
        ax: Any = figure.subplots()
        ax.axvline(0.0, color="#888888", linewidth=0.8)
        for place, (_, value, low, high, colour) in enumerate(rows):
            ax.plot([max(low, -reach), min(high, reach)], [place, place], color=colour, linewidth=1.6)
            if abs(value) <= reach:
                ax.plot([value], [place], "o", color=colour, markersize=4)
            for end, mark in ((-reach, "<"), (reach, ">")):
                if (low if end < 0.0 else -high) < -reach:
                    ax.plot([end], [place], mark, color=colour, markersize=5)
        for colour, label in ((NEW, "differs"), (BASE, "hint"), (MEASURED, "no difference seen")):
            if any(row[-1] == colour for row in rows):
                ax.plot([], [], "o-", color=colour, markersize=4, label=label)
        ax.set_yticks(range(len(rows)), [row[0] for row in rows], fontsize=8)
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.set_xlim(-1.05 * reach, 1.05 * reach)
        ax.set_xlabel("difference, in usual sizes of the effect")
        ax.grid(visible=False, axis="y")
        figure.legend(loc="upper right", ncols=3, fontsize=8, borderaxespad=0.1)
        return svg_text(figure)


def _rows(one: Difference, colour: str) -> list[tuple[str, float, float, float, str]]:
    rows = []
    for each in one.candidate.parameters:
        if each.name in one.estimates:
            found = one.estimates[each.name]
            # Of what acts in A relative to B, the other sign is that of B relative to A, to first order.
            sign = 1.0 if one.group == GROUPS[1] else -1.0
            value, low, high = (sign * (at - each.neutral) / each.size for at in (found.value, found.low, found.high))
            rows.append((f"{one.title}: {each.name.replace('_', ' ')}", value, min(low, high), max(low, high), colour))
    return rows
