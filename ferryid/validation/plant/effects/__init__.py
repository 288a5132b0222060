"""The effects of the plant: a module here with an ``EFFECT`` is one."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from ferryid.validation.plant.effects.effect import Conditions, PlantEffect

__all__ = ["Conditions", "PlantEffect", "complete_conditions", "plant_effects"]


@cache
def plant_effects() -> Mapping[str, PlantEffect]:
    """Return every effect by its id, by rank and then by id."""
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    found = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.id: effect for effect in sorted(found, key=lambda effect: (effect.rank, effect.id))}


def complete_conditions(conditions: Conditions) -> Conditions:
    """Return conditions with every setting that is not given at the value at which nothing acts.

    Raises
    ------
    ValueError
        For a setting that no effect has.
    """
    every = {"noise": 1.0} | {name: value for one in plant_effects().values() for name, value in one.settings.items()}
    if unknown := sorted(set(conditions) - set(every)):
        raise ValueError(f"no effect of the plant has the settings {', '.join(unknown)}")
    return {**every, **conditions}
