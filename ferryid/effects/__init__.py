"""The library of effects: a module here with an ``EFFECT`` is one.

`effects()` lists them by id, in alphabetical order.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from ferryid.effects.effect import Effect, Parameter

__all__ = ["Effect", "Parameter", "effects"]


@cache
def effects() -> Mapping[str, Effect]:
    """Return every effect by its id."""
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    found = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.id: effect for effect in sorted(found, key=lambda effect: effect.id)}
