"""Coloured noise as a navigation filter leaves it, and gusts; every channel with a random stream of its own."""

from __future__ import annotations

import zlib
from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def generator(seed: int, channel: str) -> np.random.Generator:
    """Return the random stream of one channel, which no other channel can shift."""
    return np.random.default_rng([seed, zlib.crc32(channel.encode())])


def smooth_noise(random: np.random.Generator, n: int, step_s: float, std: float, rate_std: float) -> Floats:
    """Return stationary noise whose own standard deviation and that of its time derivative are both given, shape (n,).

    A critically damped second-order Gauss-Markov process, sampled exactly. Table 5.2 of Aurlien (2021) states the
    noise of velocities and of accelerations; only coloured noise can have both.
    """
    if std == 0.0 or rate_std == 0.0:
        return np.zeros(n)
    w = rate_std / std
    e = exp(-w * step_s)
    A = np.array([[1.0 + w * step_s, step_s], [-w * w * step_s, 1.0 - w * step_s]]) * e
    P = np.diag([std * std, rate_std * rate_std])
    Q = P - A @ P @ A.T
    # Cholesky factor by hand: rounding may leave nothing of Q[0, 0] where the process hardly moves within a step.
    first = sqrt(max(float(Q[0, 0]), 0.0))
    cross = float(Q[1, 0]) / first if first > 0.0 else 0.0
    second = sqrt(max(float(Q[1, 1]) - cross * cross, 0.0))
    white = random.standard_normal((n, 2))
    kicks = np.column_stack((first * white[:, 0], cross * white[:, 0] + second * white[:, 1])).tolist()
    x, x_dot = std * white[0, 0], rate_std * white[0, 1]
    a, b, c, d = A.ravel().tolist()
    values = [x]
    for kick, kick_dot in kicks[1:]:
        x, x_dot = a * x + b * x_dot + kick, c * x + d * x_dot + kick_dot
        values.append(x)
    return np.asarray(values)


def measurement_noise(
    random: np.random.Generator, n: int, step_s: float, std: float, rate_std: float, white_share: float
) -> Floats:
    """Return noise of standard deviation `std`, of which the share `white_share` (of `std`) is white, shape (n,)."""
    white = white_share * std * random.standard_normal(n)
    return white + smooth_noise(random, n, step_s, std * sqrt(1.0 - white_share**2), rate_std)


def gusts(random: np.random.Generator, n: int, step_s: float, std: float, time_constant_s: float) -> Floats:
    """Return an Ornstein-Uhlenbeck process, stationary from its first sample on, shape (n,)."""
    if std == 0.0:
        return np.zeros(n)
    keep = exp(-step_s / time_constant_s)
    kicks = (std * sqrt(1.0 - keep * keep) * random.standard_normal(n)).tolist()
    value = std * float(random.standard_normal())
    values = []
    for kick in kicks:
        values.append(value)
        value = keep * value + kick
    return np.asarray(values)
