"""Positions that are later than velocities."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.checks.kinematics import LATE
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.kinematic_sizes import kinematic_size
from ferryid.validation.recorded.lateness import cannot_be_late, late, possible_delay_s
from ferryid.validation.recorded.log import RecordedLog

PLACE = ("x", "y")


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return by how much positions are late [s]."""
    return Truth("clock_offset", None, {"seconds": possible_delay_s(log, PLACE, size)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the positions be late, and the heading and all velocities stay."""
    return Concealed(late(log, PLACE, truth.values["seconds"]))


def cannot(log: RecordedLog) -> str:
    """Return why positions cannot be late."""
    if "x" not in log.topics or not {"u", "vel_N"} & set(log.topics):
        return "it has no position beside a velocity"
    return cannot_be_late(log, PLACE)


CONCEALMENT = Concealment(
    "clock_offset",
    SENSOR,
    "s",
    "Positions are stamped later than heading and velocities; in one table with these, by whole rows.",
    lambda log: (possible_delay_s(log, PLACE, 0.05), 2.0),
    sample,
    conceal,
    cannot,
    visible=lambda log: kinematic_size(log.measurements, (LATE,), CHECKS.least_delay_s),
)
