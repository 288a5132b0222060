"""What an effect does to the simulated vessel: a load on its hull, or a change of its thrusters' force.

Both are plain functions of numbers in the effect's own file; `ferryid.effects.native` compiles them for the simulator.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ferryid.effects.effect import Values
    from ferryid.vessel.profile import Profile

Load = Callable[..., tuple[float, float, float]]
Thrust = Callable[[Any, float, float], float]


@dataclass(frozen=True)
class Simulated:
    """How the simulator lets an effect act; `p` has one value per parameter of the effect, in their order.

    Attributes
    ----------
    load
        ``load(p, t, x, y, psi, u, v, r, u_r, v_r)`` returns the force on the hull [N, N, N·m] at a time [s], a place north and
        east [m] and a heading [rad], at velocities over ground [m/s, m/s, rad/s] and, of surge and sway, through the water.
    thrust
        ``thrust(p, speed, force)`` returns the force of a thruster [N] in place of what its curve gives at a speed [rpm; N for
        one that is ordered directly]. An effect of one thruster acts on that one, one of the whole vessel on each.
    constants
        ``constants(profile, thruster)`` returns what else `p` ends with, by the vessel and the thruster it is an effect of.
    lacks
        Names of parameters that the simulated vessel does not have, and no scenario can give: it is as if they were neutral.
    """

    load: Load | None = None
    thrust: Thrust | None = None
    constants: Callable[[Profile, str], tuple[float, ...]] = lambda profile, thruster: ()
    lacks: frozenset[str] = frozenset()


def entry(effect: str, values: Values, instance: str | None) -> dict[str, Any]:
    """Return what has to stand in a scenario file for an effect to act: an entry of ``[[effects]]``.

    Parameters
    ----------
    effect, instance
        Id of the effect, and the thruster it is one of.
    values
        Its parameters by name, with ``onset`` and ``offset`` [s] if it has them.
    """
    keys = {"onset": "from_s", "offset": "until_s"}
    whose = {} if instance is None else {"thruster": instance}
    return {"effects": [{"effect": effect, **whose, **{keys.get(name, name): value for name, value in values.items()}}]}
