"""The concealments: a module here with a ``CONCEALMENT`` is one."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from ferryid.validation.recorded.effects.effect import ACTUATOR, LOAD, SENSOR, Concealed, Concealment

__all__ = ["ACTUATOR", "LOAD", "SENSOR", "Concealed", "Concealment", "concealments"]


@cache
def concealments() -> Mapping[str, Concealment]:
    """Return every concealment by the id of its effect, by family and then by id."""
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    found = [module.CONCEALMENT for module in modules if hasattr(module, "CONCEALMENT")]
    families = (SENSOR, ACTUATOR, LOAD)
    return {one.id: one for one in sorted(found, key=lambda one: (families.index(one.family), one.id))}
