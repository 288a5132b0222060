"""Azimuth encoders of a coarse step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ferryid.types import Floats
from ferryid.validation.plant.effects.effect import Conditions, Injection, PlantEffect, Span, injection
from ferryid.validation.plant.plant import Plant, wrapped
from ferryid.validation.plant.vessels import Vessel

if TYPE_CHECKING:
    from ferryid.effects.force_model import Measurements
    from ferryid.validation.oracle_sensors import SensorEstimate

CHANCE = 0.02
"""Share of the readings of an angle that is not rounded which are within a hundredth of a step off any grid."""
LEAST_OFF = 1e-12
"""Least share of readings off a grid, so that logarithms stay finite."""


def sample(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Injection:
    """Return encoders of a step [deg]."""
    return injection("azimuth_resolution", {"step": size}, {"azimuth_step_deg": size})


def act(plant: Plant, conditions: Conditions, rng: np.random.Generator) -> None:
    """Round the angles that the encoders read to a step [deg]."""
    if conditions["azimuth_step_deg"] > 0.0:
        step = float(np.radians(conditions["azimuth_step_deg"]))

        def rounded(angle: Floats) -> Floats:
            # An encoder counts from its own zero once round, whatever turns there were before.
            return np.asarray(step * np.round(wrapped(angle) / step))

        plant.encoders.append(rounded)


def oracle(measurements: Measurements) -> SensorEstimate:
    """Return the step of the coarsest angle; the gain is that of its readings' being on a grid over being anywhere."""
    from math import log

    from ferryid.diagnose.checks.azimuth_resolution import corrected, error_of, estimate, off_grid, step_of
    from ferryid.diagnose.checks.thresholds import CHECKS
    from ferryid.validation.oracle_sensors import SensorEstimate

    steps = [step_of(angle) for angle in measurements.angles.T]
    step = max(steps, default=0.0)
    if step == 0.0:
        return SensorEstimate(0.0, 1)
    readings = np.degrees(np.unique(np.round(measurements.angles[:, steps.index(step)], 9)))
    off = off_grid(readings, step)
    count, near = len(readings), int(np.count_nonzero(off < 0.5 * CHANCE * step))
    share = min(max(near / count, CHANCE), 1.0 - LEAST_OFF)
    gain = near * log(share / CHANCE) + (count - near) * log((1.0 - share) / (1.0 - CHANCE))
    idle = error_of(step) < CHECKS.least_azimuth_error
    return SensorEstimate(gain, 1, {"step": estimate(step)}, lambda seen: corrected(seen, steps), idle)


EFFECT = PlantEffect(
    "azimuth_resolution",
    "deg",
    (0.3, 20.0),
    8.0,
    sample,
    rank=9,
    settings={"azimuth_step_deg": 0.0},
    act=act,
    oracle=oracle,
)
