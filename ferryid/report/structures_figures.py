"""Figure of compared structures: a forest plot, error over the best one's with its interval."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ferryid.identify.sweeps import StructureComparison
from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, WIDTH, svg_text
from ferryid.types import AXES, Floats

_LEFT, _RIGHT, _TOP, _BOTTOM = 1.85, 0.15, 0.35, 0.55
"""Margins in inches."""
_BETWEEN = (
    (1.4, (0.8, 0.9, 1.0, 1.1, 1.2)),
    (2.0, (0.6, 0.8, 1.0, 1.2, 1.4, 1.7)),
    (4.0, (0.4, 0.6, 1.0, 1.5, 2.0, 3.0)),
    (12.0, (1.0, 2.0, 5.0)),
    (np.inf, (1.0,)),
)
"""Ticks of a decade, by the ratio of largest to least."""


def forest(one: StructureComparison) -> str:
    """Return MSE over that of the best structure per axis, with its interval, a line for each structure."""
    with mpl.rc_context(STYLE):
        count = len(one.structures)
        height = _TOP + _BOTTOM + 0.27 * count
        figure = Figure(figsize=(WIDTH, height))
        panels = figure.subplots(1, 3, sharex=True, sharey=True)
        figure.subplots_adjust(_LEFT / WIDTH, _BOTTOM / height, 1.0 - _RIGHT / WIDTH, 1.0 - _TOP / height, wspace=0.1)
        place = np.arange(count)
        value, low, high = (
            np.array([getattr(structure.against_best, part) for structure in one.structures])
            for part in ("value", "low", "high")
        )
        for j, (ax, axis) in enumerate(zip(panels, AXES, strict=True)):
            ax.axvline(1.0, color=MEASURED, linewidth=0.8)
            for i, structure in enumerate(one.structures):
                colour = BASE if structure is one.supported else NEW if structure.kept else "#8a8a8a"
                mark, size = ("*", 10) if structure is one.supported else ("o", 5)
                ax.plot([low[i, j], high[i, j]], [i, i], color=colour, linewidth=1.4)
                inside = colour if structure.kept else "white"
                ax.plot(value[i, j], i, mark, color=colour, markersize=size, markerfacecolor=inside)
            ax.set_xscale("log")
            ax.set_title(axis, fontsize=10)
            ax.grid(visible=False, axis="y")
        _ticks(panels[0], low, high)
        panels[0].set_yticks(place, [structure.title for structure in one.structures])
        panels[0].set_ylim(count - 0.4, -0.6)
        panels[1].set_xlabel("MSE over the best structure's")
        return svg_text(figure)


def _ticks(ax: Axes, low: Floats, high: Floats) -> None:
    """Mark powers of ten where the ratios span several, and else what lies between."""
    known = np.concatenate([low, high])
    known = known[np.isfinite(known) & (known > 0.0)]
    least, most = known.min(initial=1.0) / 1.05, known.max(initial=1.0) * 1.05
    ax.set_xlim(least, most)
    between = next(ticks for span, ticks in _BETWEEN if most / least < span)
    ax.xaxis.set_major_locator(LogLocator(subs=between))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda tick, _: f"{tick:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
