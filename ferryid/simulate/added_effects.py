"""``[[effects]]`` of a scenario: effects that act on the simulated vessel by what their own files say of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import borrowing
from ferryid.effects import effects
from ferryid.effects.simulated import address_of, call_load, call_thrust, load_address, thrust_address
from ferryid.errors import did_you_mean
from ferryid.simulate.plant.hull import Force
from ferryid.simulate.sections import ALWAYS_S
from ferryid.vessel.faults import TableReader
from ferryid.vessel.profile import Profile
from ferryid.vessel.toml_lines import KeyPath

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario

Floats = NDArray[np.float64]
Wholes = NDArray[np.int64]

EVERY = -1
"""In the place of a thruster: each of them."""


@dataclass(frozen=True)
class AddedEffect:
    """One entry of ``[[effects]]``: the effect's id, its thruster if it is one's, its parameters by name, and when it acts."""

    effect: str
    values: Mapping[str, float]
    thruster: str = ""
    from_s: float = 0.0
    until_s: float = ALWAYS_S


class Added(NamedTuple):
    """Q effects for compiled code.

    `load` and `thrust` (Q,) are addresses of functions, 0 for none, `thruster` (Q,) says on which a change of thrust acts,
    `values` (Q, m) are their parameters, and `parameters` (Q,) the addresses of its rows. Written anew are `acts` (Q,), 1 for
    those that act in the present step, and `force` (3,) at the address `force_at`, by every load.
    """

    load: Wholes
    thrust: Wholes
    thruster: Wholes
    values: Floats
    parameters: Wholes
    acts: Floats
    force: Floats
    force_at: int


def simulated() -> list[str]:
    """Return the ids of the effects that ``[[effects]]`` can name."""
    return [name for name, effect in effects().items() if effect.simulated is not None]


def read_effects(top: TableReader) -> tuple[AddedEffect, ...]:
    """Read the entries, noting faults; whether a vessel has such parameters is seen by `unfit`."""
    found = []
    for table in top.tables("effects"):
        effect = table.text("effect", required=True, options=simulated())
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
        parameters = {parameter.name: parameter for parameter in effect.parameters_of(profile)}
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


def build_added(added: tuple[AddedEffect, ...], profile: Profile) -> Added:
    """Return effects for compiled code; a parameter that is not given is neutral."""
    names = [actuator.name for actuator in profile.actuators]
    parameters = [effects()[one.effect].parameters_of(profile) for one in added]
    values = np.zeros((len(added), max([len(each) for each in parameters], default=0)))
    for row, one, own in zip(values, added, parameters, strict=True):
        row[: len(own)] = [one.values.get(each.name, each.neutral) for each in own]
    hooks = [effects()[one.effect].simulated for one in added]
    force = np.zeros(3)
    return Added(
        load=_addresses(load_address(one.load) if one and one.load else 0 for one in hooks),
        thrust=_addresses(thrust_address(one.thrust) if one and one.thrust else 0 for one in hooks),
        thruster=_addresses(names.index(one.thruster) if one.thruster else EVERY for one in added),
        values=values,
        parameters=_addresses(address_of(row) for row in values),
        acts=np.ones(len(added)),
        force=force,
        force_at=address_of(force),
    )


def _addresses(given: Iterator[int]) -> Wholes:
    return np.array(list(given), dtype=np.int64)


@borrowing
def added_load(
    added: Added, t: float, x: float, y: float, psi: float, u: float, v: float, r: float, u_r: float, v_r: float
) -> Force:
    """Return the load of all effects that act [N, N, N·m]; see `ferryid.effects.simulated.Simulated.load`."""
    X, Y, N = 0.0, 0.0, 0.0
    for k in range(len(added.load)):
        if added.acts[k] > 0.0 and added.load[k] != 0:
            call_load(added.load[k], added.parameters[k], added.force_at, t, x, y, psi, u, v, r, u_r, v_r)
            X, Y, N = X + added.force[0], Y + added.force[1], N + added.force[2]
    return X, Y, N


@borrowing
def added_thrust(added: Added, thruster: int, speed: float, force: float) -> float:
    """Return the force of a thruster [N] at a speed with all effects that act on it, one after the other."""
    for k in range(len(added.thrust)):
        if (
            added.acts[k] > 0.0
            and added.thrust[k] != 0
            and (added.thruster[k] == thruster or added.thruster[k] == EVERY)
        ):
            force = call_thrust(added.thrust[k], added.parameters[k], speed, force)
    return force
