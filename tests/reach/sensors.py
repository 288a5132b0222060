"""Mistakes of sensors that motion alone can show, as the scenario language or a mistaken profile can make them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, pi, sin
from typing import Any

import numpy as np

from tests.reach.draw import Truth

KNOT = 0.514444


@dataclass(frozen=True)
class Mistake:
    """One mistake: what ought to be named, what stands in the scenario, and what is done to the profile."""

    truth: Truth
    tables: dict[str, Any] = field(default_factory=dict)
    profile: str = ""
    size: tuple[float, ...] = ()


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    return round(float(rng.uniform(low, high) * rng.choice([-1.0, 1.0])), 4)


def yaw_rate_scale(rng: np.random.Generator) -> Mistake:
    """Return a gyro that reads too much or too little."""
    factor = 1.0 + _either(rng, 0.04, 0.15)
    return Mistake(
        Truth("yaw_rate_scale", None, {"factor": factor}), {"sensors": {"navigation": {"yaw_rate_factor": factor}}}
    )


def thruster_clock(rng: np.random.Generator) -> Mistake:
    """Return thrusters whose clock is off."""
    seconds = _either(rng, 0.2, 0.5)
    # A clock of theirs that is ahead makes the navigation early.
    return Mistake(
        Truth("time_delay", None, {"seconds": -seconds}), {"sensors": {"thruster_clock_offset_ms": 1000.0 * seconds}}
    )


def velocity_unit(rng: np.random.Generator) -> Mistake:
    """Return velocities in m/s that are taken for knots."""
    return Mistake(Truth("velocity_scale", None, {"factor": KNOT}), profile="velocity unit")


def yaw_sign(rng: np.random.Generator) -> Mistake:
    """Return a yaw rate of the wrong sign."""
    return Mistake(Truth("yaw_rate_scale", None, {"factor": -1.0}), profile="yaw sign")


def position_mount(rng: np.random.Generator) -> Mistake:
    """Return positions of another point than velocities."""
    angle, length = rng.uniform(0.0, 2.0 * pi), rng.uniform(0.5, 1.5)
    x, y = round(float(length * cos(angle)), 3), round(float(length * sin(angle)), 3)
    return Mistake(Truth("lever_arm", None, {"x": x, "y": y}), profile="position mount", size=(x, y))


SENSORS: dict[str, tuple[str, Callable[[np.random.Generator], Mistake]]] = {
    "gyro scale": ("yaw rate 4 to 15 % off", yaw_rate_scale),
    "thrusters' clock": ("thrusters' clock 0.2 to 0.5 s off", thruster_clock),
    "velocity unit": ("velocities in m/s taken for knots", velocity_unit),
    "yaw-rate sign": ("yaw rate of the wrong sign", yaw_sign),
    "position mount": ("positions alone 0.5 to 1.5 m off", position_mount),
}
"""By cell: title, and what is drawn."""
