"""Waves: a narrow band of forces along the vessel's axes."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment, length_of
from ferryid.validation.recorded.log import RecordedLog

COMPONENTS = 45
WIDTH = 0.12
"""Standard deviation of the spectrum about its peak, as a share of the peak's frequency."""
PERIOD = 1.15
"""Period of the peak over the root of the vessel's length [s/m^½]: the middle of those of the plant."""
ARM = 0.2
"""Moment over force, as a share of the length."""
NAMES = ("peak_frequency", "force_std", "moment_std")


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return waves whose force is a share of the actuators' (root mean square)."""
    length = length_of(log)
    force = size * float(np.sqrt(np.mean(log.measurements.parts.sum(axis=1)[:, :2] ** 2)))
    return Truth(
        "waves", None, dict(zip(NAMES, (1.0 / (PERIOD * length**0.5), force, ARM * length * force), strict=True))
    )


def series(t: Floats, peak_hz: float, rng: np.random.Generator) -> Floats:
    """Return a narrow band of unit standard deviation by components of random phase (Rice 1944), shape (n,)."""
    f = peak_hz * (1.0 + WIDTH * rng.standard_normal(COMPONENTS))
    phase = rng.uniform(0.0, 2.0 * np.pi, COMPONENTS)
    made = np.cos(2.0 * np.pi * t[:, None] * f + phase).sum(axis=1)
    return np.asarray(made / made.std())


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less the waves' forces."""
    peak, force, moment = (truth.values[name] for name in NAMES)
    t = log.measurements.t
    return conceal_load(log, np.column_stack([std * series(t, peak, rng) for std in (force, force, moment)]))


CONCEALMENT = Concealment(
    "waves",
    LOAD,
    "share of the actuators' force",
    "Actuators claim less by a narrow band of random forces along all axes.",
    lambda log: (0.05, 2.0),
    sample,
    conceal,
    cannot_carry,
)
