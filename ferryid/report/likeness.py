"""How alike the effects look in a log: a heat map, and the pairs that the log hardly separates, as words."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl

from ferryid.counts import counted
from ferryid.diagnose import Likeness, Pair
from ferryid.effects.wording import listed
from ferryid.report.figures import MEASURED, STYLE, WIDTH, margins, svg_text

CELL, NAMES, BAR, BELOW = 0.27, 2.55, 0.75, 0.3
"""Inches of a cell, of the names beside the map, of the scale and its label, and of the numbers below."""
WRITTEN = 0.3
"""Likeness from which a cell shows its number."""
DARK = 0.6
"""Likeness above which the ground of a cell is dark, and its number white."""
IN_TEXT = 5
"""Pairs that the text for a terminal names; the page has all."""


def heat_map(likeness: Likeness) -> str:
    """Draw the likeness of every two effects, with how visible each is."""
    effects, q = likeness.effects, len(likeness.effects)
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        height = BELOW + CELL * max(q, 6) + 0.1
        figure = margins(height, left=NAMES)
        ax = figure.add_axes(
            (NAMES / WIDTH, BELOW / height, (WIDTH - NAMES - BAR - 0.1) / WIDTH, CELL * max(q, 6) / height)
        )
        mesh = ax.pcolormesh(likeness.matrix, cmap="Blues", vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.6)
        for i in range(q):
            for j in range(q):
                value = float(likeness.matrix[i, j])
                if i != j and value >= WRITTEN:
                    colour = "white" if value > DARK else MEASURED
                    text = f"{min(value, 0.99):.2f}".lstrip("0")
                    ax.text(j + 0.5, i + 0.5, text, ha="center", va="center", color=colour, fontsize=6)
        places = [k + 0.5 for k in range(q)]
        ax.set_yticks(places, [f"{k}  {one.title}, {_size(one.visibility)}" for k, one in enumerate(effects, 1)])
        ax.set_xticks(places, [str(k) for k in range(1, q + 1)])
        ax.tick_params(length=0, labelsize=8)
        ax.invert_yaxis()
        for side in ax.spines.values():
            side.set_visible(False)
        beside = figure.add_axes(((WIDTH - BAR) / WIDTH, BELOW / height, 0.12 / WIDTH, CELL * max(q, 6) / height))
        figure.colorbar(mesh, cax=beside, label="likeness [-]")
        beside.tick_params(labelsize=8)
        return svg_text(figure)


def section(likeness: Likeness | None, file: str, drawn: bool) -> dict[str, Any]:
    """Return what the page shows of it: figures, a sentence and rows of pairs; empty where no two effects can be compared."""
    if likeness is None or len(likeness.effects) < 2:
        return {}
    caption = (
        "Likeness of what two effects do to the prediction errors of this log, beside a hull whose coefficients are refitted: "
        "1 cannot be separated, 0 cannot be mistaken. Behind each name: the signal-to-noise ratio of the effect at its usual "
        "size. Alike ones stand side by side."
    )
    return {
        "says": _sentence(likeness),
        "faint": _faint(likeness),
        "rows": [
            {
                "names": _names(likeness, one),
                "cells": [f"{one.likeness:.3f}", _size(one.apart)],
                "record": one.manoeuvre,
                "measure": one.sensor or "–",
            }
            for one in likeness.pairs
        ],
        "figures": [{"file": file, "svg": heat_map(likeness), "caption": caption}] if drawn else [],
    }


def line(likeness: Likeness | None) -> str:
    """Return the pairs that a log hardly separates as one sentence for a terminal; empty where there are none."""
    if likeness is None or not likeness.pairs:
        return ""
    pairs = [f"{_names(likeness, one)} ({one.likeness:.3f})" for one in likeness.pairs[:IN_TEXT]]
    more = len(likeness.pairs) - IN_TEXT
    pairs += [f"{counted(more, 'other pair')}"] if more > 0 else []
    return f"Alike in this log (1: cannot be separated): {listed(pairs)}."


def _sentence(likeness: Likeness) -> str:
    effects = counted(len(likeness.effects), "effect")
    if not likeness.pairs:
        return f"This log separates every two of the {effects} that it shows at their usual size."
    return (
        f"Of the {effects} that this log shows at their usual size, it hardly separates "
        f"{counted(len(likeness.pairs), 'pair')}. What is left is the signal-to-noise ratio of what distinguishes the less "
        "visible one of the two from the other."
    )


def _faint(likeness: Likeness) -> str:
    if not likeness.faint:
        return ""
    names = listed([one.title.lower() for one in likeness.faint])
    return f"Not compared, as noise would hide an effect of usual size: {names}."


def _names(likeness: Likeness, pair: Pair) -> str:
    one, other = (likeness.effects[k].title for k in (pair.first, pair.second))
    return f"{one.lower()} and {other.lower()}"


def _size(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
