"""A velocity of another scale, such as a wrong unit."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.checks.kinematics import SCALE
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_sign
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.kinematic_sizes import kinematic_size
from ferryid.validation.recorded.log import RecordedLog

VELOCITY = ("u", "v", "vel_N", "vel_E")


def cannot(log: RecordedLog) -> str:
    """Return why there is nothing to compare a velocity with."""
    return "" if set(VELOCITY) & set(log.topics) and "x" in log.topics else "it has no velocity beside a position"


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a factor that is off by a share."""
    return Truth("velocity_scale", None, {"factor": 1.0 + size * random_sign(rng)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Multiply the velocities."""
    mine = [name for name in VELOCITY if name in log.topics]
    return Concealed(log.changed({name: truth.values["factor"] * log.columns[name] for name in mine}))


CONCEALMENT = Concealment(
    "velocity_scale",
    SENSOR,
    "share of the speed",
    "Velocities over ground are multiplied by a factor; positions stay.",
    lambda log: (0.005, 0.4),
    sample,
    conceal,
    cannot,
    neutral=1.0,
    visible=lambda log: kinematic_size(log.measurements, (SCALE,), CHECKS.least_scale),
)
