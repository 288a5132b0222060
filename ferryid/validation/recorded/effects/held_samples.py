"""Old samples that are repeated while nothing new was measured."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.effect import Span
from ferryid.validation.recorded.effects.effect import SENSOR, Concealed, Concealment
from ferryid.validation.recorded.lateness import topics_of
from ferryid.validation.recorded.log import NAVIGATION, RecordedLog

LONGEST_S = 2.0
"""Longest time for which a sample is held [s]."""


def sample(size: float, log: RecordedLog, rng: np.random.Generator, span: Span) -> Truth:
    """Return a share of the recording [%]."""
    return Truth("held_samples", None, {"share": size})


def conceal(log: RecordedLog, truth: Truth, rng: np.random.Generator) -> Concealed:
    """Hold all signals of the navigation in stretches of equal length, one anywhere in each of as many equal parts."""
    total = 0.01 * truth.values["share"] * log.duration_s
    count = max(1, ceil(total / LONGEST_S))
    part, length = log.duration_s / count, total / count
    begins = part * np.arange(count) + (part - length) * rng.uniform(size=count)
    series = dict(log.series)
    for topic in topics_of(log, NAVIGATION):
        t = log.times(topic)
        order = np.argsort(t, kind="stable")
        place = np.searchsorted(begins, t, side="right") - 1
        held = (place >= 0) & (t < begins[np.maximum(place, 0)] + length)
        # The last row in order of time that is not held.
        last = np.maximum.accumulate(np.where(held[order], -1, np.arange(len(t))))
        source = np.empty(len(t), dtype=np.int64)
        source[order] = order[np.maximum(last, 0)]
        fields = log.fields(topic, NAVIGATION)
        columns = {path: one[source] if path in fields else one for path, one in log.series[topic].columns.items()}
        series[topic] = replace(log.series[topic], columns=columns)
    return Concealed(replace(log, series=series))


CONCEALMENT = Concealment(
    "held_samples",
    SENSOR,
    "% of the log",
    f"All signals of the navigation repeat an old value for up to {LONGEST_S:g} s at a time.",
    lambda log: (0.1, 10.0),
    sample,
    conceal,
    visible=lambda log: 100.0 * CHECKS.least_held_share,
)
