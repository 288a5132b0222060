"""A gyro with an error of its scale."""

from __future__ import annotations

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
    """Return a gyro whose scale is off by a share."""
    factor = 1.0 + size * random_sign(rng)
    return injection("yaw_rate_scale", {"factor": factor}, {"yaw_rate_factor": factor})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Multiply the reported yaw rate."""
    factor = conditions["yaw_rate_factor"]
    if factor == 1.0:
        return

    def report(pose: Floats) -> None:
        pose[5] = factor * pose[5]

    plant.reports.append(report)


def oracle(measurements: Measurements) -> SensorEstimate:
    """Return the estimate of the scale of the yaw rate from the reported heading."""
    from ferryid.diagnose.checks.thresholds import CHECKS
    from ferryid.diagnose.checks.yaw_rate_scale import compared, corrected
    from ferryid.validation.oracle_sensors import SensorEstimate, gain_of_score

    rates = compared(measurements)
    if rates is None:
        return SensorEstimate(0.0, 1)
    score = rates.off / max(float(rates.solution.errors[0]), 1e-300)
    factor = rates.solution.estimate(0, "-")
    return SensorEstimate(
        gain_of_score(score, rates.solution.freedom),
        1,
        {"factor": factor},
        lambda seen: corrected(seen, factor.value),
        rates.off < CHECKS.least_rate_scale,
    )


EFFECT = PlantEffect(
    "yaw_rate_scale",
    "share",
    (0.003, 0.25),
    0.08,
    sample,
    rank=18,
    settings={"yaw_rate_factor": 1.0},
    act=act,
    oracle=oracle,
    neutral=1.0,
)
