"""Force of every actuator over its speed, and back, as tables: the same cost and the same code for every kind of curve."""

from __future__ import annotations

from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.errors import FerryIdError
from ferryid.types import Floats, Ints
from ferryid.vessel.profile import Actuator, Profile, ThrustCurve
from ferryid.vessel.thrusters import FRESH_WATER, thrust

NODES = 4001
"""Nodes from rest to either end of a curve's range; linear in between."""


class Curves(NamedTuple):
    """Bollard force of k actuators on the hull, all units of one actuator together and thrust deduction taken off.

    `direct` is 1 for an actuator whose order is a force; the rest of its row has no meaning. `low` and `high` end the range
    of speeds [rpm], `forces` holds the force at NODES speeds from 0 to `high` (first half) and from 0 to `low` (second),
    `reach` the largest force up to each node (astern with its sign turned), which never falls: what `speed_for` searches.
    """

    direct: Ints
    low: Floats
    high: Floats
    forces: Floats
    reach: Floats


def curves_of(profile: Profile) -> Curves:
    """Tabulate the thrust curves of a profile's actuators, in their order.

    Raises
    ------
    FerryIdError
        When an actuator other than a direct force has no thrust curve, or one without an end.
    """
    k = len(profile.actuators)
    direct = np.zeros(k, dtype=np.int64)
    low, high = np.zeros(k), np.zeros(k)
    forces, reach = np.zeros((k, 2, NODES)), np.zeros((k, 2, NODES))
    for i, actuator in enumerate(profile.actuators):
        if actuator.kind == "force":
            direct[i] = 1
            low[i], high[i] = -np.inf, np.inf
            continue
        curve = _curve(profile, actuator)
        rpm = 60.0 if curve.input_unit == "rps" else 1.0
        low[i], high[i] = rpm * curve.valid[0], rpm * curve.valid[1]
        share = actuator.count * (1.0 - actuator.inflow.get("thrust_deduction", 0.0))
        diameter_m = actuator.inflow.get("diameter_m", nan)
        density = actuator.inflow.get("water_density", FRESH_WATER)
        for side, end in enumerate((high[i], low[i])):
            speeds = end * np.arange(NODES) / (NODES - 1)
            forces[i, side] = share * thrust(curve, speeds, diameter_m=diameter_m, water_density=density)[0]
            reach[i, side] = np.maximum.accumulate(np.maximum((1.0 - 2.0 * side) * forces[i, side], 0.0))
    return Curves(direct, low, high, forces, reach)


def _curve(profile: Profile, actuator: Actuator) -> ThrustCurve:
    curve = actuator.thrust
    if curve is None:
        raise FerryIdError(
            f"{profile.name}: the simulator needs the thrust curve of {actuator.name}, found none. "
            "Fix: add thrust = {...} to the actuator"
        )
    if not (isfinite(curve.valid[0]) and isfinite(curve.valid[1])):
        raise FerryIdError(
            f"{profile.name}: the simulator needs to know how fast {actuator.name} can turn, found no limit in its thrust "
            f'curve. Fix: name a profile in the scenario (vessel = "FILE") that has valid = [lowest, highest] '
            f"[{curve.input_unit}] below [actuator.thrust] of {actuator.name}, under the same name; ferryid vessel show "
            f"{profile.name} --toml prints a bundled one to add it to. A model takes the limits from there, without another "
            "diagnosis"
        )
    if curve.kind == "open_water" and "diameter_m" not in actuator.inflow:
        raise FerryIdError(
            f"{profile.name}: the open-water curve of {actuator.name} needs the propeller's diameter, found none. "
            "Fix: add diameter_m = ... to the actuator"
        )
    return curve


@borrowing
def force_at(curves: Curves, k: int, speed: float) -> float:
    """Return the bollard force [N] of actuator k at a speed [rpm]; beyond the range that of its end."""
    if curves.direct[k]:
        return speed
    side = 0 if speed >= 0.0 else 1
    end = curves.high[k] if speed >= 0.0 else curves.low[k]
    if end == 0.0:
        return 0.0
    place = speed / end * (NODES - 1)
    if place >= NODES - 1:
        return float(curves.forces[k, side, NODES - 1])
    node = int(place)
    share = place - node
    return float(curves.forces[k, side, node] * (1.0 - share) + curves.forces[k, side, node + 1] * share)


@borrowing
def speed_for(curves: Curves, k: int, force: float) -> float:
    """Return the speed [rpm] of actuator k, of the force's sign, that gives a force [N]; out of reach, that of the largest."""
    if curves.direct[k]:
        return force
    side = 0 if force >= 0.0 else 1
    end = curves.high[k] if force >= 0.0 else curves.low[k]
    size = abs(force)
    reach = curves.reach[k, side]
    if size == 0.0 or reach[NODES - 1] <= 0.0:
        return 0.0
    low, high = 0, NODES - 1
    if size >= reach[high]:
        # The first node that gives the largest force: where the curve falls again behind it, faster is not stronger.
        size = reach[high]
    while high - low > 1:
        middle = (low + high) // 2
        if reach[middle] < size:
            low = middle
        else:
            high = middle
    share = (size - reach[low]) / (reach[high] - reach[low])
    return float(end * ((low + share) / (NODES - 1)))


@borrowing
def largest_force(curves: Curves, k: int, ahead: bool) -> float:
    """Return the largest force [N] of actuator k ahead or astern, without its sign; infinite for a direct force."""
    if curves.direct[k]:
        return np.inf
    return float(curves.reach[k, 0 if ahead else 1, NODES - 1])
