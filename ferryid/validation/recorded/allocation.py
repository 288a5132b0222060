"""A load put on the records: actuators claim what acted less the load, shared among them by least norm.

With `tau` the force that all actuators applied and `L` a load on the measured motion, records that claim ``tau - L`` leave the
motion to be explained by ``tau - L`` and the load together. What each claims besides is the solution of least norm of
``B f = -L``, where the columns of `B` are the directions in which an actuator can push at any time: both along the vessel's
axes for one that turns, its own for one that is built in. A rudder takes no part.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from ferryid.types import Flags, Floats
from ferryid.validation.recorded.drives import (
    Drive,
    angle_at,
    drives,
    force_at,
    record_of,
    sparse,
    thrust_of,
    times_of,
)
from ferryid.validation.recorded.effects.effect import Concealed, length_of
from ferryid.validation.recorded.log import RecordedLog
from ferryid.vessel.frames import wrap

LEFT = 0.02
"""Share of a load in a row that may stay without an actuator for it."""
NOTHING = 1e-3
"""Share of the load's root mean square below which a row carries none."""


@dataclass(frozen=True, eq=False)
class Effectiveness:
    """What actuators can push.

    Attributes
    ----------
    columns
        Force on the hull by a unit of each push, shape (3, m) [1, 1, m].
    pushes
        Name of the actuator and axis, 0 or 1 of the vessel's for one that turns, -1 for its own direction, of each column.
    """

    columns: Floats
    pushes: tuple[tuple[str, int], ...]


def effectiveness(log: RecordedLog) -> Effectiveness:
    """Return what the actuators of a recording can push."""
    columns, pushes = [], []
    for name, drive in drives(log).items():
        x, y = drive.actuator.position_m
        angle = drive.actuator.angle_rad
        ways = [(1.0, 0.0), (0.0, 1.0)] if drive.turn else [(np.cos(angle), np.sin(angle))]
        for axis, (c, s) in enumerate(ways):
            columns.append((c, s, x * s - y * c))
            pushes.append((name, axis if drive.turn else -1))
    return Effectiveness(np.array(columns).T, tuple(pushes))


def cannot_carry(log: RecordedLog) -> str:
    """Return why the records of a log cannot carry a load, as the end of a sentence; empty where they can."""
    slow = [name for name, drive in drives(log).items() if sparse(log, drive)]
    if slow:
        return f"the record of {slow[0]} has fewer than a row a second"
    columns = effectiveness(log).columns / np.array([1.0, 1.0, length_of(log)])[:, None]
    left = np.eye(3) - columns @ np.linalg.pinv(columns)
    lacking = [name for k, name in enumerate(("surge", "sway", "yaw")) if np.linalg.norm(left[k]) > 1e-6]
    return f"its actuators cannot push freely in {' and '.join(lacking)}" if lacking else ""


def conceal_load(log: RecordedLog, load: Floats) -> Concealed:
    """Return a recording whose actuators claim what acted less a load.

    Parameters
    ----------
    log
        The recording.
    load
        On the hull, on the rows of its measurements [N, N, N·m], shape (n, 3).
    """
    can = effectiveness(log)
    share = -load @ np.linalg.pinv(can.columns).T
    scale = np.array([1.0, 1.0, length_of(log)])
    lacking = np.linalg.norm((share @ can.columns.T + load) / scale, axis=1)
    wanted = np.linalg.norm(load / scale, axis=1)
    usual = float(np.sqrt(np.mean(wanted**2)))
    lost = (lacking > LEFT * wanted) & (wanted > NOTHING * usual)
    t, records, missed, rows = log.measurements.t, dict[str, Floats](), 0, 0
    for name, drive in drives(log).items():
        mine = [k for k, (one, _) in enumerate(can.pushes) if one == name]
        more = share[:, mine]
        if drive.turn:
            made, beyond = _turning(log, drive, t, more)
            records |= made
        else:
            at = times_of(log, drive)
            wanted_thrust = thrust_of(log, drive) + np.interp(at, t, more[:, 0]) / drive.per_thrust
            records[drive.column], beyond = record_of(log, drive, wanted_thrust)
        inside = (times_of(log, drive) >= t[0]) & (times_of(log, drive) <= t[-1])
        missed, rows = missed + int((beyond & inside).sum()), rows + int(inside.sum())
    share_lost, share_beyond = float(np.mean(lost)), missed / max(rows, 1)
    why = "the thrust curves end below it" if share_beyond >= share_lost else "its actuators cannot push that way"
    return Concealed(log.changed(records), max(share_lost, share_beyond), why)


def _turning(log: RecordedLog, drive: Drive, t: Floats, more: Floats) -> tuple[dict[str, Floats], Flags]:
    """Return the records of a thruster that turns and pushes more, shape (n, 2) at times t, and the rows that it cannot."""
    angles = _continuous(force_at(log, drive, t) + more, angle_at(log, drive, t))

    def pushed(at: Floats) -> tuple[Floats, Floats]:
        force = force_at(log, drive, at) + np.column_stack([np.interp(at, t, one) for one in more.T])
        size, ahead = np.hypot(force[:, 0], force[:, 1]), np.arctan2(force[:, 1], force[:, 0])
        near = np.interp(at, t, angles)
        # Of the two ways to push so, the one that the angle on the grid has chosen.
        astern = np.cos(ahead - near) < 0.0
        return np.where(astern, -size, size), np.where(astern, ahead + pi, ahead)

    record, missed = record_of(log, drive, pushed(times_of(log, drive))[0] / drive.per_thrust)
    before = log.columns[drive.turn]
    turned = pushed(log.times(log.topics[drive.turn]))[1]
    angle = np.where(np.isfinite(before), before + wrap(turned - before), before)
    return {drive.column: record, drive.turn: angle}, missed


def _continuous(force: Floats, recorded: Floats) -> Floats:
    """Return angles that give forces, ahead or astern, without a jump from row to row, beginning near a recorded angle."""
    ahead, angles = np.arctan2(force[:, 1], force[:, 0]), np.empty(len(force))
    last = float(recorded[0])
    for k, one in enumerate(ahead.tolist()):
        # Ahead and astern are half a turn apart: the nearest angle modulo half a turn.
        last += float((one - last + 0.5 * pi) % pi - 0.5 * pi)
        angles[k] = last
    return angles
