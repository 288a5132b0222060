"""Navigation whose point of reference is not where the profile has it."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np

from ferryid.types import Floats
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection, random_vector
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.effects.force_model import Measurements
    from ferryid.validation.oracle_sensors import SensorEstimate


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a lever arm of a length [m]."""
    x, y = random_vector(size, rng)
    return injection("lever_arm", {"x": x, "y": y}, {"lever_m": (x, y)})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Report the motion of another point, forward and to starboard [m]."""
    forward, starboard = conditions["lever_m"]
    if forward == starboard == 0.0:
        return

    def report(pose: Floats) -> None:
        c, s = cos(pose[2]), sin(pose[2])
        pose[0] += c * forward - s * starboard
        pose[1] += s * forward + c * starboard
        pose[3] -= pose[5] * starboard
        pose[4] += pose[5] * forward

    plant.reports.append(report)


def oracle(measurements: Measurements) -> SensorEstimate:
    """Return the estimate of a lever arm from kinematics."""
    from dataclasses import replace

    from ferryid.diagnose.checks.kinematics import X, Y, kinematics
    from ferryid.diagnose.checks.lever_arm import least_m
    from ferryid.validation.oracle_sensors import SensorEstimate, kinematic_gain
    from ferryid.vessel.frames import to_world

    found = kinematics(measurements, (X, Y))
    if found is None:
        return SensorEstimate(0.0, 2)
    x, y = found.solution.estimate(X, "m"), found.solution.estimate(Y, "m")

    def correct(seen: Measurements) -> Measurements:
        one = np.ones(len(seen.t))
        arm = np.column_stack([*to_world(x.value * one, y.value * one, seen.psi), 0.0 * one])
        return replace(seen, eta=seen.eta - arm)

    # Either is determined by turns of its own, so that their errors are hardly correlated.
    idle = max(abs(x.value), abs(y.value)) < least_m(measurements)
    return SensorEstimate(kinematic_gain(found, X) + kinematic_gain(found, Y), 2, {"x": x, "y": y}, correct, idle)


EFFECT = PlantEffect(
    "lever_arm",
    "m",
    (0.01, 1.5),
    0.6,
    sample,
    rank=16,
    settings={"lever_m": (0.0, 0.0)},
    act=act,
    oracle=oracle,
)
