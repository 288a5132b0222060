"""The force that the record of an actuator claims, and the record that claims another force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from ferryid.types import Flags, Floats
from ferryid.validation.recorded.log import RecordedLog, usual_step_s
from ferryid.vessel.profile import Actuator
from ferryid.vessel.rudder import inflow_speed
from ferryid.vessel.thrusters import FRESH_WATER, thrust

HALVINGS = 60
"""Of the interval in which the speed of a thrust lies."""
BEYOND = 1.5
"""How far beyond the fastest recorded speed a curve without limits is used, as a factor."""
CLOSE = 1e-6
"""Share of the largest recorded thrust by which a speed may miss the thrust that it is to give."""
SLOWEST_S = 1.0
"""Usual distance of two rows from which on a record does not follow a load that changes with the motion [s]."""


@dataclass(frozen=True)
class Drive:
    """An actuator with the columns of its record.

    Attributes
    ----------
    actuator
        Of the profile.
    role
        ``force``, ``thrust`` or ``speed``: what its strength is recorded as.
    column
        Of its strength.
    turn
        Of its measured angle, empty where it is built in; rudders do not count.
    """

    actuator: Actuator
    role: str
    column: str
    turn: str = ""

    @property
    def per_thrust(self) -> float:
        """Force on the hull by a unit of what is recorded."""
        kept = 1.0 if self.role == "force" else 1.0 - self.actuator.inflow.get("thrust_deduction", 0.0)
        return self.actuator.count * kept


def drives(log: RecordedLog) -> Mapping[str, Drive]:
    """Return the actuators of a recording by name."""
    found = {}
    for actuator in log.profile.actuators:
        roles = {role: column for (name, role), column in log.roles.items() if name == actuator.name}
        role = next(one for one in ("force", "thrust", "speed") if one in roles)
        found[actuator.name] = Drive(actuator, role, roles[role], roles.get("angle", ""))
    return found


def times_of(log: RecordedLog, drive: Drive) -> Floats:
    """Return the times of the rows of a drive's strength [s]."""
    return log.times(log.topics[drive.column])


def thrust_of(log: RecordedLog, drive: Drive) -> Floats:
    """Return the thrust that the record claims, before deduction [N], at the rows of its strength."""
    recorded = log.columns[drive.column]
    return recorded.copy() if drive.role != "speed" else _thrust(log, drive, recorded)


def record_of(log: RecordedLog, drive: Drive, wanted: Floats) -> tuple[Floats, Flags]:
    """Return the record that claims a thrust, and which rows cannot claim it.

    Parameters
    ----------
    log, drive
        Recording and actuator.
    wanted
        Thrust before deduction [N], at the rows of the strength, NaN where none was recorded.

    Returns
    -------
    tuple
        Values of the column of the strength, and True where the thrust curve does not reach the thrust, shape (n,) each.
    """
    recorded = log.columns[drive.column]
    if drive.role != "speed":
        return np.where(np.isfinite(recorded), wanted, recorded), np.zeros(len(wanted), dtype=bool)
    claimed = _thrust(log, drive, recorded)
    curve = drive.actuator.thrust
    assert curve is not None
    rpm = 60.0 if curve.input_unit == "rps" else 1.0
    fastest = BEYOND * float(np.nanmax(np.abs(recorded), initial=0.0))
    most = [rpm * end if isfinite(end) else sign * fastest for sign, end in zip((-1.0, 1.0), curve.valid, strict=True)]
    low = np.where(wanted > 0.0, 0.0, most[0])
    high = np.where(wanted > 0.0, most[1], 0.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        more = _thrust(log, drive, middle) < wanted
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    same = (claimed == wanted) | ~np.isfinite(claimed) | ~np.isfinite(wanted)
    made = np.where(same, recorded, 0.5 * (low + high))
    scale = float(np.nanmax(np.abs(claimed), initial=0.0))
    missed = np.abs(_thrust(log, drive, made) - wanted) > CLOSE * max(scale, 1e-9)
    return made, missed & ~same


def _thrust(log: RecordedLog, drive: Drive, speed: Floats) -> Floats:
    """Return the thrust of speeds [rpm] at the rows of the strength."""
    actuator = drive.actuator
    assert actuator.thrust is not None
    inflow = actuator.inflow
    advance: Floats | float = 0.0
    if actuator.thrust.kind == "open_water":
        _, nu = log.motion_at(times_of(log, drive))
        advance = inflow_speed(nu[:, 0], inflow.get("wake_fraction", 0.0))
    return thrust(
        actuator.thrust,
        speed,
        advance_mps=advance,
        diameter_m=inflow.get("diameter_m", nan),
        water_density=inflow.get("water_density", FRESH_WATER),
    )[0]


def angle_at(log: RecordedLog, drive: Drive, t: Floats) -> Floats:
    """Return the angle of a drive at times [s], as recorded or as built in [rad]."""
    return log.at(drive.turn, t) if drive.turn else np.full(len(t), drive.actuator.angle_rad)


def force_at(log: RecordedLog, drive: Drive, t: Floats) -> Floats:
    """Return the force along the vessel's axes that the record claims at times [s], shape (len(t), 2) [N]."""
    times, strength = times_of(log, drive), drive.per_thrust * thrust_of(log, drive)
    known = np.isfinite(strength)
    push, angle = np.interp(t, times[known], strength[known]), angle_at(log, drive, t)
    return np.column_stack([push * np.cos(angle), push * np.sin(angle)])


def sparse(log: RecordedLog, drive: Drive) -> bool:
    """Return whether the record of a drive is too sparse to follow a load that changes with the motion."""
    return any(usual_step_s(log, log.topics[name]) > SLOWEST_S for name in (drive.column, drive.turn) if name)
