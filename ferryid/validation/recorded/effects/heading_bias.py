"""A heading with a constant error."""

from __future__ import annotations

from math import degrees, radians

import numpy as np

from ferryid.diagnose.checks.kinematics import ANGLE
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.effects.heading_bias import apply
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_sign
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.kinematic_sizes import kinematic_size
from ferryid.validation.recorded.log import RecordedLog


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a heading that is off [deg]."""
    return Truth("heading_bias", None, {"angle": size * random_sign(rng)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Report a heading that is too large; a velocity that is recorded along north and east is turned by it with the rest."""
    return Concealed(log.changed({"psi": log.columns["psi"] + radians(truth.values["angle"])}))


def visible(log: RecordedLog) -> float | None:
    """Return the size that kinematics shows [deg]; None where the velocity is turned with it: forces show that."""
    if "u" not in log.topics:
        return None
    return degrees(kinematic_size(log.measurements, (ANGLE,), radians(CHECKS.least_angle_deg)))


CONCEALMENT = Concealment(
    "heading_bias",
    SENSOR,
    "deg",
    "The heading is too large by an angle; where the velocity is recorded along north and east, surge and sway turn with it.",
    lambda log: (0.2, 15.0),
    sample,
    conceal,
    lambda log: "" if "psi" in log.topics else "it has no heading",
    visible=visible,
    altered=lambda force_model, truth: apply(force_model, np.array([truth.values["angle"]]), None),
)
