"""Positions whose east points west: a record that is wrong altogether, which a diagnosis has to refuse."""

from __future__ import annotations

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog

VELOCITIES = ({"u", "v"}, {"vel_N", "vel_E"})


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return the error, which has no size."""
    return Truth("mirrored_axis", None, {})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let positions east of the first be as far west of it."""
    east = log.columns["y"]
    first = float(east[np.isfinite(east)][0])
    return Concealed(log.changed({"y": 2.0 * first - east}))


def cannot(log: RecordedLog) -> str:
    """Return why nothing contradicts a mirrored position."""
    there = set(log.topics)
    whole = {"x", "y", "psi"} <= there and any(one <= there for one in VELOCITIES)
    return "" if whole else "it has no position and heading beside a velocity"


CONCEALMENT = Concealment(
    "mirrored_axis",
    SENSOR,
    "",
    "Positions are mirrored at the meridian of the first; a log that is so wrong is to be refused.",
    lambda log: (0.5, 1.0),
    sample,
    conceal,
    cannot,
    gross=True,
)
