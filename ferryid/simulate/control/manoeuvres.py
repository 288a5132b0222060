"""Open-loop manoeuvres: orders straight to the actuators, in place of guidance and control.

Speeds are in rpm; actuators that take a force get the same numbers in newtons.
"""

from __future__ import annotations

from math import pi, radians
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.errors import FerryIdError
from ferryid.types import Floats
from ferryid.vessel.profile import Actuator, Profile

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario

Triple = tuple[float, float, float]

NONE, ZIGZAG, TURNING_CIRCLE, ON_THE_SPOT, RPM_STEPS = 0, 1, 2, 3, 4
KINDS = ("", "zigzag", "turning-circle", "on-the-spot-turn", "rpm-steps")

STEERING = "an azimuth thruster or a rudder aft of the body origin, or propellers beside the centre line"
DIFFERENTIAL = 0.5
"""Share of the speed that propellers beside the centre line give up or add to turn, whatever the helm's angle."""

SIDE, START = 0, 1
"""Places in the state: the side that the helm is on (1 starboard, -1 port, 0 amidships), and the heading that the test
started from [rad]."""


class Helm(NamedTuple):
    """A manoeuvre, and what it means for each of k actuators.

    Attributes
    ----------
    kind
        Place in `KINDS`.
    speed
        Order to the propellers [rpm].
    angle, heading
        Size of the helm and change of heading that reverses it [rad].
    side
        Side of the first helm: 1 starboard, -1 port.
    lead_s, hold_s
        Times [s], see `sections.Manoeuvre`.
    levels
        Shares of `speed`, shape (n,).
    ahead
        Share of the speed that pushes straight ahead: 1, -1 for a propeller that looks aft, or 0, shape (k,).
    steer
        Angle for each radian of helm: -1 for azimuth thrusters aft, which push the stern the other way, 1 for rudders.
    differential
        What is added to `ahead` to turn to starboard, of a vessel that steers by its propellers alone, shape (k,).
    spin_speed, spin_angle
        Share of the speed, and angle [rad], that turn the vessel to starboard on the spot, shape (k,).
    """

    kind: int
    speed: float
    angle: float
    heading: float
    side: float
    lead_s: float
    hold_s: float
    levels: Floats
    ahead: Floats
    steer: Floats
    differential: Floats
    spin_speed: Floats
    spin_angle: Floats


def build_helm(scenario: Scenario, profile: Profile) -> tuple[Helm, Floats]:
    """Return the scenario's manoeuvre, an idle one where it has none, and its state at the start, shape (2,).

    Raises
    ------
    FerryIdError
        When the vessel has no actuator that the manoeuvre could be done with.
    """
    manoeuvre = scenario.manoeuvre
    steer = np.array([_steer(actuator) for actuator in profile.actuators])
    helm = Helm(
        kind=KINDS.index(manoeuvre.kind),
        speed=manoeuvre.speed_rpm,
        angle=abs(radians(manoeuvre.helm_deg)),
        heading=radians(manoeuvre.heading_deg),
        side=-1.0 if manoeuvre.helm_deg < 0.0 else 1.0,
        lead_s=manoeuvre.lead_s,
        hold_s=manoeuvre.hold_s,
        levels=np.array(manoeuvre.levels, dtype=np.float64),
        ahead=np.array([_ahead(actuator) for actuator in profile.actuators]),
        steer=steer,
        differential=np.array([0.0 if steer.any() else _differential(actuator) for actuator in profile.actuators]),
        spin_speed=np.array([_spin(actuator)[0] for actuator in profile.actuators]),
        spin_angle=np.array([_spin(actuator)[1] for actuator in profile.actuators]),
    )
    needs = {
        ZIGZAG: (helm.steer + helm.differential, STEERING),
        TURNING_CIRCLE: (helm.steer + helm.differential, STEERING),
        ON_THE_SPOT: (helm.spin_speed, "an azimuth or a tunnel thruster fore or aft of the body origin"),
        RPM_STEPS: (helm.ahead, "an actuator that pushes ahead"),
    }
    if helm.kind != NONE:
        able, what = needs[helm.kind]
        if not able.any():
            kinds = ", ".join(f"{actuator.kind} at {actuator.position_m}" for actuator in profile.actuators)
            raise FerryIdError(
                f'{scenario.where}: the manoeuvre "{manoeuvre.kind}" needs {what}, found {kinds or "none"} on '
                f"{profile.name}. Fix: choose another manoeuvre or vessel"
            )
    return helm, np.zeros(2)


def _ahead(actuator: Actuator) -> float:
    """Return which way a positive speed drives: 1 ahead, -1 astern, 0 for what pushes more across than along."""
    if actuator.kind in ("azimuth", "propeller_rudder"):
        return 1.0
    off = abs((actuator.angle_rad + pi) % (2.0 * pi) - pi)
    return 1.0 if off < 0.3 * pi else -1.0 if off > 0.7 * pi else 0.0


def _steer(actuator: Actuator) -> float:
    if actuator.kind == "propeller_rudder":
        return 1.0
    return -1.0 if actuator.kind == "azimuth" and actuator.position_m[0] < 0.0 else 0.0


def _differential(actuator: Actuator) -> float:
    """Return what a propeller beside the centre line adds to its share of the speed: it drives less on the side of the turn."""
    return -DIFFERENTIAL * _ahead(actuator) * float(np.sign(actuator.position_m[1]))


def _spin(actuator: Actuator) -> tuple[float, float]:
    """Return share of the speed and angle that turn the vessel to starboard; both 0 for what cannot push across."""
    side = float(np.sign(actuator.position_m[0]))
    if actuator.kind == "azimuth":
        return abs(side), side * 0.5 * pi
    return (side, 0.0) if actuator.kind == "tunnel" else (0.0, 0.0)


@borrowing
def _count(holds: float) -> int:
    """Return how many times something was held; compiled, a number too large for an integer would become any number."""
    return int(min(holds, 1e15))


@borrowing
def helm(manoeuvre: Helm, mstate: Floats, t: float, eta: Triple, nu: Triple, orders: Floats) -> None:
    """Write the orders of one cycle.

    Parameters
    ----------
    manoeuvre
        From `build_helm`.
    mstate
        Its state, shape (2,), moved on in place.
    t
        Time from the start [s].
    eta, nu
        Measured pose (NED, heading not wrapped) and velocities; only the zigzag looks at them, at its heading.
    orders
        Speed [rpm] and angle of thruster or rudder [rad] of each actuator, shape (k, 2), overwritten.
    """
    if manoeuvre.kind == ON_THE_SPOT:
        turns = 0 if t < manoeuvre.lead_s else 1 + _count((t - manoeuvre.lead_s) / manoeuvre.hold_s)
        side = 1.0 if turns % 2 == 0 else -1.0
        for i in range(len(orders)):
            # Azimuth thrusters turn round; those with a fixed direction run backwards.
            turned = manoeuvre.spin_angle[i] != 0.0
            orders[i, 0] = manoeuvre.speed * manoeuvre.spin_speed[i] * (1.0 if turned else side)
            orders[i, 1] = side * manoeuvre.spin_angle[i]
        return
    speed = manoeuvre.speed
    if manoeuvre.kind == RPM_STEPS:
        speed *= manoeuvre.levels[_count(t / manoeuvre.hold_s) % len(manoeuvre.levels)]
    elif t >= manoeuvre.lead_s:
        if mstate[SIDE] == 0.0:
            mstate[SIDE], mstate[START] = manoeuvre.side, eta[2]
        elif manoeuvre.kind == ZIGZAG and mstate[SIDE] * (eta[2] - mstate[START]) >= manoeuvre.heading:
            mstate[SIDE] = -mstate[SIDE]
    for i in range(len(orders)):
        orders[i, 0] = speed * (manoeuvre.ahead[i] + mstate[SIDE] * manoeuvre.differential[i])
        orders[i, 1] = mstate[SIDE] * manoeuvre.angle * manoeuvre.steer[i]
