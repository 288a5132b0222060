"""What the interactive figures of a page draw: signals of a log over time, or values over something else, as data beside it.

The static figures draw from the same arrays. A column of a log is stored as 16-bit steps between its least and greatest value,
base64; the page loads an overview of it, the least and greatest value of every bin, and all rows once a reader zooms in. Other
figures have few rows, which are stored as they are.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.track import LeftOut
from ferryid.types import Floats

BINS = 1200
"""Bins of the overview, about one a pixel of a wide screen."""
MISSING = -32768
"""Step that stands for a missing value."""
STEPS = 65534
"""Steps between the least and the greatest value of a column."""
LARGEST = 1e150
"""What is beyond is drawn at it: the span of the values must be a number."""
BREAK = 2.5
"""A line breaks where two rows are this many times the usual step apart."""
PALETTE = 6
"""Colours ``c0`` to ``c5`` of the pages."""


@dataclass(frozen=True)
class Axis:
    """What is along the horizontal axis.

    Attributes
    ----------
    label
        Name, with the unit where there is one.
    kind
        ``time`` [s] of a log, whole ``number``, ``date`` [s since 1970, UTC], or ``name``: rows from 1 on, by their names.
    names
        Of the rows, which the cursor tells, shape (n,); empty where the values say all.
    links
        Where a click on a row's point leads, shape (n,); empty where to nothing.
    """

    label: str
    kind: Literal["time", "number", "date", "name"]
    names: tuple[str, ...] = ()
    links: tuple[str, ...] = ()


TIME = Axis("time [s]", "time")


@dataclass(frozen=True)
class Trace:
    """One line along the horizontal axis, or points.

    Attributes
    ----------
    label
        Name; traces of one name are switched on and off together.
    values
        Shape (n,), NaN where there is none.
    colour
        Role in the pages' colours, such as ``measured``, ``base``, ``new`` or ``c3``: they differ between light and dark.
    shown, framing
        False for one that is off at first, and for one that the frame does not follow.
    dash
        Lengths of dashes and gaps [pixels]; a full line where empty.
    style
        A ``line``, a ``marked`` one with a mark at every row, or marks alone: ``points`` or ``hollow`` ones.
    low, high
        Ends of the intervals, shape (n,), NaN where there is none: a band along a line, bars of marks. None without.
    """

    label: str
    values: Floats
    colour: str
    shown: bool = True
    framing: bool = True
    dash: tuple[float, ...] = ()
    style: Literal["line", "marked", "points", "hollow"] = "line"
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True)
class Strip:
    """One pair of axes.

    Attributes
    ----------
    label, traces
        Of its vertical axis, and what is drawn in it.
    scale
        Vertical axis: ``free``, from ``zero`` up, or ``log``, whose values must be positive.
    frame
        Least and greatest value that it shows, however far the values reach; None without a bound.
    """

    label: str
    traces: tuple[Trace, ...]
    scale: Literal["free", "zero", "log"] = "free"
    frame: tuple[float, float] | None = None


@dataclass(frozen=True)
class Span:
    """A stretch of the horizontal axis that is shaded; `kind` is a role of the pages' colours, such as ``validation``."""

    first: float
    last: float
    kind: str
    label: str


@dataclass(frozen=True)
class Mark:
    """A finding, to whose time a reader can jump; `spans` are pairs of first and last [s], empty of the whole log."""

    title: str
    spans: tuple[tuple[float, float], ...] = ()
    trace: str = ""


@dataclass(frozen=True)
class Arrows:
    """Vectors along the track, north and east, shape (n,) each, or one for the whole log, shape (1,)."""

    label: str
    unit: str
    colour: str
    north: Floats
    east: Floats
    shown: bool = True


@dataclass(frozen=True)
class Timeline:
    """What is drawn of one log, or along another axis than time.

    Attributes
    ----------
    title
        Name of the log, or of the figure.
    t
        Time [s], or what else `axis` is of, ascending, shape (n,).
    strips
        Axes below one another, with one horizontal axis.
    spans, marks
        What is shaded, and what can be jumped to.
    place
        North, east [m] and heading [rad], shape (n, 3), or None.
    arrows
        Along the track.
    axis
        The horizontal one.
    """

    title: str
    t: Floats
    strips: tuple[Strip, ...]
    spans: tuple[Span, ...] = ()
    marks: tuple[Mark, ...] = ()
    place: Floats | None = None
    arrows: tuple[Arrows, ...] = ()
    axis: Axis = TIME


def left_out_spans(left_out: Sequence[LeftOut]) -> tuple[Span, ...]:
    """Return the stretches that are not used as spans."""
    return tuple(Span(one.start_s, one.end_s, "left-out", "left out") for every in left_out for one in every.intervals)


def flagged(t: Floats, flags: NDArray[np.bool_], kind: str, label: str) -> tuple[Span, ...]:
    """Return the stretches of marked rows as spans."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return tuple(Span(float(t[a]), float(t[b - 1]), kind, label) for a, b in zip(edges[::2], edges[1::2], strict=True))


def scripts(timelines: Sequence[Timeline]) -> dict[str, str]:
    """Return the files beside a page that hold its timelines, by name: overviews first, one more a long log with all rows."""
    if not timelines:
        return {}
    files, overviews = {}, []
    for number, one in enumerate(timelines, 1):
        plain = _plain(one)
        if one.axis.kind != "time":
            overviews.append({**plain, "data": _listed(one.t, _columns(one))})
            continue
        drawn = sum(len(strip.traces) for strip in one.strips)
        t, columns = _broken(one.t, _columns(one))
        if len(t) > 2 * BINS:
            fine = f"timeline-{number}.js"
            files[fine] = f"ferryid.rows({number - 1}, {_dumped(_encoded(t, columns))});\n"
            plain["fine"] = fine
            t, columns = overview(t, columns, drawn)
        overviews.append({**plain, "data": _encoded(t, columns)})
    return {"timeline.js": f"ferryid.show({_dumped(overviews)});\n", **files}


def overview(t: Floats, columns: Sequence[Floats], drawn: int) -> tuple[Floats, list[Floats]]:
    """Thin columns to the least and greatest value of each of `BINS` bins, in the order in which they come.

    Parameters
    ----------
    t, columns
        Times [s] and values, shape (n,) each.
    drawn
        How many of the columns are lines over time; the others are taken at the times of the overview.

    Returns
    -------
    t
        First and middle time of every bin [s], shape (2 b,).
    columns
        Shape (2 b,) each; NaN where a bin has no value.
    """
    width = -(-len(t) // BINS)
    bins = -(-len(t) // width)
    padded = bins * width - len(t)
    starts = np.arange(bins) * width
    middles = np.minimum(starts + max(width // 2, 1), len(t) - 1)
    thinned = []
    for values in columns[:drawn]:
        whole = np.concatenate([values, np.full(padded, np.nan)]).reshape(bins, width)
        good = np.isfinite(whole)
        low, high = np.where(good, whole, np.inf), np.where(good, whole, -np.inf)
        first, last = low.min(axis=1), high.max(axis=1)
        rises = low.argmin(axis=1) <= high.argmax(axis=1)
        pair = np.where(rises[:, None], np.column_stack([first, last]), np.column_stack([last, first])).ravel()
        thinned.append(np.where(np.isfinite(pair), pair, np.nan))
    taken = np.column_stack([starts, middles]).ravel()
    return t[taken], [*thinned, *(values[taken] for values in columns[drawn:])]


def _columns(one: Timeline) -> list[Floats]:
    columns = [np.asarray(trace.values, dtype=np.float64) for strip in one.strips for trace in strip.traces]
    if one.place is not None:
        columns += [one.place[:, 0], one.place[:, 1], np.degrees(np.mod(one.place[:, 2], 2.0 * np.pi))]
    columns += [side for arrows in one.arrows if len(arrows.north) > 1 for side in (arrows.north, arrows.east)]
    ends = [(trace.low, trace.high) for strip in one.strips for trace in strip.traces]
    return columns + [end for low, high in ends if low is not None and high is not None for end in (low, high)]


def _broken(t: Floats, columns: Sequence[Floats]) -> tuple[Floats, list[Floats]]:
    """Put a row without values where rows are missing, so that lines break there."""
    if len(t) < 3:
        return t, list(columns)
    steps = np.diff(t)
    usual = float(np.median(steps))
    after = np.flatnonzero(steps > BREAK * usual) + 1
    if not len(after):
        return t, list(columns)
    return np.insert(t, after, t[after - 1] + usual), [np.insert(one, after, np.nan) for one in columns]


def _plain(one: Timeline) -> dict[str, Any]:
    return {
        "title": one.title,
        "axis": {**vars(one.axis)},
        "strips": [
            {
                "label": strip.label,
                "scale": strip.scale,
                "frame": strip.frame,
                "traces": [
                    {
                        "label": trace.label,
                        "colour": trace.colour,
                        "shown": trace.shown,
                        "framing": trace.framing,
                        "dash": list(trace.dash),
                        "style": trace.style,
                        "ends": trace.low is not None and trace.high is not None,
                    }
                    for trace in strip.traces
                ],
            }
            for strip in one.strips
        ],
        "spans": [{**vars(span)} for span in one.spans],
        "marks": [{"title": mark.title, "spans": list(mark.spans), "trace": mark.trace} for mark in one.marks],
        "place": one.place is not None,
        "arrows": [
            {
                "label": arrows.label,
                "unit": arrows.unit,
                "colour": arrows.colour,
                "shown": arrows.shown,
                "steady": [float(arrows.north[0]), float(arrows.east[0])] if len(arrows.north) == 1 else None,
            }
            for arrows in one.arrows
        ],
    }


def _encoded(t: Floats, columns: Iterable[Floats]) -> dict[str, Any]:
    return {"t": _steps(t, np.dtype("<u4")), "columns": [_steps(one, np.dtype("<i2")) for one in columns]}


def _listed(t: Floats, columns: Iterable[Floats]) -> dict[str, Any]:
    return {
        "t": t.tolist(),
        "columns": [[float(f"{v:.6g}") if np.isfinite(v) else None for v in one] for one in columns],
    }


def _steps(values: Floats, kind: np.dtype[Any]) -> list[Any]:
    """Return offset, size of a step, and the steps as base64."""
    good = np.isfinite(values)
    values = np.clip(values, -LARGEST, LARGEST)
    low, high = (float(values[good].min()), float(values[good].max())) if good.any() else (0.0, 0.0)
    middle = low if kind.kind == "u" else 0.5 * (low + high)
    count = float(np.iinfo(kind).max) if kind.kind == "u" else float(STEPS)
    step = (high - low) / count if high > low else 1.0
    scaled = np.rint((np.where(good, values, middle) - middle) / step)
    whole = np.where(good, scaled, MISSING).astype(kind) if kind.kind == "i" else scaled.astype(kind)
    return [middle, step, base64.b64encode(whole.tobytes()).decode("ascii")]


def _dumped(plain: Any) -> str:
    return json.dumps(plain, separators=(",", ":"), allow_nan=False, ensure_ascii=True)
