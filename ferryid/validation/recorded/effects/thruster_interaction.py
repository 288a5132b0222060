"""Thrust that is lost in the race of another thruster."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import Drive, angle_at, drives, record_of, thrust_of, times_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog

WEAK = 0.08
"""Share of the largest thrust below which a race loses strength."""
ROUNDS = 30
"""In which what a record claims and what its race takes from the others settle."""
LEAST_MORE = 1.05
"""Largest ratio of claimed to acting thrust that half a loss gives, below which no race finds a thruster."""
LEAST_LEFT = 0.1
"""Share of the thrust that has to be left for the record to make up for it."""


def left_by(fraction: float, source: Drive, hit: Drive, thrust: Floats, angle: Floats, most: float) -> Floats:
    """Return the share of its thrust that the race of one thruster leaves another, by the plant's formula, shape (n,).

    Parameters
    ----------
    fraction
        Lost in a race that blows straight at a thruster.
    source, hit
        The two thrusters.
    thrust, angle, most
        Of the source: thrust [N] and angle [rad], shape (n,), and its largest thrust [N].
    """
    dx = hit.actuator.position_m[0] - source.actuator.position_m[0]
    dy = hit.actuator.position_m[1] - source.actuator.position_m[1]
    blows = np.where(thrust >= 0.0, -1.0, 1.0)
    toward = blows * (np.cos(angle) * dx + np.sin(angle) * dy) / hypot(dx, dy)
    beside = np.degrees(np.arccos(np.clip(toward, -1.0, 1.0)))
    t = max(1.0 - fraction, 1e-3)
    left = t + (1.0 - t) * beside**3 / (130.0 / t**3 + beside**3)
    strength = np.minimum(1.0, np.abs(thrust) / (WEAK * most))
    return np.asarray(np.where(toward > 0.0, 1.0 - strength * (1.0 - left), 1.0))


def claimed_ratio(log: RecordedLog, fraction: float) -> Mapping[str, Floats]:
    """Return claimed over acting thrust of every thruster on the rows of the measurements."""
    t, found = log.measurements.t, drives(log)
    acted, angle = dict[str, Floats](), dict[str, Floats]()
    for name, drive in found.items():
        values = thrust_of(log, drive)
        known = np.isfinite(values)
        acted[name] = np.interp(t, times_of(log, drive)[known], values[known])
        angle[name] = angle_at(log, drive, t)
    most = {name: max(float(np.abs(values).max()), 1e-9) for name, values in acted.items()}
    claimed = dict(acted)
    ratio = {name: np.ones(len(t)) for name in found}
    for _ in range(ROUNDS):
        for name, hit in found.items():
            left = np.ones(len(t))
            for other, source in found.items():
                if other != name and hit.actuator.position_m != source.actuator.position_m:
                    left *= left_by(fraction, source, hit, claimed[other], angle[other], most[other])
            ratio[name] = 1.0 / np.maximum(left, LEAST_LEFT)
        claimed = {name: acted[name] * ratio[name] for name in found}
    return ratio


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a loss in the race of another thruster, as a share."""
    return Truth("thruster_interaction", None, {"fraction": size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let every record claim what acted over the share that the races of the others leave it."""
    ratio, records, missed, rows = claimed_ratio(log, truth.values["fraction"]), {}, 0, 0
    for name, drive in drives(log).items():
        at = np.interp(times_of(log, drive), log.measurements.t, ratio[name])
        records[drive.column], beyond = record_of(log, drive, thrust_of(log, drive) * at)
        missed, rows = missed + int(beyond.sum()), rows + len(at)
    return Concealed(log.changed(records), missed / max(rows, 1), "the thrust curves end below it")


def cannot(log: RecordedLog) -> str:
    """Return why no race finds another thruster."""
    if len(drives(log)) < 2:
        return "it has one actuator"
    most = max(float(ratio.max()) for ratio in claimed_ratio(log, 0.5).values())
    return "" if most > LEAST_MORE else "no thruster of it blows at another"


CONCEALMENT = Concealment(
    "thruster_interaction",
    ACTUATOR,
    "share of the force",
    "All records are raised by what the races of the others take off, by the plant's formula.",
    lambda log: (0.02, 0.6),
    sample,
    conceal,
    cannot,
)
