"""One module per form that a model is exported in; each has a Format as FORMAT and is found by `formats`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ferryid.export.format import Format


def names() -> tuple[str, ...]:
    """Return the names of all forms, those of their files, in alphabetical order; nothing heavy is imported for it."""
    return tuple(sorted(module.name for module in iter_modules(__path__)))


@cache
def formats() -> Mapping[str, Format]:
    """Return every form by its name, in alphabetical order."""
    return {name: import_module(f"{__name__}.{name}").FORMAT for name in names()}
