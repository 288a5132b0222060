"""Thrust that follows its record with a lag: the record leads what acted."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import drives, record_of, thrust_of, times_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a time constant [s]."""
    return Truth("thruster_lag", None, {"time_constant": size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let every record claim ``T + tau dT/dt``, T being the thrust that acted: a first-order lag gives T back.

    A rudder lags likewise, in its angle.
    """
    records, missed, rows = dict[str, Floats](), 0, 0
    for column in rudders(log):
        records[column] = led(log.columns[column], log.times(log.topics[column]), truth.values["time_constant"])
    for drive in drives(log).values():
        acted, t = thrust_of(log, drive), times_of(log, drive)
        records[drive.column], beyond = record_of(log, drive, led(acted, t, truth.values["time_constant"]))
        missed, rows = missed + int(beyond.sum()), rows + len(acted)
    return Concealed(log.changed(records), missed / max(rows, 1), "the thrust curves end below what changes so fast")


def rudders(log: RecordedLog) -> list[str]:
    """Return the columns of rudders."""
    return [column for (_, role), column in log.roles.items() if role == "rudder"]


def led(values: Floats, t: Floats, time_constant_s: float) -> Floats:
    """Return values plus a time constant times their slope, shape (n,); rows without a value stay so."""
    known, made = np.flatnonzero(np.isfinite(values)), values.copy()
    if len(known) > 2:
        made[known] += time_constant_s * np.gradient(values[known], t[known])
    return made


def cannot(log: RecordedLog) -> str:
    """Return why the record has no slope."""
    orders = [name for name, one in drives(log).items() if "_cmd_" in one.column]
    if orders:
        return f"of {orders[0]} orders alone are recorded, which change in steps"
    repeated = [name for name, one in drives(log).items() if np.any(np.diff(times_of(log, one)) <= 0.0)]
    return f"rows of {repeated[0]} have the same time" if repeated else ""


CONCEALMENT = Concealment(
    "thruster_lag",
    ACTUATOR,
    "s",
    "All records, rudders too, claim what acted plus the time constant times its slope: a first-order lag gives what acted.",
    lambda log: (0.05, 2.0),
    sample,
    conceal,
    cannot,
)
