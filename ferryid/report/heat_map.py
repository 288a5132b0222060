"""Heat maps of a page whose cells show their values under the pointer and at the keys.

A few dozen lines of script, which the page holds itself: they need no library and no other file. On paper, and where scripts do
not run, the static figure stands in their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

from markupsafe import Markup


@dataclass(frozen=True)
class HeatCell:
    """One cell.

    Attributes
    ----------
    fill
        Its colour as of CSS; a whole number is that many per cent of the page's own strong colour on its card.
    says
        Its values as a sentence.
    text
        What stands in it, empty for nothing.
    on_dark
        Whether that stands on a strong colour.
    outlined, chosen
        Whether it is outlined, and whether it is the choice, which has a star.
    """

    fill: str | int
    says: str
    text: str = ""
    on_dark: bool = False
    outlined: bool = False
    chosen: bool = False


@dataclass(frozen=True)
class HeatMap:
    """A heat map.

    Attributes
    ----------
    label
        What it shows, for those who do not see it.
    across, along
        Names of the horizontal and of the vertical axis.
    columns, rows
        Names of the columns from the left, and of the rows from the top.
    cells
        By row and column.
    bar
        Colours of the scale from its beginning to its end.
    ends
        Numbers beside the scale, evenly spaced.
    scale
        Name of the scale.
    faint
        Rows whose names are grey.
    """

    label: str
    across: str
    along: str
    columns: Sequence[str]
    rows: Sequence[str]
    cells: Sequence[Sequence[HeatCell]]
    bar: Sequence[str]
    ends: Sequence[str]
    scale: str
    faint: Sequence[int] = ()

    def plain(self) -> dict[str, Any]:
        """Return it for the page's script; what is as usual is left out."""
        rows = [[asdict(one) for one in row] for row in self.cells]
        cells = [[{key: value for key, value in one.items() if value or key == "fill"} for one in row] for row in rows]
        return {**asdict(replace(self, cells=())), "cells": cells}


@cache
def inline() -> dict[str, Markup]:
    """Return the style and the script of heat maps, which a page holds itself."""
    folder = files("ferryid.report") / "static"
    return {
        "style": Markup((folder / "heat_map.css").read_text(encoding="utf-8")),
        "script": Markup((folder / "heat_map.js").read_text(encoding="utf-8")),
    }
