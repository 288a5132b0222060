"""Positions of an antenna off the origin; velocities stay those of the origin."""

from __future__ import annotations

from math import copysign, sqrt

import numpy as np

from ferryid.diagnose.checks.kinematics import X, Y
from ferryid.diagnose.checks.lever_arm import least_m
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_vector
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment, length_of
from ferryid.validation.recorded.kinematic_sizes import kinematic_size
from ferryid.validation.recorded.log import RecordedLog
from ferryid.vessel.dimensions import dimensions
from ferryid.vessel.frames import to_world

ABOARD = 0.9
"""Share of the half breadth across which an antenna lies at most."""


def cannot(log: RecordedLog) -> str:
    """Return why there is no position to move."""
    if "x" not in log.topics or "psi" not in log.topics:
        return "it has no position with a heading"
    return "" if {"u", "vel_N"} & set(log.topics) else "its velocity is the slope of its position"


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return an arm of a length [m] to a place aboard: in a random direction, or along the hull where that is too narrow."""
    x, y = random_vector(size, rng)
    across = ABOARD * 0.5 * dimensions(log.profile)[1]
    if abs(y) > across:
        y = copysign(across, y)
        x = copysign(sqrt(size**2 - y**2), x)
    return Truth("lever_arm", None, {"x": x, "y": y})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Move the positions by the arm, turned by the heading of their time."""
    psi = log.at("psi", log.times(log.topics["x"]))
    north, east = to_world(np.full_like(psi, truth.values["x"]), np.full_like(psi, truth.values["y"]), psi)
    return Concealed(log.changed({"x": log.columns["x"] + north, "y": log.columns["y"] + east}))


CONCEALMENT = Concealment(
    "lever_arm",
    SENSOR,
    "m",
    "Positions are those of a point off the origin, turned with the heading; velocities stay.",
    lambda log: (0.005 * length_of(log), 0.5 * length_of(log)),
    sample,
    conceal,
    cannot,
    visible=lambda log: kinematic_size(log.measurements, (X, Y), least_m(log.measurements)),
)
