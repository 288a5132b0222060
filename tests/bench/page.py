"""What a benchmark gives back, and the Markdown page made of it."""

from __future__ import annotations

import gc
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import log10
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, svg_text
from tests.bench import yardstick

PAGE_GOAL_S = 900.0
"""Time within which the page is to be made [s]."""


@dataclass(frozen=True)
class Row:
    """One comparison; `goal` is what the ratio must reach (``"≥ 35"``), empty where none is set.

    `limit` says what was measured of the least that it can take, and of what takes the rest, in sentences.
    """

    what: str
    ours: str
    rival: str
    rival_value: str
    ratio: float
    goal: str = ""
    reached: bool | None = None
    limit: str = ""

    @property
    def over_goal(self) -> float | None:
        """How many times as good as the goal asks for; None where a ratio has no goal of its own."""
        if not self.goal:
            return None
        sign, number, *_ = self.goal.split()
        return self.ratio / float(number) if sign == "≥" else float(number) / self.ratio


@dataclass(frozen=True)
class Timed:
    """What has a goal in seconds: time and goal become multiples of the yardstick (`tests.bench.yardstick`).

    `more` stands behind the time; `otherwise` tells whether what else is asked of it, such as memory, is kept; `limit` is as of
    `Row`.
    """

    what: str
    took_s: float
    goal_s: float
    more: str = ""
    otherwise: bool = True
    limit: str = ""

    def row(self, yardstick_s: float) -> Row:
        """Return the row of the page, by what the yardstick took in this run [s]."""
        ratio, goal = self.took_s / yardstick_s, self.goal_s / yardstick.GOALS_S
        return Row(
            self.what,
            duration(self.took_s) + self.more,
            "the yardstick",
            duration(yardstick_s),
            ratio,
            f"≤ {goal:.3g} ({self.goal_s:g} s)",
            ratio <= goal and self.otherwise,
            self.limit,
        )


@dataclass(frozen=True)
class Curve:
    """How a time grows: (size, time [s]), and what the size is; curves against the same are drawn together.

    Where `shared`, the size is that of what does the work, and the time in proportion falls.
    """

    what: str
    against: str
    points: Sequence[tuple[float, float]]
    shared: bool = False


@dataclass(frozen=True)
class Section:
    """One table of the page.

    Attributes
    ----------
    packages
        Those whose versions matter to it.
    curves
        What is drawn of growth.
    same
        Times of work that was measured on the machine of the goals as well [s], by its name in `yardstick.THERE`.
    yardstick_s
        The yardstick, measured beside this part [s].
    took_s, made_s
        How long this part took, and what of that went into making logs and archives [s].
    """

    title: str
    rows: Sequence[Row | Timed]
    notes: Sequence[str] = ()
    packages: Sequence[str] = ()
    curves: Sequence[Curve] = ()
    same: Mapping[str, float] = field(default_factory=dict)
    yardstick_s: Sequence[float] = ()
    took_s: float = 0.0
    made_s: float = 0.0


def packed(section: Section) -> dict[str, Any]:
    """Return a section as plain values."""
    return asdict(section)


def unpacked(plain: dict[str, Any]) -> Section:
    """Return the section of `packed`."""
    rows = [(Timed if "goal_s" in row else Row)(**row) for row in plain["rows"]]
    return Section(**{**plain, "rows": rows, "curves": [Curve(**curve) for curve in plain["curves"]]})


def judged(section: Section, yardstick_s: float) -> list[Row]:
    """Return the rows of a section with goals in seconds turned into multiples of the yardstick."""
    return [row.row(yardstick_s) if isinstance(row, Timed) else row for row in section.rows]


def in_turn(works: Sequence[Callable[[], object]], repeats: int) -> list[list[float]]:
    """Time several things in turn: for each of them one time [s] per round."""
    rounds = [[seconds(work) for work in works] for _ in range(repeats)]
    return [list(times) for times in zip(*rounds, strict=True)]


def seconds(work: Callable[[], object]) -> float:
    """Time one call [s]; what earlier calls left behind is collected before."""
    gc.collect()
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def faster_row(what: str, ours: Sequence[float], name: str, rival: Sequence[float], goal: float | None) -> Row:
    """Row of how many times faster ours is, of times of the same rounds [s]: the median of their ratios."""
    ratio = statistics.median(theirs / mine for mine, theirs in zip(ours, rival, strict=True))
    values = duration(statistics.median(ours)), name, duration(statistics.median(rival)), ratio
    return Row(what, *values) if goal is None else Row(what, *values, f"≥ {goal:g}", ratio >= goal)


def faster(
    what: str,
    ours: Callable[[], object],
    name: str,
    rival: Callable[[], object],
    goal: float | None,
    repeats: int,
) -> Row:
    """Measure how many times faster ours is."""
    mine, theirs = in_turn((ours, rival), repeats)
    return faster_row(what, mine, name, theirs, goal)


def within_row(what: str, ours: Sequence[float], name: str, limit: Sequence[float], goal: float | None) -> Row:
    """Row of how many times as long ours takes as the least work conceivable, of times of the same rounds [s]."""
    ratio = statistics.median(a / b for a, b in zip(ours, limit, strict=True))
    values = duration(statistics.median(ours)), name, duration(statistics.median(limit)), ratio
    return Row(what, *values) if goal is None else Row(what, *values, f"≤ {goal:g}", ratio <= goal)


def duration(value_s: float) -> str:
    """Return a time with three digits."""
    return f"{value_s:.3g} s" if value_s >= 1 else f"{value_s * 1e3:.3g} ms"


def drawing(rows: Sequence[Row]) -> str:
    """Return a figure (SVG) of every ratio over its goal: what ends to the right of the line is reached."""
    rows = [(row, value) for row in rows if (value := row.over_goal) is not None]
    with mpl.rc_context(STYLE | {"font.size": 7}):
        figure = Figure(figsize=(9.0, 0.6 + 0.17 * len(rows)), layout="tight")
        ax = figure.subplots()
        place = np.arange(len(rows))[::-1]
        colours = [NEW if value >= 1.0 else BASE for _, value in rows]
        ax.barh(place, [log10(value) for _, value in rows], color=colours, height=0.6)
        ax.axvline(0.0, color=MEASURED, linewidth=0.8)
        ax.set_yticks(place, [f"{row.what}; {row.rival}" for row, _ in rows])
        ax.set_ylim(-0.7, len(rows) - 0.3)
        shown = [-1.0, -log10(2.0), 0.0, log10(2.0), 1.0]
        ax.set_xticks(shown, ["1/10", "1/2", "goal", "2", "10"])
        ax.set_xlabel("ratio over its goal, or goal over the ratio where less is better")
        return svg_text(figure)


def growth(curves: Sequence[Curve]) -> str:
    """Return a figure (SVG) of times over sizes, a panel for each kind of size, with the line of linear growth."""
    panels = {curve.against: [one for one in curves if one.against == curve.against] for curve in curves}
    with mpl.rc_context(STYLE | {"font.size": 7}):
        figure = Figure(figsize=(9.0, 3.2 * -(-len(panels) // 2)), layout="tight")
        axes = figure.subplots(-(-len(panels) // 2), 2, squeeze=False).ravel()
        for ax in axes[len(panels) :]:
            ax.set_axis_off()
        for ax, (against, shown) in zip(axes, panels.items(), strict=False):
            for curve, colour in zip(shown, mpl.color_sequences["tab10"], strict=False):
                sizes, times = zip(*curve.points, strict=True)
                ax.loglog(sizes, times, marker="o", markersize=3, linewidth=1.0, color=colour, label=curve.what)
            ends = [
                min(size for one in shown for size, _ in one.points),
                max(size for one in shown for size, _ in one.points),
            ]
            first = min(time_s for one in shown for size, time_s in one.points if size == ends[0])
            growing = ends[0] / ends[1] if shown[0].shared else ends[1] / ends[0]
            ax.loglog(
                ends,
                [first, first * growing],
                color=MEASURED,
                linestyle=":",
                linewidth=0.8,
                label="in proportion",
            )
            ax.set_xlabel(against)
            ax.set_ylabel("time [s]")
            # Counts and minutes read better as they are than as powers of ten.
            ax.set_xticks(sorted({size for one in shown for size, _ in one.points}))
            ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            for axis in (ax.xaxis, ax.yaxis):
                axis.set_major_formatter("{x:g}")
                axis.set_minor_formatter(NullFormatter())
            ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return svg_text(figure)


def page(sections: Sequence[Section], quick: bool, pictures: Sequence[tuple[str, str]] = ()) -> str:
    """Return the page of all sections in Markdown, with the captions and addresses of its figures."""
    packages = sorted({name for section in sections for name in section.packages})
    versions = "".join(f", {name} {importlib.metadata.version(name)}" for name in packages)
    same = {name: took_s for section in sections for name, took_s in section.same.items()}
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench`. Every ratio is the median of ratios of neighbouring runs of ours and the rival,",
        "and of one run of its table, with a warm page cache. “Reached” compares it with the goal.",
        "",
        f"{os.cpu_count()} cores ({platform.machine()}), Python {platform.python_version()}{versions}.",
        "",
        *yardstick.text(yardsticks(sections), same),
    ]
    if quick:
        lines += ["**A quick run on short logs: the goals are for long ones.**", ""]
    for caption, picture in pictures:
        lines += [f"![{caption}]({picture})", ""]
    lines += missed(sections)
    for section in sections:
        lines += [f"## {section.title}", "", "| what | ours | rival | rival takes | ratio | goal | reached |"]
        lines.append("|---|--:|---|--:|--:|--:|---|")
        for row in judged(section, statistics.median(yardsticks(sections))):
            reached = "" if row.reached is None else "yes" if row.reached else "**no**"
            lines.append(
                f"| {row.what} | {row.ours} | {row.rival} | {row.rival_value} | {row.ratio:.3g} | {row.goal} | {reached} |"
            )
        lines += ["", *(f"- {note}" for note in section.notes), ""]
    whole_s = sum(section.took_s for section in sections)
    parts = [
        f"| {section.title} | {section.took_s:.0f} s | {section.made_s:.0f} s | {sum(section.yardstick_s):.0f} s |"
        for section in sections
    ]
    lines += [
        "## How long this page takes",
        "",
        _page_time(whole_s, statistics.median(yardsticks(sections))),
        "",
        "| part | takes | of that making logs and archives | and the yardstick |",
        "|---|--:|--:|--:|",
        *parts,
    ]
    return "\n".join(lines).rstrip() + "\n"


def missed(sections: Sequence[Section]) -> list[str]:
    """Return the lines on goals that are not reached: by how much, and what limits them; none where all are."""
    yardstick_s = statistics.median(yardsticks(sections))
    found = [
        f"- {row.what} ({row.rival}): {row.ratio:.3g} where {row.goal} is asked for.{row.limit and f' {row.limit}'}"
        for section in sections
        for row in judged(section, yardstick_s)
        if row.reached is False
    ]
    return ["## Goals that are missed, and what limits them", "", *found, ""] if found else []


def _page_time(took_s: float, yardstick_s: float) -> str:
    """Return how long the page took against its goal, as a sentence; a goal in seconds is a multiple of the yardstick."""
    ratio, goal = took_s / yardstick_s, PAGE_GOAL_S / yardstick.GOALS_S
    reached = "reached" if ratio <= goal else "**missed**"
    return (
        f"{took_s / 60:.1f} minutes, {ratio:.0f} times the yardstick. The goal is {goal:.0f} times, "
        f"{PAGE_GOAL_S / 60:.0f} minutes on the machine of the goals: {reached}."
    )


def yardsticks(sections: Sequence[Section]) -> list[float]:
    """Return every measurement of the yardstick in this run [s]."""
    return [took_s for section in sections for took_s in section.yardstick_s]
