"""Drawings of a page by the names of their files: made beforehand, or when the page asks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ParamSpec

P = ParamSpec("P")


@dataclass(frozen=True)
class Drawings:
    """Drawings (SVG) that were made already, by the name of the file."""

    made: Mapping[str, str] = field(default_factory=dict)

    def of(self, file: str, draw: Callable[P, str], *args: P.args, **named: P.kwargs) -> str:
        """Return the drawing of a file, which `draw` makes of its arguments where there is none yet."""
        return self.made[file] if file in self.made else draw(*args, **named)


NONE = Drawings()
