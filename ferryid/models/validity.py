"""Ranges of validity: the motions that a model was fitted to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ferryid.models.thresholds import MODELS
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats

RANGE_UNITS = {
    **dict.fromkeys(("u", "v", "U"), "m/s"),
    "r": "rad/s",
    **dict.fromkeys(("u_dot", "v_dot"), "m/s²"),
    "r_dot": "rad/s²",
    "payload_kg": "kg",
}


def validity_ranges(nu: Floats, nu_dot: Floats, payload: Floats | None = None) -> dict[str, tuple[float, float]]:
    """0.5 % and 99.5 % quantiles of what `range_columns` gives."""
    found = {}
    for name, values in range_columns(nu, nu_dot, payload).items():
        low, high = np.quantile(values, MODELS.range_quantiles) if len(values) else (np.nan, np.nan)
        found[name] = (float(low), float(high))
    return found


def range_columns(nu: Floats, nu_dot: Floats, payload: Floats | None = None) -> dict[str, Floats]:
    """Return the columns that ranges of validity are given for: u, v, r, u_dot, v_dot, r_dot and the speed U, SI.

    The velocities and accelerations have the shape (n, 3). A payload [kg], shape (n,), has a range where it is known: its
    mass is, but not what the deeper draught does to damping and added mass.
    """
    return {
        **({} if payload is None else {"payload_kg": payload}),
        **{name: nu[:, i] for i, name in enumerate("uvr")},
        **{f"{name}_dot": nu_dot[:, i] for i, name in enumerate("uvr")},
        "U": np.hypot(nu[:, 0], nu[:, 1]),
    }


def payload_kg(motion: Motion, rows: Flags) -> Floats:
    """Return the payload on the marked rows [kg], none where the log does not measure it, shape (rows,)."""
    return np.zeros(int(rows.sum())) if motion.payload is None else motion.payload[rows, 0]


def outside_ranges(ranges: Mapping[str, tuple[float, float]], motion: Motion, rows: Flags) -> dict[str, float]:
    """Return the share of the marked rows outside each range of validity, widened by a tenth of its span on either side."""
    columns = range_columns(motion.nu[rows], motion.nu_dot[rows], payload_kg(motion, rows))
    shares = {}
    for name, (low, high) in ranges.items():
        if name in columns and columns[name].size:
            margin = 0.1 * (high - low)
            values = columns[name]
            shares[name] = float(np.mean((values < low - margin) | (values > high + margin)))
    return shares


def span_ranges(parts: Sequence[Mapping[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    """Return ranges of validity that span the given ones; NaN where none is known."""
    found: dict[str, tuple[float, float]] = {}
    for part in parts:
        for key, (low, high) in part.items():
            before = found.get(key, (math.nan, math.nan))
            found[key] = (float(np.fmin(before[0], low)), float(np.fmax(before[1], high)))
    return found
