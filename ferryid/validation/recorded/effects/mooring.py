"""A mooring line, which stiffens as it is stretched."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_vector
from ferryid.validation.plant.effects.mooring import STIFFENING_M, Mooring, mooring_load
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment, length_of
from ferryid.validation.recorded.log import RecordedLog

SLOW = 0.06
"""Rate at which a vessel on a line of size 1 swings [rad/s]."""
NAMES = ("stiffness_north", "stiffness_east", "north", "east")


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a line on which the vessel swings at `SLOW` times the root of the size, from where it was, or near that."""
    stiffness = [size * SLOW**2 * log.profile.hull.mass_kg * float(rng.uniform(0.6, 1.6)) for _ in range(2)]
    middle = np.median(log.measurements.eta[log.measurements.usable, :2], axis=0)
    place = middle + random_vector(2.0 * length_of(log) * rng.uniform(0.2, 0.8), rng)
    return Truth("mooring", None, dict(zip(NAMES, (*stiffness, *place.tolist()), strict=True)), *span)


def pull(log: RecordedLog, truth: Truth) -> Floats:
    """Return the pull of a line, shape (n, 3)."""
    begin, end = truth.onset_s or -np.inf, np.inf if truth.offset_s is None else truth.offset_s
    line = Mooring(np.array([truth.values[name] for name in NAMES]), np.array([begin, end]))
    out = np.zeros((len(log.measurements.t), 6))
    c, s = log.measurements.pointing
    for row, (t, (north, east, _)) in enumerate(
        zip(log.measurements.t.tolist(), log.measurements.eta.tolist(), strict=True)
    ):
        R = np.array([[c[row], -s[row], 0.0], [s[row], c[row], 0.0], [0.0, 0.0, 1.0]])
        mooring_load(line, t, north, east, R, out[row])
    return out[:, [0, 1, 5]]


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what acted less the pull of the line at the measured places."""
    return conceal_load(log, pull(log, truth))


def cannot(log: RecordedLog) -> str:
    """Return why a recording cannot carry it."""
    if not np.isfinite(log.measurements.eta[log.measurements.usable, :2]).all():
        return "it has no position"
    return cannot_carry(log)


CONCEALMENT = Concealment(
    "mooring",
    LOAD,
    "(0.06 rad/s)²",
    f"Actuators claim less by the pull of a line at the measured places, a tenth stiffer at {STIFFENING_M:g} m.",
    lambda log: (0.005, 3.0),
    sample,
    conceal,
    cannot,
    positions=("north", "east"),
    time_limited=True,
)
