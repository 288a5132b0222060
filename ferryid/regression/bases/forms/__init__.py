"""The bases, functions of motion: a module here with a ``FORM`` is one, and its file's name is what `--basis` takes.

`names()` lists them without importing anything heavy, `forms()` has what they consist of.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ferryid.regression.bases.term import Form


def basis_names() -> tuple[str, ...]:
    """Return the names of all bases in alphabetical order: ``second-order`` for the file ``second_order.py``."""
    return tuple(sorted(module.name.replace("_", "-") for module in iter_modules(__path__)))


@cache
def basis_forms() -> Mapping[str, Form]:
    """Return every basis by its name, in alphabetical order."""
    return {name: import_module(f"{__name__}.{name.replace('-', '_')}").FORM for name in basis_names()}
