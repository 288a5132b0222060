"""A shallow strip, over which damping and added mass grow."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.plant.effects.shallow_water import ADDED_MASS_SHARE, Bank, damping_factor
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment
from ferryid.validation.recorded.hull import cannot_be_damped, strip_load
from ferryid.validation.recorded.log import RecordedLog

SIDES = ("south", "north", "west", "east")
FAR_M = 1e6
"""Where a strip ends that has no end [m]."""
COVERED = (0.3, 0.6)
"""Share of the rows that are in the strip."""


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a strip beyond a line north, south, east or west, over which damping grows by a share."""
    side = int(rng.integers(4))
    visited = log.measurements.eta[log.measurements.usable, 0 if side < 2 else 1]
    # A southern side bounds what lies north of it.
    share = float(rng.uniform(*COVERED))
    edge = float(np.quantile(visited, 1.0 - share if side % 2 == 0 else share))
    return Truth("shallow_water", None, {"factor": 1.0 + size, SIDES[side]: edge})


def growth(log: RecordedLog, truth: Truth) -> Floats:
    """Return the growth of the damping at the measured places, shape (n,)."""
    ends = [truth.values.get(side, -FAR_M if k % 2 == 0 else FAR_M) for k, side in enumerate(SIDES)]
    bank = Bank(truth.values["factor"], np.array(ends))
    north, east = log.measurements.eta[:, :2].T
    return np.array([damping_factor(bank, x, y) - 1.0 for x, y in zip(north.tolist(), east.tolist(), strict=True)])


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less what the strip adds."""
    return conceal_load(log, strip_load(log, growth(log, truth), ADDED_MASS_SHARE))


def cannot(log: RecordedLog) -> str:
    """Return why a recording cannot carry it."""
    if not np.isfinite(log.measurements.eta[log.measurements.usable, :2]).all():
        return "it has no position"
    return cannot_be_damped(log.profile) or cannot_carry(log)


CONCEALMENT = Concealment(
    "shallow_water",
    LOAD,
    "share of the damping",
    "Actuators claim besides what damping and added mass grow by beyond a line on the chart, with the plant's slope.",
    lambda log: (0.05, 4.0),
    sample,
    conceal,
    cannot,
    neutral=1.0,
    positions=SIDES,
)
