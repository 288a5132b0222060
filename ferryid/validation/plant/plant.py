"""A vessel in the conditions of one trial, as the effects have set it up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Any
from zlib import crc32

import numpy as np

from ferryid.types import Floats
from ferryid.validation.plant.air import air_constants
from ferryid.validation.plant.effects import Conditions, plant_effects
from ferryid.validation.plant.effects.mooring import NO_LINE
from ferryid.validation.plant.effects.payload import NOTHING
from ferryid.validation.plant.effects.shallow_water import DEEP_WATER
from ferryid.validation.plant.hull import hull_constants
from ferryid.validation.plant.motion import World
from ferryid.validation.plant.thrusters import thruster_constants
from ferryid.validation.plant.vessels import Vessel

Load = Callable[[float, Floats, Floats], None]
"""``load(t, y, out)`` writes a load [N, N·m], shape (6,), at a time [s] and the states of the body, shape (12 + 6 k,)."""
Report = Callable[[Floats], None]
"""``report(pose)`` changes what the navigation reports: north, east, heading, surge, sway, yaw rate, shape (6,)."""
Encoder = Callable[[Floats], Floats]
"""``encoder(angle)`` returns what is read of the angles of a thruster [rad], shape (n,)."""


@dataclass
class Plant:
    """A vessel in the conditions of a trial.

    Attributes
    ----------
    vessel
        The vessel.
    t
        Times of the trial [s], shape (n,).
    world
        Constants of everything that acts within a step of the integration.
    air, water
        Velocity of air and water over ground, north and east [m/s], shape (n, 2).
    delay_s
        How late the navigation is [s].
    loads
        Loads from outside by effect, evaluated at every sample and constant until the next.
    reports
        Errors of the navigation, in the order in which they are applied.
    encoders
        Errors of the azimuth encoders, in that order.
    """

    vessel: Vessel
    t: Floats
    world: World
    air: Floats
    water: Floats
    delay_s: float = 0.0
    loads: dict[str, Load] = field(default_factory=dict)
    reports: list[Report] = field(default_factory=list)
    encoders: list[Encoder] = field(default_factory=list)

    def by_thruster(self, values: Mapping[str, float], default: float) -> Floats:
        """Return values by name of a thruster in the order of the thrusters, shape (k,)."""
        return np.array([values.get(one.name, default) for one in self.vessel.thrusters])

    def set_thrusters(self, **constants: Any) -> None:
        """Change constants of the thrusters: see `ferryid.validation.plant.thrusters.ThrusterConstants`."""
        self.world = self.world._replace(thrusters=self.world.thrusters._replace(**constants))


def build_plant(vessel: Vessel, t: Floats, conditions: Conditions, seed: int) -> Plant:
    """Return a vessel with every effect in it.

    Parameters
    ----------
    vessel
        Of `ferryid.validation.plant.vessels`.
    t
        Times of the trial [s], shape (n,).
    conditions
        Settings of all effects.
    seed
        Of the trial: each effect has a random stream of its own.
    """
    world = World(
        hull_constants(vessel), air_constants(vessel), thruster_constants(vessel), NOTHING, NO_LINE, DEEP_WATER
    )
    plant = Plant(vessel, t, world, np.zeros((len(t), 2)), np.zeros((len(t), 2)))
    for effect in plant_effects().values():
        if effect.act is not None:
            stream = crc32(effect.id.encode()) if effect.stream is None else effect.stream
            effect.act(plant, conditions, np.random.default_rng([seed, stream]))
    return plant


def wrapped(angle: Floats) -> Floats:
    """Return angles [rad] within (-pi, pi]."""
    return np.asarray(pi - np.mod(pi - angle, 2.0 * pi))
