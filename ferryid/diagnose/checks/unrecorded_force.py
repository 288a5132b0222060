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
from ferryid.effects.wording import amount
from ferryid.signals.complementary_filter import velocity_from_pose
from ferryid.signals.smooth import moving_mean, odd_rows
from ferryid.types import Floats


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
    hardest, error = 0.0, 0.0
    rate_hz = 1.0 / measurements.step_s
    by_pose = velocity_from_pose(measurements.eta, rate_hz)[:, 0]
    for first, end in _stretches(idle):
        speed = _mean_speed(measurements.nu_raw[first:end, 0], rate_hz)
        slope, gain = _speeding(speed, rate_hz)
        force = measurements.profile.hull.mass_kg * slope
        if gain > CHECKS.idle_gain_mps and force > CHECKS.idle_force * largest:
            rows[first:end] = True
            if force > hardest:
                apart = _slope_error(speed, _mean_speed(by_pose[first:end], rate_hz), rate_hz)
                hardest, error = force, measurements.profile.hull.mass_kg * apart
    if not rows.any():
        return None
    seconds = float(rows.sum()) * measurements.step_s
    share = 100.0 * hardest / largest

    def correct(measured: Measurements) -> Measurements:
        return replace(measured, usable=measured.usable & ~rows)

    return SensorFinding(
        "unrecorded_force",
        {
            "duration": Estimate(seconds, seconds, seconds, "s"),
            "force": Estimate(hardest, hardest - 1.96 * error, hardest + 1.96 * error, "N"),
        },
        f"For {seconds:.0f} s every recorded actuator was idle, yet the vessel speeded up as with {amount(hardest)} N, "
        f"{share:.0f} % of the most that was recorded: it was driven by something that was not recorded.",
        correct,
        {
            "time_s": measurements.t,
            "surge_mps": measurements.nu[:, 0],
            "recorded_N": measurements.parts.sum(axis=1)[:, 0],
        },
        intervals=tuple(
            (float(measurements.t[first]), float(measurements.t[end - 1])) for first, end in _stretches(rows)
        ),
    )


def _stretches(idle: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], idle, [False]]).astype(np.int8))).reshape(-1, 2)
    return [(int(first), int(end)) for first, end in edges]


def _mean_speed(surge: Floats, rate_hz: float) -> Floats:
    """Return the moving mean of the speed along the bow of an idle stretch [m/s]; empty where it is too short."""
    width = odd_rows(CHECKS.idle_mean_s, rate_hz)
    if len(surge) / rate_hz < CHECKS.idle_s or len(surge) < 3 * width:
        return np.empty(0)
    return np.asarray(moving_mean(np.abs(surge)[:, None], width)[:, 0])


def _slopes(speed: Floats, rate_hz: float) -> Floats:
    """Return how fast a speed grows over a mean's width [m/s²]."""
    width = odd_rows(CHECKS.idle_mean_s, rate_hz)
    return np.asarray((speed[width:] - speed[:-width]) * rate_hz / width)


def _speeding(speed: Floats, rate_hz: float) -> tuple[float, float]:
    """Return how fast the bow's speed grows at most [m/s²], astern or ahead, and by how much in all [m/s]."""
    known = speed[np.isfinite(speed)]
    slopes = _slopes(known, rate_hz)
    if not len(slopes):
        return 0.0, 0.0
    return float(slopes.max()), float((known - np.minimum.accumulate(known)).max())


def _slope_error(speed: Floats, by_pose: Floats, rate_hz: float) -> float:
    """Return the standard error of such a slope [m/s²]: how far those of the velocity and of the pose differ; 0 without a pose.

    That holds the errors of both, so that it is not too small.
    """
    apart = _slopes(speed, rate_hz) - _slopes(by_pose, rate_hz)
    apart = apart[np.isfinite(apart)]
    return float(np.sqrt(np.mean(apart**2))) if len(apart) else 0.0


CHECK = Check("unrecorded_force", "Motion while every actuator is idle", find, place=8)
