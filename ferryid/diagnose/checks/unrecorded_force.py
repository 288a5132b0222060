"""Unrecorded force: the vessel speeds up along its bow while every recorded actuator pushes nothing.

Somebody steered by hand, or the orders took another way than the one that was recorded. Wind moves an idle vessel too, but
slowly: it drifts with a few per cent of the wind's speed. So only a gain in speed counts that no wind gives, with a force that
comes near the largest recorded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.signals.smooth import moving_mean, odd_rows


def find(measurements: Measurements) -> SensorFinding | None:
    """Return for how long the vessel was driven by what was not recorded, and how hard."""
    size = np.abs(measurements.parts).sum(axis=1)[:, :2].max(axis=1)
    ahead = np.abs(measurements.parts.sum(axis=1)[:, 0])
    if not measurements.usable.any():
        return None
    largest = float(np.quantile(ahead[measurements.usable], 0.95))
    if largest <= 0.0:
        return None
    idle = measurements.usable & (size < CHECKS.idle_share * float(size[measurements.usable].max()))
    rows = np.zeros(len(measurements.t), dtype=np.bool_)
    hardest = 0.0
    for first, end in _stretches(idle):
        slope, gain = _speeding(measurements, first, end)
        force = measurements.profile.hull.mass_kg * slope
        if gain > CHECKS.idle_gain_mps and force > CHECKS.idle_force * largest:
            rows[first:end] = True
            hardest = max(hardest, force)
    if not rows.any():
        return None
    seconds = float(rows.sum()) * measurements.step_s
    share = 100.0 * hardest / largest

    def correct(measured: Measurements) -> Measurements:
        return replace(measured, usable=measured.usable & ~rows)

    return SensorFinding(
        "unrecorded_force",
        {"duration": Estimate(seconds, seconds, seconds, "s"), "force": Estimate(hardest, hardest, hardest, "N")},
        f"For {seconds:.0f} s every recorded actuator was idle, yet the vessel speeded up as with {hardest:.0f} N, {share:.0f} "
        "% of the most that was recorded: it was driven by something that was not recorded.",
        correct,
        {
            "time_s": measurements.t,
            "surge_mps": measurements.nu[:, 0],
            "recorded_N": measurements.parts.sum(axis=1)[:, 0],
        },
    )


def _stretches(idle: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], idle, [False]]).astype(np.int8))).reshape(-1, 2)
    return [(int(first), int(end)) for first, end in edges]


def _speeding(measurements: Measurements, first: int, end: int) -> tuple[float, float]:
    """Return how fast the bow's speed grows at most [m/s²], astern or ahead, and by how much in all [m/s]."""
    width = odd_rows(CHECKS.idle_mean_s, 1.0 / measurements.step_s)
    if (end - first) * measurements.step_s < CHECKS.idle_s or end - first < 3 * width:
        return 0.0, 0.0
    speed = moving_mean(np.abs(measurements.nu_raw[first:end, :1]), width)[:, 0]
    speed = speed[np.isfinite(speed)]
    slope = (speed[width:] - speed[:-width]) / (width * measurements.step_s)
    return float(slope.max()), float((speed - np.minimum.accumulate(speed)).max())


CHECK = Check("unrecorded_force", "Motion while every actuator is idle", find, place=8)
