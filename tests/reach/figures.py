"""Figures of the study, as SVG text."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from ferryid.report.figures import STYLE
from tests.reach.scores import WITHIN

WIDTH = 9.0
BLUE, ORANGE = "#0072b2", "#d55e00"


def matrix(rows: Sequence[str], columns: Sequence[str], counts: Sequence[Sequence[int]]) -> str:
    """Return the confusion matrix: what is in the log downwards, the first name across, shares of each row in shades."""
    table = np.asarray(counts, dtype=np.float64)
    shares = table / np.maximum(table.sum(axis=1, keepdims=True), 1.0)
    with mpl.rc_context({**STYLE, "axes.grid": False, "font.size": 8}):
        figure = Figure(figsize=(WIDTH, 1.9 + 0.22 * len(rows)), layout="constrained")
        axes = figure.add_subplot()
        axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        axes.xaxis.tick_top()
        axes.set_xticks(range(len(columns)), columns, rotation=60, ha="left")
        axes.set_yticks(range(len(rows)), [f"{row} ({int(n)})" for row, n in zip(rows, table.sum(axis=1), strict=True)])
        for i, j in zip(*np.nonzero(table), strict=True):
            colour = "white" if shares[i, j] > 0.6 else "black"
            axes.text(j, i, f"{int(table[i, j])}", ha="center", va="center", color=colour)
        return _svg(figure)


def errors(by_cell: Mapping[str, Sequence[float]]) -> str:
    """Return the relative errors of parameters, one row of points a cell, their median marked."""
    with mpl.rc_context({**STYLE, "font.size": 8}):
        figure = Figure(figsize=(WIDTH, 1.0 + 0.24 * len(by_cell)), layout="constrained")
        axes = figure.add_subplot()
        for row, values in enumerate(by_cell.values()):
            if values:
                shown = np.clip(values, 1e-3, 10.0)
                axes.plot(shown, np.full(len(shown), row), ".", color=BLUE, alpha=0.5, markersize=5)
                axes.plot(np.median(shown), row, "|", color=ORANGE, markersize=12, markeredgewidth=2)
        axes.axvline(WITHIN, color="#222222", linewidth=0.8)
        axes.set_xscale("log")
        axes.set_yticks(range(len(by_cell)), list(by_cell))
        axes.invert_yaxis()
        axes.set_xlabel("relative error of parameters (bar: median; line: target)")
        return _svg(figure)


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"
