"""A heading with a constant error, by which the reported velocity is turned as well."""

from __future__ import annotations

from math import cos, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from ferryid.types import Floats
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection, random_sign
from ferryid.validation.plant.plant import Plant
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.effects.force_model import Measurements
    from ferryid.validation.oracle_sensors import SensorEstimate


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return a heading that is off [deg]."""
    angle = size * random_sign(rng)
    return injection("heading_bias", {"angle": angle}, {"heading_bias_deg": angle})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Report a heading that is too large [deg]."""
    bias = radians(conditions["heading_bias_deg"])
    if bias == 0.0:
        return

    def report(pose: Floats) -> None:
        u, v = pose[3], pose[4]
        pose[2] += bias
        pose[3] = cos(bias) * u + sin(bias) * v
        pose[4] = cos(bias) * v - sin(bias) * u

    plant.reports.append(report)


def oracle(measurements: Measurements) -> SensorEstimate:
    """Return the estimate of a heading bias from kinematics."""
    from dataclasses import replace
    from math import degrees

    from ferryid.diagnose.checks.kinematics import ANGLE, kinematics
    from ferryid.diagnose.checks.thresholds import CHECKS
    from ferryid.validation.oracle_sensors import SensorEstimate, kinematic_gain

    found = kinematics(measurements, (ANGLE,))
    if found is None:
        return SensorEstimate(0.0, 1)
    bias = np.array([0.0, 0.0, float(found.solution.values[ANGLE])])
    return SensorEstimate(
        kinematic_gain(found, ANGLE),
        1,
        {"angle": found.solution.estimate(ANGLE, "deg", degrees(1.0))},
        lambda seen: replace(seen, eta=seen.eta - bias),
        abs(bias[2]) < radians(CHECKS.least_angle_deg),
    )


EFFECT = PlantEffect(
    "heading_bias",
    "deg",
    (0.1, 12.0),
    4.0,
    sample,
    rank=17,
    settings={"heading_bias_deg": 0.0},
    act=act,
    oracle=oracle,
)
