"""Interactive figures of a batch: findings and model errors over the dates of the logs; a point leads to the row of its log."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime

import numpy as np

from ferryid.diagnose import JUDGING
from ferryid.report.batch_figures import ERRORS, parameter_label
from ferryid.report.batch_rows import SummaryRow, Trend, TrendPoint, date_text
from ferryid.report.figures import ROLES, UNITS
from ferryid.report.timeline import Axis, Strip, Timeline, Trace
from ferryid.types import AXES, Floats

APART_S = 60.0
"""How far apart logs of one date are drawn at least, so that each can be pointed at [s]."""


def row_id(place: int) -> str:
    """Return the name of a log's row on the page, by its place in the batch from 0."""
    return f"log-{place + 1}"


def findings_timeline(
    title: str, trends: Sequence[Trend], rows: Sequence[SummaryRow], places: Mapping[int, int]
) -> Timeline:
    """Return the parameters of one effect, a strip each: values with 95 % intervals over the dates of their logs.

    Parameters
    ----------
    title
        Of the figure.
    trends
        Of one vessel and effect.
    rows
        Diagnosed logs of the vessel, in the order of the trends.
    places
        Places of logs in the batch by the ``id`` of their rows.
    """

    def strip(one: Trend) -> Strip:
        sure = [point for point in one.points if point.probability > JUDGING.hint_probability]
        hints = [point for point in one.points if point.probability <= JUDGING.hint_probability]
        traces = [
            _points(label, points, len(rows), hollow=points is hints)
            for label, points in (("found", sure), ("a hint", hints))
            if points
        ]
        if one.neutral is not None and one.absent:
            absent = _filled(len(rows), {where.place: one.neutral for where in one.absent})
            traces.append(Trace("not found", absent, "grey", style="points"))
        return Strip(parameter_label(one), tuple(traces))

    t, axis = _along(rows, trends[0].dated, places)
    return Timeline(title, t, tuple(map(strip, trends)), axis=axis)


def errors_timeline(title: str, rows: Sequence[SummaryRow], dated: bool, places: Mapping[int, int]) -> Timeline:
    """Return the root-mean-square force errors on each axis over the dates of their logs; see `findings_timeline`."""

    def strip(axis: str, unit: str) -> Strip:
        traces = []
        for label, _, colour, mse in ERRORS:
            found = {place: mse(row).get(axis) for place, row in enumerate(rows)}
            known = {place: value**0.5 for place, value in found.items() if value is not None}
            if known:
                hollow = label == "base model"
                values = _filled(len(rows), known)
                traces.append(Trace(label, values, ROLES[colour], style="hollow" if hollow else "points"))
        return Strip(f"{axis} [{unit}]", tuple(traces), "zero")

    t, along = _along(rows, dated, places)
    return Timeline(title, t, tuple(map(strip, AXES, UNITS)), axis=along)


def _along(rows: Sequence[SummaryRow], dated: bool, places: Mapping[int, int]) -> tuple[Floats, Axis]:
    """Return where logs are along the axis, shape (n,), and the axis."""
    names = tuple(row.name for row in rows)
    links = tuple(f"#{row_id(places[id(row)])}" for row in rows)
    if not dated:
        return np.arange(1.0, len(rows) + 1.0), Axis("log, in the order of the batch", "number", names, links)
    t: list[float] = []
    for row in rows:
        date = datetime.fromisoformat(row.date or "")
        second = (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
        t.append(max(second, t[-1] + APART_S) if t else second)
    # Logs of one date are drawn apart, and the cursor tells that date.
    return np.array(t), Axis("date", "date", tuple(f"{date_text(row)} {row.name}" for row in rows), links)


def _points(label: str, points: Sequence[TrendPoint], count: int, *, hollow: bool) -> Trace:
    def values(get: Callable[[TrendPoint], float | None]) -> Floats:
        return _filled(count, {point.place: get(point) for point in points})

    return Trace(
        label,
        values(lambda point: point.value),
        "new",
        style="hollow" if hollow else "points",
        low=values(lambda point: point.low),
        high=values(lambda point: point.high),
    )


def _filled(count: int, known: Mapping[int, float | None]) -> Floats:
    """Return values by their places, NaN elsewhere, shape (n,)."""
    values = np.full(count, np.nan)
    for place, value in known.items():
        values[place] = np.nan if value is None else value
    return values
