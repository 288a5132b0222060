"""Heading interpolated through the wrap: between 359 and 1 deg some samples of 240 or 120 deg, which the vessel never had."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.frames import wrap


def find(measurements: Measurements) -> SensorFinding | None:
    """Return how many samples lie within a turn of heading that the yaw rate knows nothing of."""
    inside, psi = repaired(measurements)
    count = float(inside.sum())
    if count == 0.0:
        return None

    def correct(measured: Measurements) -> Measurements:
        return replace(measured, eta=np.column_stack([measured.eta[:, :2], psi]))

    return SensorFinding(
        "heading_wrap",
        {"samples": Estimate(count, count, count, "-")},
        f"The heading was interpolated the long way round at the wrap: {counted(int(count), 'sample')} in "
        f"between {verb(count, 'is')} false.",
        correct,
        {"time_s": measurements.t[inside], "heading_rad": measurements.psi[inside], "repaired_rad": psi[inside]},
    )


def repaired(measurements: Measurements) -> tuple[NDArray[np.bool_], Floats]:
    """Return which headings are false, and all headings with these interpolated the short way."""
    psi, dt = measurements.psi.copy(), measurements.step_s
    rate = np.where(np.isfinite(measurements.nu_raw[:, 2]), measurements.nu_raw[:, 2], 0.0)
    odd = np.abs(np.diff(psi) - 0.5 * dt * (rate[1:] + rate[:-1])) > CHECKS.wrap_rate_radps * dt
    inside = np.zeros(len(psi), dtype=np.bool_)
    # A step that looks right between two that do not is part of the same turn.
    odd[1:-1] |= odd[:-2] & odd[2:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], odd, [False]]).astype(np.int8)))
    for first, last in edges.reshape(-1, 2).tolist():
        before, after = float(psi[first]), float(psi[last])
        short = float(wrap(np.array(after - before)))
        turned = float(rate[first : last + 1].mean()) * (last - first) * dt
        at_wrap = max(abs(float(wrap(np.array(value - pi)))) for value in (before, after)) < CHECKS.wrap_near_rad
        away = float(np.abs(psi[first : last + 1] - before).max())
        if (
            last - first < 2
            or not at_wrap
            or abs(short - turned) > CHECKS.wrap_near_rad
            or away < 2.0 * CHECKS.wrap_near_rad
        ):
            continue
        inside[first + 1 : last] = True
        psi[last:] += before + short - after
        psi[first : last + 1] = np.linspace(before, before + short, last - first + 1)
    return inside, psi


CHECK = Check("heading_wrap", "Heading through the wrap", find, place=10)
