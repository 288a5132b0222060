"""The navigation: GNSS and inertial instruments with errors of their own, joined by an observer of fixed gains.

What it reports errs as such systems do: smooth drifts, steps at every fix, errors of position and velocity that go together.
"""

from __future__ import annotations

from math import cos, exp, pi, radians, sin
from typing import NamedTuple

import numpy as np

from ferryid.compiled import compiled
from ferryid.types import Floats

RATE_HZ = 20.0
FIX_EVERY = 4
"""Samples between GNSS fixes: 5 Hz."""
HEIGHT_M = 0.4
"""Of the instruments above the origin."""
FIX_M, DRIFT_M, DRIFT_S = 0.01, 0.015, 60.0
FIX_MPS = 0.02
SHAKE_MPS2, BIAS_MPS2, BIAS_S = 0.03, 0.008, 120.0
COMPASS_DEG, COMPASS_S = 0.15, 25.0
COMPASS_WHITE_DEG = 0.15
GYRO_DEGPS, GYRO_BIAS_DEGPS, GYRO_BIAS_S = 0.06, 0.01, 200.0
GAIN_POSITION, GAIN_VELOCITY, GAIN_SPEED, GAIN_BIAS, GAIN_HEADING = 0.35, 0.12, 0.22, 0.004, 0.04
"""Of the observer: fix to position, fix to velocity, GNSS velocity to velocity, to bias, and compass to heading."""


class Errors(NamedTuple):
    """Errors of the instruments by sample: fixes (n, 2), GNSS velocities (n, 2), accelerations (n, 2), compass, gyro (n,)."""

    fix: Floats
    speed: Floats
    shake: Floats
    compass: Floats
    gyro: Floats


def slow_errors(rng: np.random.Generator, samples: int, columns: int, std: float, time_s: float) -> Floats:
    """Return Gauss-Markov processes of a standard deviation and a time constant [s], shape (samples, columns)."""
    keep = exp(-1.0 / RATE_HZ / time_s)
    steps = rng.standard_normal((samples, columns)) * std * np.sqrt(1.0 - keep * keep)
    steps[0] = rng.standard_normal(columns) * std
    for row in range(1, samples):
        steps[row] += keep * steps[row - 1]
    return np.asarray(steps)


def instrument_errors(rng: np.random.Generator, samples: int, factor: float) -> Errors:
    """Return the errors of all instruments, `factor` times as large as usual ones."""

    def slow(std: float, time_s: float, columns: int) -> Floats:
        return slow_errors(rng, samples, columns, std, time_s)

    def white(std: float, columns: int) -> Floats:
        return np.asarray(std * rng.standard_normal((samples, columns)))

    compass = radians(COMPASS_WHITE_DEG) * white(1.0, 1) + radians(COMPASS_DEG) * slow(1.0, COMPASS_S, 1)
    gyro = radians(GYRO_DEGPS) * white(1.0, 1) + radians(GYRO_BIAS_DEGPS) * slow(1.0, GYRO_BIAS_S, 1)
    return Errors(
        factor * (white(FIX_M, 2) + slow(DRIFT_M, DRIFT_S, 2)),
        factor * white(FIX_MPS, 2),
        factor * (white(SHAKE_MPS2, 2) + slow(BIAS_MPS2, BIAS_S, 2)),
        factor * compass[:, 0],
        factor * gyro[:, 0],
    )


@compiled
def navigate(
    errors: Errors, row: int, h: float, pose: Floats, rates: Floats, pushed: Floats, memory: Floats, out: Floats
) -> None:
    """Take one step of the observer.

    Parameters
    ----------
    errors
        From `instrument_errors`.
    row
        Which sample.
    h
        Its period [s].
    pose
        True north, east [m] and heading [rad] of the instruments, shape (3,).
    rates
        True velocity of the instruments, north and east [m/s], and yaw rate [rad/s], shape (3,).
    pushed
        True acceleration of the instruments, north and east [m/s²], the mean since the last sample, shape (2,).
    memory
        Estimates: position, velocity, bias along and across, heading, shape (7,).
    out
        North, east, heading, surge, sway, yaw rate, shape (6,).
    """
    turn = rates[2] + errors.gyro[row]
    memory[6] += h * turn
    off = pose[2] + errors.compass[row] - memory[6]
    off -= 2.0 * pi * np.floor((off + pi) / (2.0 * pi))
    memory[6] += GAIN_HEADING * off
    c, s = cos(memory[6]), sin(memory[6])
    ct, st = cos(pose[2]), sin(pose[2])
    along = ct * pushed[0] + st * pushed[1] + errors.shake[row, 0] - memory[4]
    across = ct * pushed[1] - st * pushed[0] + errors.shake[row, 1] - memory[5]
    a = (c * along - s * across, s * along + c * across)
    for j in range(2):
        memory[j] += h * (memory[2 + j] + 0.5 * h * a[j])
        memory[2 + j] += h * a[j]
    if row % FIX_EVERY == 0:
        missed = np.empty(2)
        for j in range(2):
            e_position = pose[j] + errors.fix[row, j] - memory[j]
            e_speed = rates[j] + errors.speed[row, j] - memory[2 + j]
            memory[j] += GAIN_POSITION * e_position
            memory[2 + j] += GAIN_VELOCITY * e_position + GAIN_SPEED * e_speed
            missed[j] = e_speed
        memory[4] -= GAIN_BIAS * (c * missed[0] + s * missed[1])
        memory[5] -= GAIN_BIAS * (c * missed[1] - s * missed[0])
    out[0], out[1], out[2] = memory[0], memory[1], memory[6]
    out[3] = c * memory[2] + s * memory[3]
    out[4] = c * memory[3] - s * memory[2]
    out[5] = turn
