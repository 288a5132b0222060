"""An actuator that never gives more than a limit: near its most, the record claims more and more."""

from __future__ import annotations

import numpy as np

from ferryid.effects import effects
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.drives import drives, record_of, thrust_of
from ferryid.validation.recorded.effects.effect import ACTUATOR, Concealed, Concealment
from ferryid.validation.recorded.log import RecordedLog

BENDS = 0.95
"""Share of the limit above which the thrust lags behind its record."""
MOST = 0.995
"""Share of the rows that are below the limit: single rows are noise."""


def able(log: RecordedLog) -> list[str]:
    """Return the names of the actuators that have a curve with an end, and whose force is not measured."""
    known = effects()["thrust_saturation"].instances(log.profile)
    return sorted(name for name in drives(log) if name in known)


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return the largest thrust that acted ahead as the limit [N]; the size is the share of the largest claim that is lost.

    The limit is not drawn: it is where the motion has it.
    """
    name = str(rng.choice(able(log)))
    acted = thrust_of(log, drives(log)[name])
    return Truth("thrust_saturation", name, {"ahead": float(np.nanquantile(acted, MOST)), "lost": size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Let the record claim more above `BENDS` of the limit, up to ``limit / (1 - lost)`` at the limit."""
    drive, limit = drives(log)[str(truth.instance)], truth.values["ahead"]
    acted, bend = thrust_of(log, drive), BENDS * truth.values["ahead"]
    slope = (limit / (1.0 - truth.values["lost"]) - bend) / (limit - bend)
    record, missed = record_of(log, drive, np.where(acted > bend, bend + slope * (acted - bend), acted))
    share = float(np.mean(missed)) if len(acted) else 0.0
    return Concealed(log.changed({drive.column: record}), share, f"the thrust curve of {truth.instance} ends below it")


def cannot(log: RecordedLog) -> str:
    """Return why no limit can be concealed."""
    if not able(log):
        return "no actuator of unmeasured force has a thrust curve whose limits are stated (valid)"
    least = min(float(np.nanquantile(thrust_of(log, drives(log)[name]), MOST)) for name in able(log))
    return "" if least > 0.0 else "an actuator of it never pushes ahead"


CONCEALMENT = Concealment(
    "thrust_saturation",
    ACTUATOR,
    "share of the most force that is lost",
    "The record of one actuator claims more and more above 95 % of the largest thrust that acted: a soft limit.",
    lambda log: (0.02, 0.6),
    sample,
    conceal,
    cannot,
)
