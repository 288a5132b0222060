"""Azimuth resolution: measured angles are rounded to a coarse step, and thrust acts along the true ones.

That angles lie on a grid is plain to see in them; no force is needed to tell. Rounding errs to either side alike, and averages
out over the seconds in which forces act: a step is worth a finding only where it is coarse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats

TURNS = np.arange(-2, 3)
"""Whole turns after which an angle may have been rounded that is written within half a turn."""


def step_of(angle: Floats) -> float:
    """Return the step that an angle [rad] is rounded to [deg], 0 for none."""
    if not np.isfinite(angle).all():
        return 0.0
    still = np.abs(np.diff(angle)) < 1e-9
    held = np.flatnonzero(still[1:] & still[:-1])
    if held.size < CHECKS.azimuth_held * len(angle):
        return 0.0
    readings = np.degrees(angle[held])
    readings = readings - 360.0 * np.round(readings / 360.0)
    apart = np.diff(np.unique(np.round(readings, 6)))
    apart = apart[apart > 1e-4]
    if apart.size < 2:
        return 0.0
    # Half a turn need not be a multiple: next to it readings may lie closer than a step.
    gaps, counts = np.unique(np.round(apart, 4), return_counts=True)
    step = float(np.median(apart[np.abs(apart - gaps[np.argmax(counts)]) < 1e-3]))
    return (
        step
        if float(np.mean(off_grid(readings, step) < CHECKS.azimuth_close * step)) >= CHECKS.azimuth_on_grid
        else 0.0
    )


def off_grid(readings: Floats, step_deg: float) -> Floats:
    """Return how far readings [deg], shape (n,), are from the nearest multiple of a step [deg]."""
    turned = readings[:, None] + 360.0 * TURNS
    return np.asarray(np.abs(turned - step_deg * np.round(turned / step_deg)).min(axis=1))


def estimate(step_deg: float) -> Estimate:
    """Return a step with its interval: it is known as well as multiples of it are recognised."""
    return Estimate(step_deg, (1.0 - CHECKS.azimuth_close) * step_deg, (1.0 + CHECKS.azimuth_close) * step_deg, "deg")


def restored(angle: Floats, step_deg: float, step_s: float) -> Floats:
    """Return the angle [rad] that a rounded one most likely stands for, shape (n,).

    Where the reading changes, the true angle is halfway. From one such moment to the next it is taken to go straight, and back
    to the reading where that lasts.
    """
    step = np.radians(step_deg)
    turns = 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    level = turns + step * np.round((angle - turns) / step)
    change = np.flatnonzero(np.diff(level))
    if change.size < 2:
        return angle
    row = np.arange(len(angle), dtype=np.float64)
    at = change + 0.5
    straight = np.interp(row, at, 0.5 * (level[change] + level[change + 1]))
    k = np.searchsorted(at, row)
    since = np.where(k > 0, row - at[np.maximum(k - 1, 0)], np.inf)
    until = np.where(k < len(at), at[np.minimum(k, len(at) - 1)] - row, np.inf)
    back = np.clip(np.minimum(since, until) * step_s * CHECKS.azimuth_slew_degps / step_deg, 0.0, 1.0)
    return np.asarray((1.0 - back) * straight + back * level)


def corrected(measurements: Measurements, steps_deg: Sequence[float]) -> Measurements:
    """Return measurements whose angles, and the directions of the forces, are what rounded ones most likely stand for.

    Parameters
    ----------
    measurements
        As measured.
    steps_deg
        Step of each actuator's angle [deg], 0 for none.
    """
    parts, angles = measurements.parts.copy(), measurements.angles.copy()
    for i, (one, actuator) in enumerate(zip(steps_deg, measurements.profile.actuators, strict=True)):
        if one == 0.0:
            continue
        angles[:, i] = restored(measurements.angles[:, i], one, measurements.step_s)
        turn = angles[:, i] - measurements.angles[:, i]
        c, s = np.cos(turn), np.sin(turn)
        X, Y = measurements.parts[:, i, 0], measurements.parts[:, i, 1]
        x, y = actuator.position_m
        parts[:, i, 0], parts[:, i, 1] = c * X - s * Y, s * X + c * Y
        parts[:, i, 2] = x * parts[:, i, 1] - y * parts[:, i, 0]
    return replace(measurements, parts=parts, angles=angles)


def error_of(step: float) -> float:
    """Return the standard deviation of an angle's error, which is uniform within a step [rad]; the step is in degrees."""
    return float(np.radians(step) / np.sqrt(12.0))


def find(measurements: Measurements) -> SensorFinding | None:
    """Return the step of the coarsest azimuth angle, where it matters to the direction of the force."""
    steps = [step_of(angle) for angle in measurements.angles.T]
    step = max(steps, default=0.0)
    error = error_of(step)
    if error < CHECKS.least_azimuth_error:
        return None
    k = int(np.argmax(steps))

    return SensorFinding(
        "azimuth_resolution",
        {"step": estimate(step)},
        f"The azimuth angles are read in steps of {step:g} deg: at any moment the force points {100.0 * error:.0f} % of itself "
        "to one side or the other.",
        lambda measured: corrected(measured, steps),
        {"time_s": measurements.t, "angle_deg": np.degrees(measurements.angles[:, k])},
    )


CHECK = Check("azimuth_resolution", "Steps of the azimuth angles", find, place=70)
