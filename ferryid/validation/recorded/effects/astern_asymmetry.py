"""An actuator that gives a share of its force astern: its record astern is raised."""

from __future__ import annotations

import numpy as np

from ferryid.effects import effects
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import drives, record_of, thrust_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog

LEAST_SHARE = 0.05
"""Share of the rows that an actuator has to push either way."""


def able(log: RecordedLog) -> list[str]:
    """Return the names of the actuators that push both ways."""
    known, found = effects()["astern_asymmetry"].instances(log.profile), []
    for name, drive in drives(log).items():
        acted = thrust_of(log, drive)
        if name in known and min(np.mean(acted > 0.0), np.mean(acted < 0.0)) > LEAST_SHARE:
            found.append(name)
    return sorted(found)


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return an actuator that lost a share of its force astern."""
    return Truth("astern_asymmetry", str(rng.choice(able(log))), {"factor": 1.0 - size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the record claim astern what acted over the factor."""
    drive = drives(log)[str(truth.instance)]
    acted = thrust_of(log, drive)
    record, missed = record_of(log, drive, np.where(acted < 0.0, acted / truth.values["factor"], acted))
    share = float(np.mean(missed[acted < 0.0])) if np.any(acted < 0.0) else 0.0
    return Concealed(log.changed({drive.column: record}), share, f"the thrust curve of {truth.instance} ends below it")


CONCEALMENT = Concealment(
    "astern_asymmetry",
    ACTUATOR,
    "share of the force astern",
    "The record of one actuator is raised where it pushes astern, so that a factor of that thrust is the thrust that acted.",
    lambda log: (0.01, 0.6),
    sample,
    conceal,
    lambda log: "" if able(log) else "no actuator of it pushes both ways",
    neutral=1.0,
)
