"""Thrust that falls with the water's velocity into the propeller."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import Drive, angle_at, drives, record_of, thrust_of, times_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog

LEAST_LEFT = 0.1
"""Share of the thrust that has to be left for the record to make up for it."""


def inflow(log: RecordedLog, drive: Drive, push: Floats) -> Floats:
    """Return the velocity of an actuator through still water along its own push [m/s], at the rows of its strength."""
    t = times_of(log, drive)
    (u, v, r), angle = log.motion_at(t)[1].T, angle_at(log, drive, t)
    x, y = drive.actuator.position_m
    return np.asarray(np.sign(push) * (np.cos(angle) * (u - r * y) + np.sin(angle) * (v + r * x)))


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a share that is lost by m/s."""
    return Truth("thrust_inflow_loss", None, {"per_mps": size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let every record claim what acted over the share that the inflow leaves."""
    records, missed, rows = {}, 0, 0
    for drive in drives(log).values():
        acted = thrust_of(log, drive)
        left = 1.0 - truth.values["per_mps"] * inflow(log, drive, acted)
        too_little = left < LEAST_LEFT
        records[drive.column], beyond = record_of(
            log, drive, np.where(too_little, acted, acted / np.where(too_little, 1.0, left))
        )
        missed, rows = missed + int((beyond | too_little).sum()), rows + len(acted)
    return Concealed(log.changed(records), missed / max(rows, 1), "the thrust curves end below it")


def cannot(log: RecordedLog) -> str:
    """Return why the inflow is in the record already."""
    if any(
        one.actuator.thrust is not None and one.actuator.thrust.kind == "open_water" for one in drives(log).values()
    ):
        return "its open-water curves have the inflow in them"
    return "forces are recorded, not speeds" if any(one.role == "force" for one in drives(log).values()) else ""


CONCEALMENT = Concealment(
    "thrust_inflow_loss",
    ACTUATOR,
    "s/m",
    "All records are raised by what the water's velocity along the push takes off.",
    lambda log: (0.01, 0.6),
    sample,
    conceal,
    cannot,
)
