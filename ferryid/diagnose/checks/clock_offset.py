"""Clock offset within the navigation: positions that are later than velocities, or earlier."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.kinematics import LATE, kinematics
from ferryid.effects.picture import Scene

LEAST_S = 0.1


def find(scene: Scene) -> SensorFinding | None:
    """Return how late the positions are."""
    found = kinematics(scene)
    if found is None or not found.found(LATE, LEAST_S):
        return None
    late = found.solution.estimate(LATE, "s")
    word = "later" if late.value > 0.0 else "earlier"

    def correct(seen: Scene) -> Scene:
        when = seen.t + late.value
        eta, usable = seen.eta.copy(), seen.usable
        for k in (0, 1):
            eta[:, k] = np.interp(when, seen.t[usable], seen.eta[usable, k])
        inside = np.interp(when, seen.t, usable.astype(np.float64), left=0.0, right=0.0) >= 1.0
        return replace(seen, eta=eta, usable=usable & inside)

    return SensorFinding(
        "clock_offset",
        {"seconds": late},
        f"The positions are {abs(late.value):.2f} s {word} than the velocities.",
        correct,
        found.evidence(LATE),
    )


CHECK = Check("clock_offset", "Clocks of position and velocity", find, place=30)
