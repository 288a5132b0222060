"""Effects of the library that act on the plant, called by the addresses of what their own files say of it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.effects import effects
from ferryid.effects.native import address_of, call_load, call_thrust, load_address, thrust_address
from ferryid.simulate.added_effects import AddedEffect
from ferryid.simulate.plant.hull import Force
from ferryid.types import Floats, Ints
from ferryid.vessel.profile import Profile

EVERY = -1
"""In the place of a thruster: each of them."""


class Added(NamedTuple):
    """Q effects for compiled code.

    `load` and `thrust` (Q,) are addresses of functions, 0 for none, `thruster` (Q,) says on which a change of thrust acts,
    `values` (Q, m) are their parameters and constants, and `parameters` (Q,) the addresses of its rows. Written anew are `acts`
    (Q,), 1 for those that act in the present step, and `force` (3,) at the address `force_at`, by every load.
    """

    load: Ints
    thrust: Ints
    thruster: Ints
    values: Floats
    parameters: Ints
    acts: Floats
    force: Floats
    force_at: int


def build_added(added: tuple[AddedEffect, ...], profile: Profile) -> Added:
    """Return effects for compiled code; a parameter that is not given is neutral."""
    names = [actuator.name for actuator in profile.actuators]
    parameters = [effects()[one.effect].parameters_of(profile) for one in added]
    hooks = [effects()[one.effect].simulated for one in added]
    every = [
        [
            *(one.values.get(each.name, each.neutral) for each in own),
            *(hook.constants(profile, one.thruster) if hook else ()),
        ]
        for one, own, hook in zip(added, parameters, hooks, strict=True)
    ]
    values = np.zeros((len(added), max(map(len, every), default=0)))
    for row, numbers in zip(values, every, strict=True):
        row[: len(numbers)] = numbers
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


def _addresses(given: Iterable[int]) -> Ints:
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
