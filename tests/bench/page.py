"""What a benchmark gives back, and the Markdown page made of it."""

from __future__ import annotations

import gc
import importlib.metadata
import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field


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


@dataclass(frozen=True)
class Section:
    """One table of the page; `packages` are those whose versions matter to it."""

    title: str
    rows: Sequence[Row]
    notes: Sequence[str] = ()
    packages: Sequence[str] = field(default=())


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


def page(sections: Sequence[Section], quick: bool) -> str:
    """Return the page of all sections in Markdown."""
    packages = sorted({name for section in sections for name in section.packages})
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in packages)
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench`. Every ratio is the median of ratios of neighbouring runs of ours and the rival,",
        "in one process run and with a warm page cache. “Reached” compares it with the goal.",
        "",
        f"{os.cpu_count()} cores ({platform.machine()}), Python {platform.python_version()}, {versions}.",
        "",
    ]
    if quick:
        lines += ["**A quick run on short logs: the goals are for long ones.**", ""]
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
