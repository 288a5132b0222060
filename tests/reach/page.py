"""The report: targets first, then every cell, the confusion matrix, and what was drawn."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from math import isnan
from typing import Any

from ferryid.diagnose.hypothesis import WIDER
from ferryid.diagnose.result import HINT
from tests.reach.cells import KINDS, Cell
from tests.reach.places import HULL_ERROR, PLACES, USUAL
from tests.reach.scores import WITHIN, Line, Score, Share, confusion, quantile, score

SCHEMA = "ferryid.reach/1"
HEADS: Mapping[str, str] = {
    "clean": "Nothing in the log",
    "single": "One effect all along",
    "onset": "One effect in a part of the log",
    "sensor": "Mistakes of sensors",
    "pair": "Two effects",
    "triple": "Three effects",
    "concealed": "One effect under unsteady weather",
    "outside": "Outside the library",
}
REASONS: Mapping[str, str] = {
    "revolt": "the velocity's noise times ReVolt's sway damping is a tenth of its thrust; m22 refitted grows to hide it, and "
    "names rest on that hull",
}
"""Why a cell or place misses its targets, where that is known; told only where it does."""
WIDE = "the log leaves parameters {0:.0f} % uncertain (half of the 95 % interval, which holds the truth)"


def percent(share: Share, digits: int = 0) -> str:
    """Return a share as text, with how many it is of."""
    return "" if share.of == 0 else f"{100.0 * share.value:.{digits}f} % ({share.count}/{share.of})"


def targets(lines: Sequence[Line]) -> list[dict[str, Any]]:
    """Return the targets with what was reached, in the usual place."""
    usual = [line for line in lines if line["draw"]["place"] == USUAL]
    of = {kind: score(line for line in usual if line["draw"]["kind"] == kind) for kind in KINDS}
    single = score(line for line in usual if line["draw"]["kind"] in ("single", "onset"))
    rows = [
        _share("single effects named first", single.first, 0.95, at_least=True),
        _number("median relative error of their parameters", quantile(single.errors, 0.5), 0.05, "{:.1%}"),
        _share("their parameters within 10 %", single.within, 0.9, at_least=True),
        _share("onsets and offsets within 5 s", of["onset"].in_time, 0.9, at_least=True),
        _share("95 % intervals of onsets and offsets that hold the truth", of["onset"].onset_held, 0.9, at_least=True),
        _share("clean runs with any name", of["clean"].mentioned, 0.01, at_least=False),
        _share("both of two effects named", of["pair"].every, 0.85, at_least=True),
        _share("runs outside the library with a wrong name", of["outside"].false, 0.0, at_least=False),
        _share("95 % intervals that hold the truth", single.covered, 0.9, at_least=True),
    ]
    return [row for row in rows if row is not None]


def _share(what: str, share: Share, goal: float, *, at_least: bool) -> dict[str, Any] | None:
    if share.of == 0:
        return None
    low, high = share.interval
    return {
        "what": what,
        "value": share.value,
        "low": low,
        "high": high,
        "count": share.count,
        "of": share.of,
        "target": f"{'at least' if at_least else 'at most'} {100.0 * goal:.0f} %",
        "reached": share.value >= goal if at_least else share.value <= goal,
        "shown": low >= goal if at_least else high <= goal,
    }


def _number(what: str, value: float, goal: float, form: str) -> dict[str, Any] | None:
    if isnan(value):
        return None
    return {"what": what, "value": value, "target": f"at most {form.format(goal)}", "reached": value <= goal}


def results(lines: Sequence[Line], cells: Sequence[Cell], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return all scores as plain data."""
    rows = []
    for cell in cells:
        own = [line for line in lines if (line["draw"]["cell"], line["draw"]["place"]) == (cell.name, cell.place)]
        if own:
            rows.append({"cell": cell.name, "kind": cell.kind, "place": cell.place, **as_json(score(own))})
    usual = [line for line in lines if line["draw"]["place"] == USUAL]
    names, columns, counts = confusion(_in_order(usual))
    return {
        "schema": SCHEMA,
        **settings,
        "targets": targets(lines),
        "cells": rows,
        "confusion": {"rows": names, "columns": columns, "counts": counts},
    }


def as_json(one: Score) -> dict[str, Any]:
    """Return scores as plain data; what there is none of is left out."""

    def share(value: Share) -> dict[str, Any]:
        return {"count": value.count, "of": value.of, "interval": list(value.interval)}

    told: dict[str, Any] = {"runs": one.runs, "refused": one.refused}
    for key in ("first", "every", "false", "mentioned", "within", "covered", "in_time", "onset_held"):
        value: Share = getattr(one, key)
        if value.of:
            told[key] = share(value)
    for key in ("errors", "half_widths", "onsets_s", "seconds"):
        values = [value for value in getattr(one, key) if value != float("inf")]
        if values:
            told[key] = {"median": quantile(values, 0.5), "p90": quantile(values, 0.9)}
    return told


def _widths(lines: Sequence[Line]) -> list[str]:
    """Return how wide intervals would have to be."""
    reaches = score(line for line in lines if line["draw"]["place"] == USUAL).reaches
    if not reaches:
        return []
    return [
        f"Intervals {quantile(reaches, 0.95):.2f} times as wide as told would hold 95 % of the {len(reaches)} parameters",
        f"of all that was rightly named there; told, they are {WIDER:g} times as wide as the posterior's.",
    ]


def _in_order(lines: Sequence[Line]) -> list[Line]:
    return sorted(lines, key=lambda line: KINDS.index(line["draw"]["kind"]))


def page(
    lines: Sequence[Line],
    cells: Sequence[Cell],
    settings: Mapping[str, Any],
    figures: str,
    more: Sequence[str] = (),
) -> str:
    """Return the report in Markdown.

    Parameters
    ----------
    lines
        All runs.
    cells
        All cells, in order.
    settings
        ``runs``, ``seed``, ``version`` of the sources, and ``only`` what of the study was run, empty for all.
    figures
        Folder of the figures, from where the page lies.
    more
        Lines of further sections.
    """
    seconds = [line["seconds"] for line in lines]
    text = [
        "# Reach of `ferryid diagnose`",
        "",
        "Written by `make reach`. Physics is concealed in trials of ferryid's own simulator; each log is written, read and",
        f"diagnosed as a user's would be. The true hull's coefficients are {100.0 * HULL_ERROR:.0f} % off the profile's, each",
        "either way at random in every run, so that the model is wrong as well. Directions, signs, sizes and thrusters are",
        "drawn anew for each run, sizes about the moderate ones of `tests/reach/draw.py`.",
        "",
        f"{len(lines)} runs ({settings['runs']} of each single effect, seed {settings['seed']}), sources",
        f"`{settings['version']}`; {quantile(seconds, 0.5):.1f} s a diagnosis (median; 90 % within",
        f"{quantile(seconds, 0.9):.1f} s), runs side by side on {os.cpu_count()} cores ({platform.machine()}),",
        "whatever else these did.",
        *([f"A part of the study only: {settings['only']}."] if settings["only"] else []),
        "",
        "A finding with a probability above 0.5 counts as a name. Errors of parameters are relative to how far the truth is",
        "from neutral (of a factor 0.8: to 0.2), those of vectors to the vector's length. Intervals in brackets are 95 %,",
        "Clopper-Pearson.",
        "",
        "## Targets",
        "",
        f"On the {PLACES[USUAL].title}.",
        "",
        "| what | reached | target | |",
        "|---|--:|--:|---|",
    ]
    for row in targets(lines):
        if "of" in row:
            interval = f" [{100.0 * row['low']:.1f}, {100.0 * row['high']:.1f}]"
            value = f"{100.0 * row['value']:.1f} % ({row['count']}/{row['of']}){interval}"
        else:
            value = f"{100.0 * row['value']:.1f} %"
        text.append(f"| {row['what']} | {value} | {row['target']} | {_verdict(row)} |")
    text += ["", *_widths(lines), ""]
    for place in PLACES.values():
        for kind in KINDS:
            own = [cell for cell in cells if cell.kind == kind and cell.place == place.name]
            table = _table(kind, own, lines)
            if table:
                text += [f"## {HEADS[kind]}: {place.title}", "", *table, ""]
    usual = _in_order([line for line in lines if line["draw"]["place"] == USUAL])
    names, columns, counts = confusion(usual)
    text += [
        "## What is named first",
        "",
        f"What is in the log downwards, the first name across, on the {PLACES[USUAL].title}.",
        "",
        f"![Confusion matrix]({figures}/confusion.svg)",
        "",
        *_matrix(names, columns, counts),
        "",
        f"![Relative errors of parameters]({figures}/errors.svg)",
        "",
        *more,
    ]
    return "\n".join(text).rstrip() + "\n"


def _verdict(row: Mapping[str, Any]) -> str:
    """Return whether a target is reached; where the interval reaches beyond it, so few runs do not show it."""
    if not row["reached"]:
        return "**missed**"
    return "yes" if row.get("shown", True) else "so far"


def _table(kind: str, cells: Sequence[Cell], lines: Sequence[Line]) -> list[str]:
    rows = []
    for cell in cells:
        own = [line for line in lines if (line["draw"]["cell"], line["draw"]["place"]) == (cell.name, cell.place)]
        if own:
            rows.append(_row(kind, cell, own))
    if not rows:
        return []
    if kind == "clean":
        head = "| cell | what | any name | a name above 0.5 | s |", "|---|---|--:|--:|--:|"
    elif kind == "outside":
        head = "| cell | what | a wrong name | named | s |", "|---|---|--:|---|--:|"
    else:
        head = (
            "| cell | named first | all named | false names | error median | 90 % | within 10 % | interval's half | "
            "intervals hold | onset median | within 5 s | s |",
            "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
        )
    reasons = [f"- {reason}." for reason in _reasons(kind, cells, lines)]
    return [*head, *rows, *([""] if reasons else []), *reasons]


def _reasons(kind: str, cells: Sequence[Cell], lines: Sequence[Line]) -> list[str]:
    """Return why cells of a table miss their targets, as far as it is known."""
    told = []
    if cells[0].place in REASONS:
        clean = score(
            line for line in lines if (line["draw"]["place"], line["draw"]["kind"]) == (cells[0].place, "clean")
        )
        told += [f"all of them: {REASONS[cells[0].place]}"] if clean.mentioned.count else []
    for cell in cells if kind in ("single", "sensor") else ():
        one = score(line for line in lines if (line["draw"]["cell"], line["draw"]["place"]) == (cell.name, cell.place))
        width = quantile(one.half_widths, 0.5)
        missed = quantile(one.errors, 0.5) > 0.05
        if cell.name in REASONS and (missed or one.first.value < 0.95):
            told.append(f"{cell.name}: {REASONS[cell.name]}")
        if missed and width > WITHIN and one.covered.value >= 0.85:
            told.append(f"{cell.name}: {WIDE.format(100.0 * width)}")
    return told


def _row(kind: str, cell: Cell, own: Sequence[Line]) -> str:
    one = score(own)
    seconds = f"{quantile(one.seconds, 0.5):.1f}"
    if kind == "clean":
        low, high = one.mentioned.interval
        mark = "" if one.mentioned.value <= 0.01 else " **missed**"
        any_name = f"{percent(one.mentioned)} [{100.0 * low:.1f}, {100.0 * high:.1f}]{mark}"
        return f"| {cell.name} | {cell.title} | {any_name} | {percent(one.false)} | {seconds} |"
    if kind == "outside":
        count: dict[str, int] = {}
        for line in own:
            told = (
                ", ".join(f"{f['effect']}{'' if f['probability'] > HINT else '?'}" for f in line["findings"])
                or line["verdict"]
            )
            count[told] = count.get(told, 0) + 1
        named = "; ".join(f"{told} ×{n}" for told, n in sorted(count.items(), key=lambda pair: -pair[1]))
        mark = " **missed**" if one.false.count else ""
        return f"| {cell.name} | {cell.title} | {percent(one.false)}{mark} | {named} | {seconds} |"
    goal = {"pair": 0.85, "triple": 0.0, "concealed": 0.0}.get(kind, 0.95)
    reached = one.every if kind == "pair" else one.first
    marks = [" **missed**" if reached.value < goal else ""]
    median = quantile(one.errors, 0.5)
    marks.append(" **missed**" if kind in ("single", "onset", "sensor") and median > 0.05 else "")
    first, every = percent(one.first), percent(one.every)
    columns = [
        cell.name,
        first + ("" if kind == "pair" else marks[0]),
        every + (marks[0] if kind == "pair" else ""),
        percent(one.false),
        "" if isnan(median) else f"{100.0 * median:.1f} %{marks[1]}",
        "" if isnan(median) else f"{100.0 * quantile(one.errors, 0.9):.1f} %",
        percent(one.within),
        "" if isnan(median) else f"{100.0 * quantile(one.half_widths, 0.5):.0f} %",
        percent(one.covered),
        f"{quantile(one.onsets_s, 0.5):.1f} s".replace("inf s", "none") if one.onsets_s else "",
        percent(one.in_time),
        seconds,
    ]
    return "| " + " | ".join(columns) + " |"


def _matrix(rows: Sequence[str], columns: Sequence[str], counts: Sequence[Sequence[int]]) -> list[str]:
    lines = ["| | " + " | ".join(columns) + " |", "|---|" + "--:|" * len(columns)]
    for name, row in zip(rows, counts, strict=True):
        lines.append(f"| {name} | " + " | ".join(str(n) if n else "" for n in row) + " |")
    return lines
