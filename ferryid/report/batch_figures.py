"""Figures of a batch: findings and model errors over the dates of the logs, as SVG text."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.ticker import MaxNLocator

from ferryid.diagnose import JUDGING
from ferryid.report.batch_rows import ByAxis, SummaryRow, Trend, TrendPoint
from ferryid.report.diagnosis_words import word
from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, UNITS, canvas, svg_text
from ferryid.types import AXES

PANEL = 1.35
"""Height of a panel [inches]."""
ABSENT = "#9a9a9a"
ERRORS: tuple[tuple[str, str, str, Callable[[SummaryRow], ByAxis]], ...] = (
    ("base model", "o", BASE, lambda row: row.fit.mse.base if row.fit else {}),
    ("fit to the log", "o", NEW, lambda row: row.fit.mse.model if row.fit else {}),
    ("evaluated, whole log", "x", MEASURED, lambda row: row.evaluate.mse if row.evaluate else {}),
)
"""Label, marker and colour of what is drawn of a row, and its mean square errors."""


def findings(trends: Sequence[Trend]) -> str:
    """Return the parameters of one effect, a panel each: values with 95 % intervals over the dates of their logs.

    Parameters
    ----------
    trends
        Of one vessel and effect.
    """
    with mpl.rc_context(STYLE):
        figure, every = canvas(len(trends), 1.0 + PANEL * len(trends))
        dated = trends[0].dated
        for ax, one in zip(every, trends, strict=True):
            sure = [point for point in one.points if point.probability > JUDGING.hint_probability]
            hints = [point for point in one.points if point.probability <= JUDGING.hint_probability]
            _points(ax, sure, dated, "found", NEW)
            _points(ax, hints, dated, "a hint", "white")
            if one.neutral is not None:
                x = [_x(where.date, where.place, dated) for where in one.absent]
                ax.plot(x, [one.neutral] * len(x), "|", color=ABSENT, markersize=7, label="not found")
            ax.set_ylabel(parameter_label(one))
        _horizontal(every, dated)
        _legend(figure, every)
        return svg_text(figure)


def parameter_label(one: Trend) -> str:
    """Return the name of a parameter, with its unit where it has one."""
    unit = "" if one.unit == "-" else f" [{one.unit}]"
    return f"{word(one.parameter)}{unit}"


def errors(rows: Sequence[SummaryRow], dated: bool) -> str:
    """Return the root-mean-square force errors on each axis over the dates of their logs.

    Parameters
    ----------
    rows
        Rows of a batch, of one vessel.
    dated
        True where all have a date; else they stand in their order.
    """
    with mpl.rc_context(STYLE):
        figure, every = canvas(len(AXES), 1.0 + PANEL * len(AXES))
        for ax, axis, unit in zip(every, AXES, UNITS, strict=True):
            for label, mark, colour, mse in ERRORS:
                found = [(_x(row.date, place, dated), mse(row).get(axis)) for place, row in enumerate(rows)]
                known = [(x, y**0.5) for x, y in found if y is not None]
                if known:
                    ax.plot(
                        [x for x, _ in known],
                        [y for _, y in known],
                        mark,
                        color=colour,
                        markersize=4.5,
                        label=label,
                        markerfacecolor="none" if label == "base model" else colour,
                    )
            ax.margins(y=0.15)
            ax.autoscale_view()
            ax.set_ylim(bottom=0.0)
            ax.set_ylabel(f"{axis} [{unit}]")
        _horizontal(every, dated)
        _legend(figure, every)
        return svg_text(figure)


def _points(ax: Axes, points: Sequence[TrendPoint], dated: bool, label: str, face: str) -> None:
    if not points:
        return
    value, low, high = (
        np.array([np.nan if one is None else one for one in each], dtype=np.float64)
        for each in zip(*((point.value, point.low, point.high) for point in points), strict=True)
    )
    ax.errorbar(
        [_x(point.date, point.place, dated) for point in points],
        value,
        yerr=np.maximum(np.vstack([value - low, high - value]), 0.0),
        fmt="o",
        color=NEW,
        markerfacecolor=face,
        markersize=4.5,
        linewidth=0.9,
        label=label,
    )


def _x(date: str | None, place: int, dated: bool) -> Any:
    return datetime.fromisoformat(date) if dated and date else place + 1


def _horizontal(every: Sequence[Axes], dated: bool) -> None:
    ax = every[-1]
    ax.margins(x=0.04)
    if dated:
        locator: Any = AutoDateLocator(minticks=3, maxticks=7)  # type: ignore[no-untyped-call]
        ax.xaxis.set_major_locator(locator)
        ax.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    else:
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set_xlabel("log, in the order of the batch")


def _legend(figure: Any, every: Sequence[Axes]) -> None:
    """Put one legend over all panels, with what any of them shows."""
    shown = {label: handle for ax in every for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    if shown:
        figure.legend(shown.values(), shown.keys(), loc="upper center", ncols=len(shown), borderaxespad=0.1)
