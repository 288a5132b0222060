"""Drawings of a page by the names of their files: made beforehand, or when the page asks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import ParamSpec

P = ParamSpec("P")


@dataclass(frozen=True)
class Drawings:
    """Drawings (SVG) that were made already, by the name of the file."""

    made: Mapping[str, str] = field(default_factory=dict)

    def of(self, file: str, draw: Callable[P, str], *args: P.args, **named: P.kwargs) -> str:
        """Return the drawing of a file, which `draw` makes of its arguments where there is none yet."""
        return self.made[file] if file in self.made else draw(*args, **named)


Calls = Mapping[str, Callable[[], str]]
"""What makes each drawing of a page, by the name of its file."""


@dataclass(frozen=True)
class Asked(Drawings):
    """Drawings that a page asks for, to be made together when all are known; until then they are empty."""

    calls: dict[str, Callable[[], str]] = field(default_factory=dict)

    def of(self, file: str, draw: Callable[P, str], *args: P.args, **named: P.kwargs) -> str:
        """Note what makes the drawing of a file."""
        self.calls[file] = partial(draw, *args, **named)
        return ""


def drawn(calls: Calls) -> dict[str, str]:
    """Return the drawings by the names of their files, made one after the other."""
    return {file: draw() for file, draw in calls.items()}


NONE = Drawings()
