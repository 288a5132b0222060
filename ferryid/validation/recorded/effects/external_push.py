"""A push from outside for a while."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_vector
from ferryid.validation.plant.effects.external_push import HEAVE_S, HEAVES, RISE_S
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment, length_of
from ferryid.validation.recorded.log import RecordedLog

LASTS_S, LONGEST = (90.0, 180.0), 0.3
"""How long it pushes [s], and at most, as a share of the recording."""
BEGINS = (0.2, 0.6)
"""When it begins, as shares of the recording."""
PLACE = 0.03
"""How far from midship it pushes at most, as a share of the length."""


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a push that gives the vessel this acceleration, constant over ground."""
    begin = float(rng.uniform(*BEGINS)) * log.duration_s
    end = begin + min(float(rng.uniform(*LASTS_S)), LONGEST * log.duration_s)
    north, east = random_vector(size * log.profile.hull.mass_kg, rng)
    moment = float(rng.uniform(-PLACE, PLACE)) * length_of(log) * size * log.profile.hull.mass_kg
    return Truth("external_push", None, {"north": north, "east": east, "moment": moment}, begin, end)


def push(log: RecordedLog, truth: Truth) -> Floats:
    """Return the push with the plant's rise and heaves, shape (n, 3)."""
    t, (c, s) = log.measurements.t, log.measurements.pointing
    begin, end = truth.onset_s or 0.0, truth.offset_s or log.duration_s
    share = np.clip((t - begin) / RISE_S + 0.5, 0.0, 1.0) - np.clip((t - end) / RISE_S + 0.5, 0.0, 1.0)
    share *= 1.0 + HEAVES * np.sin(2.0 * np.pi * (t - begin) / HEAVE_S)
    north, east = truth.values["north"], truth.values["east"]
    along = np.column_stack([c * north + s * east, c * east - s * north, np.full(len(t), truth.values["moment"])])
    return np.asarray(share[:, None] * along)


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less the push."""
    return conceal_load(log, push(log, truth))


CONCEALMENT = Concealment(
    "external_push",
    LOAD,
    "m/s²",
    "Actuators claim less by a push over ground for a while, hauled now more and now less.",
    lambda log: (0.001, 0.5),
    sample,
    conceal,
    cannot_carry,
)
