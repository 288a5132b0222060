"""Figures of a validation run, as SVG text."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, log10

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from ferryid.report.figures import STYLE

WIDTH = 9.0
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#7f7f7f"
LONG = 2.0
"""Decades from which on an axis has labels at the powers of ten alone."""
ACROSS = 4
"""Detection curves beside each other."""


@dataclass(frozen=True)
class Answers:
    """Whether one named an effect in logs in which it has sizes, shape (n,), and its fitted curve, shape (m,)."""

    sizes: NDArray[np.float64]
    named: NDArray[np.bool_]
    x: NDArray[np.float64]
    share: NDArray[np.float64]


@dataclass(frozen=True)
class Detected:
    """Detection of one effect: by the diagnosis, and by the oracle or None; `limits` are the ends of its sizes."""

    title: str
    unit: str
    limits: tuple[float, float]
    blind: Answers
    oracle: Answers | None


def confusion_matrix(rows: Sequence[str], columns: Sequence[str], counts: Sequence[Sequence[int]]) -> str:
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


def detection_curves(found: Sequence[Detected]) -> str:
    """Return one panel an effect: named or not over the size, and the fitted share of logs in which it is named."""
    rows = max(1, ceil(len(found) / ACROSS))
    with mpl.rc_context({**STYLE, "font.size": 8}):
        figure = Figure(figsize=(WIDTH, 0.5 + 1.55 * rows), layout="constrained")
        every = figure.subplots(rows, ACROSS, squeeze=False, sharey=True)
        for axes, one in zip(every.flat, found, strict=False):
            # Those of the oracle a little apart, so that neither hides the other.
            for seen, colour, apart, mark in ((one.blind, BLUE, 0.0, "o"), (one.oracle, ORANGE, 0.06, "x")):
                if seen is None:
                    continue
                height = np.where(seen.named, 1.0 - apart, 0.0 + apart)
                axes.plot(seen.sizes, height, mark, color=colour, markersize=4, alpha=0.7)
                axes.plot(seen.x, seen.share, color=colour, linewidth=1.2)
            axes.axhline(0.95, color=GREY, linewidth=0.6)
            axes.set_xscale("log")
            axes.set_xlim(*one.limits)
            # A panel is too small for more than the powers of ten, of which a short axis may hold none.
            decades = log10(one.limits[1] / one.limits[0])
            steps = (1.0,) if decades > LONG else (1.0, 2.0, 5.0)
            axes.xaxis.set_major_locator(LogLocator(subs=steps, numticks=12))
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.set_ylim(-0.08, 1.08)
            axes.set_title(one.title, fontsize=8)
            axes.set_xlabel(one.unit, fontsize=7)
        for axes in every.flat[len(found) :]:
            axes.set_visible(False)
        for row in every:
            row[0].set_ylabel("named")
        return _svg(figure)


def parameter_errors(by_effect: Mapping[str, Sequence[float]], small: float) -> str:
    """Return the relative errors of parameters, one row of points an effect, their median marked, and what counts as small."""
    with mpl.rc_context({**STYLE, "font.size": 8}):
        figure = Figure(figsize=(WIDTH, 1.0 + 0.24 * len(by_effect)), layout="constrained")
        axes = figure.add_subplot()
        for row, values in enumerate(by_effect.values()):
            if values:
                shown = np.clip(values, 1e-3, 10.0)
                axes.plot(shown, np.full(len(shown), row), ".", color=BLUE, alpha=0.5, markersize=5)
                axes.plot(np.median(shown), row, "|", color=ORANGE, markersize=12, markeredgewidth=2)
        axes.axvline(small, color="#222222", linewidth=0.8)
        axes.set_xscale("log")
        axes.set_yticks(range(len(by_effect)), list(by_effect))
        axes.invert_yaxis()
        axes.set_xlabel(f"relative error of parameters (bar: median; line: {100.0 * small:.0f} %)")
        return _svg(figure)


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"
