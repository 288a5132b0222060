"""Figure of the differences between two groups of logs, with their intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib as mpl

from ferryid.diagnose import GROUPS, Difference, Versus
from ferryid.effects.wording import parameter_word
from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, margins, svg_text

REACH, LEAST_REACH = 3.0, 0.1
"""Where the axis ends at most and at least, in usual sizes of a parameter; arrows point to what lies beyond."""
ROW, EDGES = 0.24, 0.9
"""Height of a row and of the margins [in]."""
COLOURS = {"differs": NEW, "hint": BASE, "no difference seen": MEASURED}
"""By what is said of a property."""


@dataclass(frozen=True)
class PropertyRow:
    """A parameter of B relative to A, with its 95 % interval, in usual sizes of the effect; `verdict` is a key of `COLOURS`."""

    name: str
    value: float
    low: float
    high: float
    verdict: str


def property_rows(found: Versus) -> list[PropertyRow]:
    """Return every parameter of every difference: first those that differ."""
    rows = [row for one in found.judged.differences for row in _rows(one, "hint" if one.doubt else "differs")]
    return rows + [row for one in found.judged.compared for row in _rows(one, "no difference seen")]


def reach_of(rows: list[PropertyRow]) -> float:
    """Return how far the axis reaches to both sides, in usual sizes."""
    return min(REACH, max([LEAST_REACH, *(max(-row.low, row.high) for row in rows)]))


def intervals(found: Versus) -> str:
    """Draw every parameter of every difference in usual sizes from none, with its 95 % interval."""
    rows = property_rows(found)
    reach = reach_of(rows)
    with mpl.rc_context(STYLE):
        figure = margins(EDGES + ROW * max(1, len(rows)), left=2.9, top=0.3)
        ax: Any = figure.subplots()
        ax.axvline(0.0, color="#888888", linewidth=0.8)
        for place, row in enumerate(rows):
            colour = COLOURS[row.verdict]
            ax.plot([max(row.low, -reach), min(row.high, reach)], [place, place], color=colour, linewidth=1.6)
            if abs(row.value) <= reach:
                ax.plot([row.value], [place], "o", color=colour, markersize=4)
            for end, mark in ((-reach, "<"), (reach, ">")):
                if (row.low if end < 0.0 else -row.high) < -reach:
                    ax.plot([end], [place], mark, color=colour, markersize=5)
        for label, colour in COLOURS.items():
            if any(row.verdict == label for row in rows):
                ax.plot([], [], "o-", color=colour, markersize=4, label=label)
        ax.set_yticks(range(len(rows)), [row.name for row in rows], fontsize=8)
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.set_xlim(-1.05 * reach, 1.05 * reach)
        ax.set_xlabel("difference, in usual sizes of the effect")
        ax.grid(visible=False, axis="y")
        figure.legend(loc="upper right", ncols=3, fontsize=8, borderaxespad=0.1)
        return svg_text(figure)


def _rows(one: Difference, verdict: str) -> list[PropertyRow]:
    rows = []
    for each in one.parameters:
        if each.name in one.estimates:
            found = one.estimates[each.name]
            # Of what acts in A relative to B, the other sign is that of B relative to A, to first order.
            sign = 1.0 if one.group == GROUPS[1] else -1.0
            value, low, high = (sign * (at - each.neutral) / each.size for at in (found.value, found.low, found.high))
            name = f"{one.title}: {parameter_word(each.name)}"
            rows.append(PropertyRow(name, value, min(low, high), max(low, high), verdict))
    return rows
