"""How alike the effects look in logs: a heat map, and the pairs that look alike in words."""

from __future__ import annotations

from typing import Any

from ferryid.counts import counted
from ferryid.diagnose import Likeness, Pair, separation
from ferryid.effects.wording import listed, uncapitalised
from ferryid.report.drawings import NONE, Drawings
from ferryid.report.figures import MEASURED, WIDTH, margins, styled, svg_text
from ferryid.report.heat_map import HeatCell, HeatMap

CELL, NAMES, BAR = 0.27, 2.9, 0.7
"""Inches of a cell at most, of the names beside the map, and of the scale with its label."""
WRITTEN, DARK = 0.3, 0.6
"""Likeness from which a cell shows its number, and above which that is white on a dark ground."""
IN_TEXT = 5
"""Pairs that the text for a terminal names; the page has all."""


def heat_map(likeness: Likeness) -> str:
    """Draw the likeness of every two effects, alike ones beside each other; behind each name how visible it is."""
    effects, n = likeness.effects, len(likeness.effects)
    side = min(CELL * n, WIDTH - NAMES - BAR - 0.1)
    bottom, top = 0.35, 0.1
    height = side + bottom + top
    with styled({"axes.grid": False}):
        figure = margins(height)
        ax = figure.add_axes((NAMES / WIDTH, bottom / height, side / WIDTH, side / height))
        mesh = ax.pcolormesh(likeness.matrix, cmap="Blues", vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.6)
        size = 72.0 * side / n
        for i in range(n):
            for j in range(n):
                value = float(likeness.matrix[i, j])
                if i != j and value >= WRITTEN:
                    # "1" would claim what no log shows.
                    text = f"{min(value, 0.99):.2f}".lstrip("0")
                    colour = "white" if value > DARK else MEASURED
                    ax.text(
                        j + 0.5, i + 0.5, text, ha="center", va="center", color=colour, fontsize=min(7.0, 0.45 * size)
                    )
        places = [k + 0.5 for k in range(n)]
        font = min(8.0, 0.75 * size)
        ax.set_yticks(
            places, [f"{one.title} · {_size(one.signal_to_noise)} σ  {k}" for k, one in enumerate(effects, 1)]
        )
        ax.set_xticks(places, [str(k) for k in range(1, n + 1)])
        ax.tick_params(length=0, labelsize=font)
        ax.tick_params(axis="x", labelsize=min(font, 0.42 * size))
        for label, one in zip(ax.get_yticklabels(), effects, strict=True):
            label.set_color(MEASURED if one.visible else "#888888")
        ax.invert_yaxis()
        for spine in ax.spines.values():
            spine.set_visible(False)
        bar = figure.add_axes(((NAMES + side + 0.12) / WIDTH, bottom / height, 0.12 / WIDTH, side / height))
        figure.colorbar(mesh, cax=bar, label="likeness", ticks=[0.0, 0.5, 1.0])
        bar.tick_params(labelsize=8)
        return svg_text(figure)


def heat_cells(likeness: Likeness) -> HeatMap:
    """Return the same for the page's script: each cell has the two effects, and from which size on they are distinguished."""
    effects, pairs = likeness.effects, {frozenset((one.first, one.second)): one for one in likeness.pairs}

    def cell(i: int, j: int) -> HeatCell:
        value, one = float(likeness.matrix[i, j]), effects[i]
        fill = round(100.0 * value)
        if i == j:
            size = f"{one.title}: signal-to-noise ratio {_size(one.signal_to_noise)} at its usual size"
            return HeatCell(fill, f"{size}{'' if one.visible else ', too little to be named'}.")
        pair = pairs.get(frozenset((one.key, effects[j].key)))
        apart = "" if pair is None else f" Distinguished {_from(pair)}."
        says = f"{one.title} and {uncapitalised(effects[j].title)}: likeness {_number(value)}.{apart}"
        text = f"{min(value, 0.99):.2f}".lstrip("0") if value >= WRITTEN else ""
        return HeatCell(fill, says, text, on_dark=value > DARK)

    places = range(len(effects))
    return HeatMap(
        "likeness of every two effects",
        "number of the effect",
        "",
        [str(k + 1) for k in places],
        [f"{k} {one.title} · {_size(one.signal_to_noise)} σ" for k, one in enumerate(effects, 1)],
        [[cell(i, j) for j in places] for i in places],
        ["var(--card)", "var(--new)"],
        ["0", "0.5", "1"],
        "likeness",
        [k for k in places if not effects[k].visible],
    )


def section(
    likeness: Likeness | None, file: str, where: str, *, drawn: bool = True, drawings: Drawings = NONE
) -> dict[str, Any]:
    """Return what a page shows of it; empty where no two effects can be compared.

    `where` is "this log" or what else was looked at, for sentences; `drawings` are those that exist already.
    """
    if likeness is None or len(likeness.effects) < 2:
        return {}
    caption = (
        f"Likeness of what every two effects do to the prediction errors of {where}, after what a refitted hull takes of it: 1 "
        "where they cannot be distinguished, 0 where neither looks like the other at all. Alike ones stand beside each other. "
        "σ: signal-to-noise ratio of the effect at its usual size; grey where that is too little to be named."
    )
    return {
        "says": sentences(likeness, where),
        "rows": [_row(likeness, one) for one in likeness.alike],
        "figures": [
            {
                "file": file,
                "svg": drawings.of(file, heat_map, likeness),
                "heat": heat_cells(likeness).plain(),
                "caption": caption,
            }
        ]
        if drawn
        else [],
    }


def sentences(likeness: Likeness, where: str) -> list[str]:
    """Return how many effects look alike, and which could not be seen, as sentences."""
    count = len(likeness.effects) - len(likeness.hidden)
    lines = []
    if count > 1:
        lines.append(
            f"Before anything is fitted: of {counted(count, 'effect')} that {where} would show at their usual size, "
            + (
                f"{counted(len(likeness.alike), 'pair')} look much alike."
                if len(likeness.alike) > 1
                else "one pair looks much alike."
                if likeness.alike
                else "no two look much alike."
            )
        )
        apart = [one for one in likeness.alike if not one.resolved]
        if apart:
            lines.append(f"{counted(len(apart), 'pair').capitalize()} cannot be distinguished at the usual size.")
    if likeness.hidden:
        names = listed([uncapitalised(one.title) for one in likeness.hidden])
        lines.append(f"Too small at their usual size to be named here: {names}.")
    return lines


def notes(likeness: Likeness | None, where: str) -> list[str]:
    """Return the pairs that look alike as one sentence for a terminal; none where there are none."""
    if likeness is None or not likeness.alike:
        return []
    pairs = [f"{names(likeness, one)} ({_value(one)})" for one in likeness.alike[:IN_TEXT]]
    more = len(likeness.alike) - IN_TEXT
    pairs += [counted(more, "other pair")] if more > 0 else []
    return [f"In {where} these look alike (1: cannot be distinguished): {'; '.join(pairs)}."]


def names(likeness: Likeness, pair: Pair) -> str:
    """Return the titles of two effects."""
    return f"{uncapitalised(likeness.title(pair.first))} and {uncapitalised(likeness.title(pair.second))}"


def resolved(pair: Pair) -> str:
    """Return from which size on two effects are distinguished."""
    if pair.resolved_from is None:
        return "at no size"
    return (
        f"{pair.resolved_from:.2g} of the usual size"
        if pair.resolved_from < 1.0
        else f"{pair.resolved_from:.2g} usual sizes"
    )


def _row(likeness: Likeness, pair: Pair) -> dict[str, str]:
    between = separation(pair.first, pair.second, likeness.circumstances)
    return {
        "names": names(likeness, pair),
        "likeness": _value(pair),
        "from": resolved(pair),
        "record": between.manoeuvre,
        "measure": between.sensor or "–",
    }


def _value(pair: Pair) -> str:
    return _number(pair.likeness)


def _number(likeness: float) -> str:
    return f"{likeness:.2f}" if likeness < 0.995 else "above 0.99"


def _from(pair: Pair) -> str:
    """Return from which size on two effects are distinguished, for a sentence."""
    return (
        f"{'' if pair.resolved_from is None else 'from '}{resolved(pair)}{'' if pair.resolved_from is None else ' on'}"
    )


def _size(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
