"""A load aboard, all along or from a time on."""

from __future__ import annotations

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.plant.effects.payload import BOARDING_S
from ferryid.validation.recorded.allocation import cannot_carry, conceal_load
from ferryid.validation.recorded.effects.effect import LOAD, Concealed, Concealment, length_of
from ferryid.validation.recorded.hull import rigid_load
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a load, as a share of the vessel's mass."""
    mass, x = size * log.profile.hull.mass_kg, float(rng.uniform(-0.3, 0.3)) * length_of(log)
    return Truth("payload", None, {"mass": mass, "x": x}, *span)


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the records claim what the vessel alone needed; a load comes aboard at rest, piece by piece, and takes momentum."""
    mass, x = truth.values["mass"], truth.values["x"]
    nu, t = log.measurements.nu, log.measurements.t
    load = rigid_load(mass, x, nu, log.acceleration)
    if truth.onset_s is not None:
        aboard = np.clip((t - truth.onset_s) / BOARDING_S + 0.5, 0.0, 1.0)
        boarding = np.gradient(aboard, t)
        u, v, r = nu.T
        momentum = mass * np.column_stack([u, v + x * r, x * (v + x * r)])
        load = aboard[:, None] * load - boarding[:, None] * momentum
    return conceal_load(log, load)


def cannot(log: RecordedLog) -> str:
    """Return why a recording cannot carry it."""
    return "a payload was measured" if log.measurements.payload is not None else cannot_carry(log)


CONCEALMENT = Concealment(
    "payload",
    LOAD,
    "share of the mass",
    "Actuators claim besides what a mass takes to follow the measured motion.",
    lambda log: (0.01, 0.6),
    sample,
    conceal,
    cannot,
    positions=("x",),
    time_limited=True,
)
