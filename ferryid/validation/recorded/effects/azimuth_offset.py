"""A thruster that points elsewhere than its encoder reads."""

from __future__ import annotations

from math import radians

import numpy as np

from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span, random_sign
from ferryid.validation.recorded.drives import drives
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog


def turning(log: RecordedLog) -> list[str]:
    """Return the names of the thrusters that turn."""
    return sorted(name for name, one in drives(log).items() if one.turn)


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return an offset [deg] of one thruster."""
    return Truth("azimuth_offset", str(rng.choice(turning(log))), {"angle": size * random_sign(rng)})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the encoder read less than the angle at which the force acted."""
    column = drives(log)[str(truth.instance)].turn
    return Concealed(log.changed({column: log.columns[column] - radians(truth.values["angle"])}))


CONCEALMENT = Concealment(
    "azimuth_offset",
    ACTUATOR,
    "deg",
    "The recorded angle of one thruster is turned back by the offset.",
    lambda log: (0.2, 20.0),
    sample,
    conceal,
    lambda log: "" if turning(log) else "no thruster of it turns",
)
