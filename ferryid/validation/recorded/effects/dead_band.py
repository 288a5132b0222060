"""An actuator that gives nothing up to a band: its record reaches beyond the band for the least thrust."""

from __future__ import annotations

import numpy as np

from ferryid.effects import effects
from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import Drive, drives, record_of, thrust_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog

WIDTH = 0.1
"""Share of the band below and above its end over which the thrust comes in: a sharp end leaves no small thrust."""
HALVINGS = 60
"""Of the interval in which the record of a thrust lies."""
BOTH_WAYS = 0.02
"""Share of the rows that push astern from which on a band astern is part of the truth."""


def able(log: RecordedLog) -> list[str]:
    """Return the names of the actuators whose thrust follows from a speed, or an order, alone."""
    known = effects()["dead_band"].instances(log.profile)
    return sorted(name for name, one in drives(log).items() if name in known and one.role != "thrust")


def most_of(log: RecordedLog, drive: Drive) -> float:
    """Return the largest recorded strength, without its sign."""
    return float(np.nanmax(np.abs(log.columns[drive.column]), initial=0.0))


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a band of one actuator, a share of the largest recorded strength."""
    name = str(rng.choice(able(log)))
    drive = drives(log)[name]
    values = {"ahead": size * most_of(log, drive)}
    if float(np.mean(log.columns[drive.column] < 0.0)) > BOTH_WAYS:
        values["astern"] = values["ahead"]
    return Truth("dead_band", name, values)


def left_by(strength: Floats, band: float) -> Floats:
    """Return the share of the thrust that a band leaves at a strength, shape (n,)."""
    return np.asarray(np.clip((np.abs(strength) / band - 1.0 + WIDTH) / (2.0 * WIDTH), 0.0, 1.0))


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the record claim what the actuator has to be ordered so that the thrust that acted is left."""
    drive, band = drives(log)[str(truth.instance)], truth.values["ahead"]
    acted, recorded = thrust_of(log, drive), log.columns[drive.column]
    # Beyond the band nothing is lost, and at rest nothing is asked for.
    low, high = np.ones(len(acted)), np.full(len(acted), 1.0 / 1e-6)
    inside = np.isfinite(acted) & (acted != 0.0) & (left_by(recorded, band) < 1.0)
    for _ in range(HALVINGS):
        # The claim is a multiple of what acted, by the geometric mean, as it may be large.
        middle = np.sqrt(low * high)
        record, missed = record_of(log, drive, np.where(inside, middle * acted, acted))
        over = missed | (middle * left_by(record, band) > 1.0)
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    record, missed = record_of(log, drive, np.where(inside, low * acted, acted))
    lacking = inside & (np.abs(low * left_by(record, band) - 1.0) > 1e-3)
    share = float(np.mean(missed | lacking)) if len(acted) else 0.0
    return Concealed(log.changed({drive.column: record}), share, f"the thrust curve of {truth.instance} ends below it")


CONCEALMENT = Concealment(
    "dead_band",
    ACTUATOR,
    "share of the most strength",
    "The record of one actuator is raised so that a band about zero, in which nothing acts, leaves the thrust that acted.",
    lambda log: (0.02, 0.6),
    sample,
    conceal,
    lambda log: "" if able(log) else "no actuator's thrust follows from a speed or an order alone",
)
