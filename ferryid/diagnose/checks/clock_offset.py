"""Clock offset within the navigation: positions that are later than velocities, or earlier.

Which of the two is right is not for kinematics to say. Measurements are late rather than early, so the later one is moved;
in a short log by itself neither is, as a guess and an uncertain size would enter all its forces. What the logs of a campaign
show together is corrected in all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding
from ferryid.diagnose.checks.kinematics import LATE, SIZE, kinematics
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.frames import to_body, to_world


def find(measurements: Measurements) -> SensorFinding | None:
    """Return how late the positions are."""
    found = kinematics(measurements)
    if found is None or not found.found(LATE, CHECKS.least_delay_s):
        return None
    late = found.solution.estimate(LATE, "s")
    values = {"seconds": late.value}
    says = says_of(values)
    return SensorFinding(
        "clock_offset",
        {"seconds": late},
        f"{says} It is not corrected in so short a log." if found.short else says,
        (lambda measured: measured) if found.short else lambda measured: corrected(measured, values),
        found.evidence(LATE),
    )


def says_of(values: Mapping[str, float]) -> str:
    """Return which of the two lags, as a sentence."""
    late = values["seconds"]
    lagging, leading = ("Position", "velocity") if late > 0.0 else ("Velocity", "position")
    return f"{lagging} lags {leading} by {abs(late):.2f} s."


def corrected(measured: Measurements, values: Mapping[str, float]) -> Measurements:
    """Return measurements whose later clock is moved."""
    late = values["seconds"]
    when = measured.t + abs(late)
    inside = np.interp(when, measured.t, measured.usable.astype(np.float64), left=0.0, right=0.0) >= 1.0
    usable = measured.usable & inside
    if late > 0.0:
        return replace(
            measured, eta=np.column_stack([_at(when, measured, measured.eta[:, :2]), measured.psi]), usable=usable
        )
    moved = (_earlier(when, measured, nu) for nu in (measured.nu_raw, measured.nu))
    return replace(measured, nu_raw=next(moved), nu=next(moved), usable=usable)


def _at(when: Floats, measured: Measurements, values: Floats) -> Floats:
    known = measured.usable
    return np.column_stack([np.interp(when, measured.t[known], column[known]) for column in values.T])


def _earlier(when: Floats, measured: Measurements, nu: Floats) -> Floats:
    """Return velocities, yaw rate excepted, of a later row; what is late is the velocity over ground."""
    over_ground = _at(when, measured, np.column_stack(to_world(nu[:, 0], nu[:, 1], measured.psi)))
    return np.column_stack([*to_body(over_ground[:, 0], over_ground[:, 1], measured.psi), nu[:, 2]])


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the offset however small; see `find`."""
    found = kinematics(measurements, (LATE,))
    return {} if found is None else {"seconds": found.solution.estimate(LATE, "s")}


CHECK = Check(
    "clock_offset",
    "Clocks of position and velocity",
    find,
    30,
    estimate,
    Lasting(0.0, float(SIZE[LATE]), lambda _: CHECKS.least_delay_s, says_of, corrected, of_instrument=False),
)
