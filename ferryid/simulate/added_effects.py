"""``[[effects]]`` of a scenario: effects that act on the simulated vessel by what their own files say of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ferryid.errors import did_you_mean
from ferryid.simulate.sections import ALWAYS_S
from ferryid.vessel.faults import TableReader
from ferryid.vessel.toml_lines import KeyPath

if TYPE_CHECKING:
    from ferryid.effects.effect import Effect, Parameter
    from ferryid.simulate.scenario import Scenario
    from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class AddedEffect:
    """One entry of ``[[effects]]``: the effect's id, its thruster if it is one's, its parameters by name, and when it acts."""

    effect: str
    values: Mapping[str, float]
    thruster: str = ""
    from_s: float = 0.0
    until_s: float = ALWAYS_S


def simulated() -> list[str]:
    """Return the ids of the effects that ``[[effects]]`` can name."""
    from ferryid.effects import effects  # here and below: heavier than all else that reads scenarios

    return [name for name, effect in effects().items() if effect.simulated is not None]


def given(effect: Effect, profile: Profile) -> list[Parameter]:
    """Return the parameters of an effect that an entry can give: those that the simulated vessel has."""
    lacks = frozenset() if effect.simulated is None else effect.simulated.lacks
    return [one for one in effect.parameters_of(profile) if one.name not in lacks]


def read_effects(top: TableReader) -> tuple[AddedEffect, ...]:
    """Read the entries, noting faults; whether a vessel has such parameters is seen by `unfit`."""
    found = []
    tables = top.tables("effects")
    known = simulated() if tables else []
    for table in tables:
        effect = table.text("effect", required=True, options=known)
        thruster = table.text("thruster")
        from_s = table.number("from_s", 0.0, at_least=0.0, at_most=ALWAYS_S)
        until_s = table.number("until_s", ALWAYS_S, at_least=0.0, at_most=ALWAYS_S)
        own = [name for name in table.data if name not in ("effect", "thruster", "from_s", "until_s")]
        values = {name: table.number(name, 0.0) for name in own}
        if effect:
            found.append(AddedEffect(effect, values, thruster, from_s, until_s))
    return tuple(found)


def unfit(scenario: Scenario, profile: Profile) -> Iterator[tuple[KeyPath, str]]:
    """Yield what entries ask for and the vessel cannot have, each with its place in the file."""
    from ferryid.effects import effects

    for index, one in enumerate(scenario.effects):
        place: KeyPath = ("effects", index)
        effect = effects()[one.effect]
        instances = [name for name in effect.instances(profile) if name is not None]
        if instances and one.thruster not in instances:
            hint = did_you_mean(one.thruster, instances)
            yield (
                (*place, "thruster"),
                f'"{one.effect}" is an effect of one thruster of {profile.name}, found "{one.thruster}".{hint} '
                f'Fix: thruster = "{instances[0]}", or another of {", ".join(instances)}',
            )
        if one.thruster and not instances:
            yield (
                (*place, "thruster"),
                f'"{one.effect}" acts on the whole vessel, found thruster = "{one.thruster}". Fix: leave "thruster" out',
            )
        parameters = {parameter.name: parameter for parameter in given(effect, profile)}
        for name, value in one.values.items():
            if name not in parameters:
                yield (
                    (*place, name),
                    f'"{one.effect}" has no parameter "{name}".{did_you_mean(name, parameters)} '
                    f"Fix: use {', '.join(f'{key} [{each.unit}]' for key, each in parameters.items())}",
                )
            elif not parameters[name].low <= value <= parameters[name].high:
                low, high = parameters[name].low, parameters[name].high
                yield (
                    (*place, name),
                    f'"{name}" must lie from {low:g} to {high:g} {parameters[name].unit}, found {value:g}. '
                    "Fix: keep to these limits",
                )


def acting(scenario: Scenario) -> tuple[AddedEffect, ...]:
    """Return the effects of a scenario, those that have a section of their own among them."""
    line = scenario.mooring
    values = {
        "stiffness_north": line.stiffness_north_Npm,
        "stiffness_east": line.stiffness_east_Npm,
        "north": line.north_m,
        "east": line.east_m,
    }
    moored = line.stiffness_north_Npm > 0.0 or line.stiffness_east_Npm > 0.0
    held = (AddedEffect("mooring", values, from_s=line.from_s, until_s=line.until_s),) if moored else ()
    return (*held, *scenario.effects)
