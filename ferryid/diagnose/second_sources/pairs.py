"""A further signal beside the mapped ones, on one grid: both pass through the same sampling, so that neither is smoother."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.diagnose.checks.spans import RATE_HZ, Spans, spans_of
from ferryid.diagnose.second_sources.samples import Samples
from ferryid.diagnose.second_sources.thresholds import SECOND
from ferryid.effects.force_model import Measurements
from ferryid.signals.smooth import odd_rows, steady_mean
from ferryid.types import Flags, Floats

NORTH, EAST, PSI, U, V, R = range(6)
"""Columns of what is mapped: [m, m, rad, m/s, m/s, rad/s]."""
NEEDED = {
    "position": (NORTH, EAST, PSI),
    "heading": (PSI,),
    "velocity": (PSI, U, V, R),
    "speed": (U, V),
    "yaw_rate": (R,),
}


@dataclass(frozen=True)
class Pair:
    """One log's signal and what is mapped, as far as both were measured.

    Attributes
    ----------
    spans
        Windows.
    other
        The signal, zero where not measured, shape (n, k).
    mapped
        Columns as above, shape (n, 6).
    good
        Rows on which both were measured, shape (n,).
    """

    spans: Spans
    other: Floats
    mapped: Floats
    good: Flags


def pair_of(samples: Samples, measurements: Measurements, kind: str, late_s: float) -> Pair | None:
    """Return a signal beside what is mapped, moved earlier by what it is late; None where nothing was measured at once."""
    columns = np.column_stack([measurements.eta, measurements.nu_raw])
    needed = list(NEEDED[kind])
    if not np.isfinite(columns[measurements.usable][:, needed]).any(axis=0).all():
        return None
    # A fast signal was averaged over the same intervals.
    if samples.period_s * RATE_HZ < 1.0 and measurements.step_s * RATE_HZ < 1.0:
        columns = steady_mean(columns, odd_rows(1.0 / RATE_HZ, 1.0 / measurements.step_s))
    when = samples.t - late_s
    inside = (when >= measurements.t[0]) & (when <= measurements.t[-1])
    if np.count_nonzero(inside) < 2:
        return None
    when, other = when[inside], samples.values[inside]
    usable = np.interp(when, measurements.t, measurements.usable.astype(np.float64)) > 1.0 - 1e-9
    mapped = np.column_stack([np.interp(when, measurements.t, column) for column in columns.T])
    t = np.arange(when[0], when[-1], 1.0 / RATE_HZ)
    if len(t) < 2:
        return None
    after = np.clip(np.searchsorted(when, t, side="right"), 1, len(when) - 1)
    bridge = SECOND.bridged_periods * max(samples.period_s, measurements.step_s, 1.0 / RATE_HZ)
    good = (when[after] - when[after - 1] <= bridge) & usable[after] & usable[after - 1]
    both = np.column_stack([np.interp(t, when, column) for column in (*other.T, *mapped.T)])
    k = other.shape[1]
    seen = np.where(good[:, None], both[:, [*range(k), *(k + column for column in needed)]], np.nan)
    spans, _ = spans_of(float(t[0]), 1.0 / RATE_HZ, np.ones(len(t), dtype=np.bool_), seen)
    filled = np.where(good[:, None] & np.isfinite(both), both, 0.0)
    return Pair(spans, filled[:, :k], filled[:, k:], good)
