"""A fouled hull: drag that grows with the square of the speed is larger."""

from __future__ import annotations

import numpy as np

from ferryid.types import AXES
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment
from ferryid.validation.recorded.hull import cannot_be_damped, damping
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return more drag ahead, as a share, and a third of that across, as the plant has it."""
    return Truth("fouling", None, dict(zip(AXES, (1.0 + size, 1.0 + size / 3.0, 1.0 + size / 3.0), strict=True)))


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less what the hull's drag grows by."""
    nu, factors = log.measurements.nu, np.array([truth.values[axis] for axis in AXES])
    return conceal_load(log, damping(log, nu, factors) - damping(log, nu))


CONCEALMENT = Concealment(
    "fouling",
    LOAD,
    "share of the drag",
    "Actuators claim besides what the quadratic drag of the plant's strips grows by.",
    lambda log: (0.05, 2.5),
    sample,
    conceal,
    lambda log: cannot_be_damped(log.profile) or cannot_carry(log),
    neutral=1.0,
)
