"""What a benchmark gives back, and the Markdown page made of it."""

from __future__ import annotations

import gc
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from math import log10
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from ferryid.report.figures import BASE, MEASURED, NEW, STYLE, svg_text


@dataclass(frozen=True)
class Row:
    """One comparison; `goal` is what the ratio must reach (``"≥ 35"``), empty where none is set."""

    what: str
    ours: str
    rival: str
    rival_value: str
    ratio: float
    goal: str = ""
    reached: bool | None = None

    @property
    def over_goal(self) -> float | None:
        """How many times as good as the goal asks for; None where a ratio has no goal of its own."""
        sign, _, number = self.goal.partition(" ")
        try:
            wanted = float(number)
        except ValueError:
            return None
        return self.ratio / wanted if sign == "≥" else wanted / self.ratio


@dataclass(frozen=True)
class Section:
    """One table of the page; `packages` are those whose versions matter to it."""

    title: str
    rows: Sequence[Row]
    notes: Sequence[str] = ()
    packages: Sequence[str] = field(default=())


def packed(section: Section) -> dict[str, Any]:
    """Return a section as plain values."""
    return asdict(section)


def unpacked(plain: dict[str, Any]) -> Section:
    """Return the section of `packed`."""
    return Section(**{**plain, "rows": [Row(**row) for row in plain["rows"]]})


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


def within(
    what: str, ours: Callable[[], object], name: str, limit: Callable[[], object], goal: float, repeats: int
) -> Row:
    """Measure how many times as long ours takes as the least work conceivable."""
    mine, least = in_turn((ours, limit), repeats)
    ratio = statistics.median(a / b for a, b in zip(mine, least, strict=True))
    values = duration(statistics.median(mine)), name, duration(statistics.median(least)), ratio
    return Row(what, *values, f"≤ {goal:g}", ratio <= goal)


def duration(value_s: float) -> str:
    """Return a time with three digits."""
    return f"{value_s:.3g} s" if value_s >= 1 else f"{value_s * 1e3:.3g} ms"


def drawing(sections: Sequence[Section]) -> str:
    """Return a figure (SVG) of every ratio over its goal: what ends to the right of the line is reached."""
    rows = [(row, value) for section in sections for row in section.rows if (value := row.over_goal) is not None]
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


def page(sections: Sequence[Section], quick: bool, picture: str = "") -> str:
    """Return the page of all sections in Markdown, with the address of their `drawing`."""
    packages = sorted({name for section in sections for name in section.packages})
    versions = "".join(f", {name} {importlib.metadata.version(name)}" for name in packages)
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench`. Every ratio is the median of ratios of neighbouring runs of ours and the rival,",
        "and of one run of its table, with a warm page cache. “Reached” compares it with the goal.",
        "",
        f"{os.cpu_count()} cores ({platform.machine()}), Python {platform.python_version()}{versions}.",
        "",
    ]
    if quick:
        lines += ["**A quick run on short logs: the goals are for long ones.**", ""]
    if picture:
        lines += [f"![Every ratio over its goal]({picture})", ""]
    for section in sections:
        lines += [f"## {section.title}", "", "| what | ours | rival | rival takes | ratio | goal | reached |"]
        lines.append("|---|--:|---|--:|--:|--:|---|")
        for row in section.rows:
            reached = "" if row.reached is None else "yes" if row.reached else "**no**"
            lines.append(
                f"| {row.what} | {row.ours} | {row.rival} | {row.rival_value} | {row.ratio:.3g} | {row.goal} | {reached} |"
            )
        lines += ["", *(f"- {note}" for note in section.notes), ""]
    return "\n".join(lines).rstrip() + "\n"
