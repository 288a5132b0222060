"""An actuator that gives a share of its force: its record is raised to what a sound one would have needed."""

from __future__ import annotations

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import drives, record_of, thrust_of, times_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment, acting
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return an actuator that lost a share of its force."""
    name = str(rng.choice(sorted(drives(log))))
    return Truth("thruster_gain", name, {"factor": 1.0 - size}, *span)


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the record claim the thrust that truly acted over the factor; a rudder behind it feels the thrust that acts."""
    drive = drives(log)[str(truth.instance)]
    acted, there = thrust_of(log, drive), acting(truth, times_of(log, drive))
    wanted = np.where(there, acted / truth.values["factor"], acted)
    record, missed = record_of(log, drive, wanted)
    share = float(np.mean(missed[there])) if there.any() else 0.0
    return Concealed(log.changed({drive.column: record}), share, f"the thrust curve of {truth.instance} ends below it")


CONCEALMENT = Concealment(
    "thruster_gain",
    ACTUATOR,
    "share of the force",
    "The record of one actuator is raised so that a factor of the thrust that it claims is the thrust that acted.",
    lambda log: (0.01, 0.5),
    sample,
    conceal,
    neutral=1.0,
    time_limited=True,
)
