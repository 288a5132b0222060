"""A gyro of another scale."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_sign
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.kinematic_sizes import rate_scale_size
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a factor that is off by a share."""
    return Truth("yaw_rate_scale", None, {"factor": 1.0 + size * random_sign(rng)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Multiply the yaw rate."""
    return Concealed(log.changed({"r": truth.values["factor"] * log.columns["r"]}))


CONCEALMENT = Concealment(
    "yaw_rate_scale",
    SENSOR,
    "share of the rate",
    "The yaw rate is multiplied by a factor; the heading stays.",
    lambda log: (0.005, 0.4),
    sample,
    conceal,
    lambda log: "" if {"r", "psi"} <= set(log.topics) else "it has no yaw rate beside a heading",
    neutral=1.0,
    visible=lambda log: rate_scale_size(log.measurements, CHECKS.least_rate_scale),
)
