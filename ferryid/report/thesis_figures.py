"""Drawings as SVG, in the style of the fit report."""

from __future__ import annotations

import io
from math import ceil

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ferryid.report.drawing import Drawing, Panel
from ferryid.report.figures import STYLE, WIDTH
from ferryid.report.structure import envelope
from ferryid.types import Floats

COLOURS = ("#222222", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7f7f7f")
LONGEST = 1500
"""A line of more points is drawn as its envelope: a page cannot show more, and files stay small."""

NARROW = 5.0
"""Ratio of a logarithmic axis's ends below which its ticks are evenly spaced numbers."""


def draw(drawing: Drawing) -> str:
    """Return a drawing as SVG text."""
    labels = list(dict.fromkeys(line.label for panel in drawing.panels for line in panel.lines))
    colours = {label: COLOURS[i % len(COLOURS)] for i, label in enumerate(labels)}
    with mpl.rc_context(STYLE):
        rows = ceil(len(drawing.panels) / drawing.columns)
        beside = _columns(labels)
        legend_rows = ceil(len(labels) / beside)
        top = 0.15 + 0.22 * legend_rows + (0.2 if any(panel.title for panel in drawing.panels) else 0.0)
        height = (4.2 if drawing.equal else (1.55 if rows > 1 else 2.6) * rows) + top + 0.5
        figure = Figure(figsize=(WIDTH, height))
        figure.subplots_adjust(
            left=0.85 / WIDTH,
            right=1.0 - 0.12 / WIDTH,
            bottom=0.5 / height,
            top=1.0 - top / height,
            wspace=0.38,
            hspace=0.2 if rows == 1 or not any(panel.title for panel in drawing.panels) else 0.4,
        )
        axes = figure.subplots(rows, drawing.columns, sharex=True, squeeze=False)
        for ax, panel in zip(axes.flat, drawing.panels, strict=False):
            _panel(ax, panel, colours)
            if drawing.equal:
                ax.set_aspect("equal", adjustable="datalim")
        for ax in axes.flat[len(drawing.panels) :]:
            ax.set_visible(False)
        for ax in axes[-1]:
            ax.set_xlabel(drawing.x_label)
        if len(labels) > 1:
            handles = [Line2D([], [], color=colours[label], label=label) for label in labels]
            figure.legend(handles=handles, loc="upper center", ncols=beside, borderaxespad=0.1)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
        return text.getvalue()


def _panel(ax: Axes, panel: Panel, colours: dict[str, str]) -> None:
    for line in panel.lines:
        colour = colours[line.label]
        if line.low is not None and line.high is not None:
            ax.fill_between(line.x, line.low, line.high, color=colour, alpha=0.15, linewidth=0)
        x, y = _thinned(line.x, line.y)
        ax.plot(x, y, color=colour, alpha=0.9, marker="o" if line.marked else "", markersize=3.5)
    if all(line.marked and np.array_equal(line.x, np.round(line.x)) for line in panel.lines):
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_ylabel(panel.y_label)
    if panel.title:
        ax.set_title(panel.title, fontsize=10)
    if panel.logarithmic:
        ax.set_yscale("log")
        low, high = ax.get_ylim()
        # 1, 2, 5 would leave one tick or none of a narrow range.
        ax.yaxis.set_major_locator(MaxNLocator(5) if high < NARROW * low else LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())


def _columns(labels: list[str]) -> int:
    """Return how many labels of a legend fit beside one another."""
    longest = max(len(label) for label in labels)
    return min(len(labels), 3 if longest <= 20 else 2 if longest <= 36 else 1)


def _thinned(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    if len(x) <= LONGEST or np.any(np.diff(x) < 0):
        return x, y
    return envelope(x, y)
