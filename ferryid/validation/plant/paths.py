"""Where a vessel goes: set points, one after the other, drawn at random."""

from __future__ import annotations

from math import atan2, cos, pi, radians, sin

import numpy as np

from ferryid.types import Floats
from ferryid.validation.plant.vessels import Vessel

DWELL_S = 45.0
PATHS = {"calibration": 16, "short": 7, "crossings": 16}
"""Names of paths, and how many set points each has."""
TURNS_DEG = (45.0, 90.0, 135.0, 180.0)


def duration_s(path: str) -> float:
    """Return how long a path takes [s]."""
    return PATHS[path] * DWELL_S


def set_points(path: str, vessel: Vessel, rng: np.random.Generator) -> Floats:
    """Return set points from rest at the origin: north, east [m] and heading [rad], unwrapped, shape (k, 3).

    ``calibration`` and ``short`` go ahead, aside and astern, turn on the spot, and do all at once, in an order drawn at random;
    ``crossings`` go to and fro between two quays with the bow ahead, as a ferry does.
    """
    return _crossings(vessel, rng) if path == "crossings" else _calibration(PATHS[path], vessel, rng)


def _calibration(count: int, vessel: Vessel, rng: np.random.Generator) -> Floats:
    kinds = np.concatenate([rng.permutation(["ahead", "aside", "turn", "all"]) for _ in range(count // 4 + 1)])
    pose, made = np.zeros(3), []
    for kind in kinds[:count]:
        pose = pose.copy()
        if kind in ("ahead", "aside", "all"):
            way = pose[2] + {"ahead": 0.0, "aside": 0.5 * pi, "all": 0.25 * pi}[str(kind)]
            leg = vessel.leg_m * rng.uniform(0.7, 1.1)
            # Of the two ways the one that stays near the middle.
            steps = [sign * leg * np.array([cos(way), sin(way)]) for sign in (1.0, -1.0)]
            pose[:2] += min(steps, key=lambda step: float(np.hypot(*(pose[:2] + step)) + 0.3 * leg * rng.random()))
        if kind in ("turn", "all"):
            pose[2] += float(rng.choice([-1.0, 1.0])) * radians(float(rng.choice(TURNS_DEG)))
        made.append(pose)
    return np.array(made)


def _crossings(vessel: Vessel, rng: np.random.Generator) -> Floats:
    way = rng.uniform(0.0, 2.0 * pi)
    there = 2.2 * vessel.leg_m * np.array([cos(way), sin(way)])
    made, place, heading = [], np.zeros(2), 0.0
    for number in range(PATHS["crossings"] // 2):
        goal = there if number % 2 == 0 else np.zeros(2)
        step = goal - place
        turn = atan2(step[1], step[0]) - heading
        heading += turn - 2.0 * pi * np.floor((turn + pi) / (2.0 * pi))
        made += [[*place, heading], [*goal, heading]]
        place = goal
    return np.array(made)
