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


def alternate(
    ours: Callable[[], object], rival: Callable[[], object], repeats: int
) -> tuple[float, float, list[tuple[float, float]]]:
    """Time two things in turn.

    Returns
    -------
    tuple
        Medians of ours and of the rival [s], and all pairs.
    """
    pairs = []
    for _ in range(repeats):
        pairs.append((seconds(ours), seconds(rival)))
    return statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs), pairs


def seconds(work: Callable[[], object]) -> float:
    """Time one call [s]; what earlier calls left behind is collected before."""
    gc.collect()
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def faster(
    what: str,
    ours: Callable[[], object],
    name: str,
    rival: Callable[[], object],
    goal: float | None,
    repeats: int,
) -> Row:
    """Row of how many times faster ours is: the median of the ratios of neighbouring runs."""
    a, b, pairs = alternate(ours, rival, repeats)
    ratio = statistics.median(theirs / mine for mine, theirs in pairs)
    if goal is None:
        return Row(what, duration(a), name, duration(b), ratio)
    return Row(what, duration(a), name, duration(b), ratio, f"≥ {goal:g}", ratio >= goal)


def within(
    what: str, ours: Callable[[], object], name: str, limit: Callable[[], object], goal: float, repeats: int
) -> Row:
    """Row of how many times as long ours takes as the least work conceivable."""
    a, b, pairs = alternate(ours, limit, repeats)
    ratio = statistics.median(mine / theirs for mine, theirs in pairs)
    return Row(what, duration(a), name, duration(b), ratio, f"≤ {goal:g}", ratio <= goal)


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
