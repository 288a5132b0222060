"""Line drawings as data, so that what computes them need not know how they are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.types import Floats


@dataclass(frozen=True)
class Line:
    """One line of a panel, with a band around it where `low` and `high` are given.

    Attributes
    ----------
    label
        Name in the legend; lines of the same label share a colour.
    x, y
        Shape (n,).
    low, high
        Edges of the band, shape (n,), or None.
    marked
        True: a mark at every point.
    """

    label: str
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None
    marked: bool = False


@dataclass(frozen=True)
class Panel:
    """One pair of axes."""

    y_label: str
    lines: tuple[Line, ...]
    title: str = ""
    logarithmic: bool = False


@dataclass(frozen=True)
class Drawing:
    """Panels below one another (or in two columns) with one horizontal axis and one legend.

    `equal` gives both axes the same scale, for tracks.
    """

    name: str
    caption: str
    x_label: str
    panels: tuple[Panel, ...]
    columns: int = 1
    equal: bool = False
