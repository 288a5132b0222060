"""Navigation that is late: its rows are stamped later, or stand beside actuators of a later row in one table."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.lateness import cannot_be_late, late, possible_delay_s
from ferryid.validation.recorded.log import NAVIGATION, RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a delay [s]."""
    return Truth("time_delay", None, {"seconds": possible_delay_s(log, NAVIGATION, size)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the navigation be late."""
    return Concealed(late(log, NAVIGATION, truth.values["seconds"]))


def earlier(log: RecordedLog, truth: Truth) -> Floats:
    """Return the forces beside a navigation that is late: those of a later time."""
    measured = log.measurements
    at, n = measured.t + truth.values["seconds"], len(measured.t)
    columns = [np.interp(at, measured.t, one) for one in measured.parts.reshape(n, -1).T]
    return np.column_stack(columns).reshape(measured.parts.shape)


CONCEALMENT = Concealment(
    "time_delay",
    SENSOR,
    "s",
    "Positions, heading and velocities are stamped later; in one table with the actuators, by whole rows.",
    lambda log: (possible_delay_s(log, NAVIGATION, 0.05), 2.0),
    sample,
    conceal,
    lambda log: cannot_be_late(log, NAVIGATION),
    parts=earlier,
)
