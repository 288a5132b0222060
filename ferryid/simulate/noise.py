"""Random numbers that a seed gives with every version of NumPy, and noise made of them: coloured, gusts, dropouts.

NumPy promises the integers of a seeded PCG64 for good, but not what its distributions make of them: a scenario's noise is
made of the integers.
"""

from __future__ import annotations

import zlib
from math import ceil, cos, exp, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import compiled
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.sections import Noise
from ferryid.types import Flags, Floats

Integers = NDArray[np.uint64]
State = tuple[float, float, float, float, float, float]
Vector = tuple[float, float, float]


class Random:
    """One stream of random numbers; the methods draw from it one after the other.

    Parameters
    ----------
    seed
        Of the whole trial.
    channel
        What the stream is for; streams of two channels have nothing in common, and none can shift another.
    """

    def __init__(self, seed: int, channel: str) -> None:
        self._source = np.random.PCG64([seed, zlib.crc32(channel.encode())])

    def integers(self, n: int) -> Integers:
        """Return n integers of 64 random bits."""
        return np.asarray(self._source.random_raw(n), dtype=np.uint64)

    def random(self, n: int) -> Floats:
        """Return n numbers that are uniform between 0 and 1, and never either."""
        return np.asarray(((self.integers(n) >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52)

    def standard_normal(self, n: int) -> Floats:
        """Return n numbers of the standard normal distribution, by the method of Box and Muller."""
        uniform = self.random(n + n % 2).reshape(-1, 2)
        radius, angle = np.sqrt(-2.0 * np.log(uniform[:, 0])), 2.0 * pi * uniform[:, 1]
        return np.column_stack((radius * np.cos(angle), radius * np.sin(angle))).ravel()[:n]

    def normal_columns(self, n: int, columns: int) -> Floats:
        """Return independent normal numbers, shape (n, columns); the first rows do not depend on how many follow."""
        return self.standard_normal(n * columns).reshape(n, columns)

    def standard_exponential(self, n: int) -> Floats:
        """Return n numbers of the exponential distribution of mean 1."""
        return -np.log(self.random(n))

    def bytes(self, n: int) -> bytes:
        """Return n random bytes."""
        return self.integers(-(-n // 8)).astype("<u8").tobytes()[:n]


def generator(seed: int, channel: str) -> Random:
    """Return the random stream of one channel, which no other channel can shift."""
    return Random(seed, channel)


def smooth_noise(random: Random, n: int, step_s: float, std: float, rate_std: float) -> Floats:
    """Return stationary noise whose own standard deviation and that of its time derivative are both given, shape (n,).

    A critically damped second-order Gauss-Markov process, sampled exactly. Table 5.2 of Aurlien (2021) states the
    noise of velocities and of accelerations; only coloured noise can have both. One that does not change at all is a constant.
    """
    if std == 0.0:
        return np.zeros(n)
    if rate_std == 0.0:
        return np.full(n, std * float(random.standard_normal(1)[0]))
    w = rate_std / std
    e = exp(-w * step_s)
    # Transition of (x, x_dot), and the covariance Q = P - A P A' that one step adds, P the stationary one.
    a, b, c, d = (1.0 + w * step_s) * e, step_s * e, -w * w * step_s * e, (1.0 - w * step_s) * e
    p, q = std * std, rate_std * rate_std
    # Cholesky factor of Q; rounding may leave nothing of its first element where the process hardly moves within a step.
    first = sqrt(max(p - (a * a * p + b * b * q), 0.0))
    cross = -(a * c * p + b * d * q) / first if first > 0.0 else 0.0
    second = sqrt(max(q - (c * c * p + d * d * q) - cross * cross, 0.0))
    values = np.empty(n)
    _second_order(random.standard_normal(2 * n), (a, b, c, d), (first, cross, second), (std, rate_std), values)
    return values


@compiled
def _second_order(
    white: Floats,
    transition: tuple[float, float, float, float],
    kick: tuple[float, float, float],
    start: tuple[float, float],
    values: Floats,
) -> None:
    a, b, c, d = transition
    first, cross, second = kick
    x, x_dot = start[0] * white[0], start[1] * white[1]
    for i in range(len(values)):
        if i > 0:
            one, other = white[2 * i], white[2 * i + 1]
            x, x_dot = a * x + b * x_dot + first * one, c * x + d * x_dot + (cross * one + second * other)
        values[i] = x


def measurement_noise(
    white: Random, coloured: Random, n: int, step_s: float, std: float, rate_std: float, white_share: float
) -> Floats:
    """Return noise of standard deviation `std`, of which the share `white_share` (of `std`) is white, shape (n,).

    White and coloured part are drawn from streams of their own, so that more noise begins like less of it.
    """
    smooth = smooth_noise(coloured, n, step_s, std * sqrt(1.0 - white_share * white_share), rate_std)
    return white_share * std * white.standard_normal(n) + smooth


def gusts(random: Random, n: int, step_s: float, std: float, time_constant_s: float) -> Floats:
    """Return an Ornstein-Uhlenbeck process, stationary from its first sample on, shape (n,)."""
    if std == 0.0:
        return np.zeros(n)
    keep = exp(-step_s / time_constant_s)
    values = random.standard_normal(n)
    _first_order(values, keep, std, std * sqrt(1.0 - keep * keep))
    return values


@compiled
def _first_order(values: Floats, keep: float, start: float, kick: float) -> None:
    """Turn white noise into a first-order process, in place."""
    value = start * values[0]
    values[0] = value
    for i in range(1, len(values)):
        value = keep * value + kick * values[i]
        values[i] = value


def gaps(random: Random, t: Floats, per_min: float, length_s: float) -> Flags:
    """Return where a sensor is silent, shape (n,), the first sample never being lost.

    Silences come at random, `per_min` to a minute of the time between them, and last `length_s`.

    Parameters
    ----------
    t
        Sample times [s], ascending, shape (n,).
    """
    lost = np.zeros(len(t), dtype=bool)
    if per_min == 0.0 or length_s == 0.0 or not len(t):
        return lost
    start = float(t[0])
    while start <= t[-1]:
        start += 60.0 / per_min * float(random.standard_exponential(1)[0])
        first, end = np.searchsorted(t, (start, start + length_s), side="right")
        lost[first:end] = True
        start += length_s
    lost[0] = False
    return lost


def sample_times(end_s: float, rate_hz: float, phase_s: float) -> Floats:
    """Return when a sensor takes its samples, from `phase_s` up to `end_s` [s]."""
    n = max(ceil((end_s - phase_s) * rate_hz - 1e-9), 0)
    return np.asarray(np.arange(n, dtype=np.float64) / rate_hz + phase_s)


def interpolated(t: Floats, grid: Floats, values: Floats) -> Floats:
    """Return the columns of `values`, given at ascending `grid`, at ascending times `t`; linear, held beyond the ends.

    Parameters
    ----------
    t, grid
        Times [s], shape (n,) and (m,).
    values
        Shape (m, k).

    Returns
    -------
    Floats
        Shape (n, k).
    """
    return np.column_stack([np.interp(t, grid, column) for column in values.T])


def navigation_noise(noise: Noise, seed: int, n: int, step_s: float) -> Floats:
    """Return the errors of pose and velocities as a navigation filter leaves them, shape (n, 6) [m, rad, m/s, rad/s].

    The time derivative of a position's error is as large as the velocity's own error, and that of a velocity's error
    as large as Table 5.2 states for the acceleration, which is what one gets who differentiates the velocities.
    """
    turn, yaw = radians(noise.yaw_rate_degps), radians(noise.yaw_acceleration_degps2)
    channels = {
        "x": (noise.position_m, noise.velocity_mps),
        "y": (noise.position_m, noise.velocity_mps),
        "psi": (radians(noise.heading_deg), turn),
        "u": (noise.velocity_mps, noise.acceleration_mps2),
        "v": (noise.velocity_mps, noise.acceleration_mps2),
        "r": (turn, yaw),
    }
    return np.column_stack(
        [
            measurement_noise(
                generator(seed, f"{name} white"), generator(seed, name), n, step_s, std, rate_std, noise.white_share
            )
            for name, (std, rate_std) in channels.items()
        ]
    )


class NavErrors(NamedTuple):
    """Systematic errors of the navigation: `ferryid.simulate.sections.Navigation` in SI units."""

    antenna_x_m: float
    antenna_y_m: float
    heading_bias_rad: float
    yaw_rate_factor: float
    delay_s: float


def navigation_errors(scenario: Scenario) -> NavErrors:
    """Return the systematic errors of a scenario's navigation."""
    navigation = scenario.sensors.navigation
    ahead, across = navigation.antenna_m
    return NavErrors(
        ahead,
        across,
        radians(navigation.heading_bias_deg),
        navigation.yaw_rate_factor,
        navigation.delay_s,
    )


@compiled
def measure(errors: NavErrors, noise: Floats, state: State) -> tuple[Vector, Vector]:
    """Return pose and velocities as the navigation gives them.

    The antenna's velocity over ground is resolved with the heading as measured, so that a biased heading turns the
    velocity as well, the way a satellite compass does that is mounted askew.

    Parameters
    ----------
    errors
        Systematic errors.
    noise
        The control cycle's row of `navigation_noise`, shape (6,).
    state
        Pose and velocities of the body origin at the time measured, `delay_s` ago.

    Returns
    -------
    eta, nu
        Pose [m, m, rad] and velocities [m/s, m/s, rad/s].
    """
    x, y, psi, u, v, r = state
    ahead, across = errors.antenna_x_m, errors.antenna_y_m
    c, s = cos(psi), sin(psi)
    x, y = x + (c * ahead - s * across), y + (s * ahead + c * across)
    u, v = u - r * across, v + r * ahead
    if errors.heading_bias_rad != 0.0:
        c, s = cos(errors.heading_bias_rad), sin(errors.heading_bias_rad)
        u, v = c * u + s * v, c * v - s * u
    psi, r = psi + errors.heading_bias_rad, r * errors.yaw_rate_factor
    return (x + noise[0], y + noise[1], psi + noise[2]), (u + noise[3], v + noise[4], r + noise[5])


def navigation_sent(scenario: Scenario, seed: int, n: int, step_s: float) -> Flags:
    """Return in which control cycles the navigation sends anything, shape (n,)."""
    navigation = scenario.sensors.navigation
    t = np.arange(n, dtype=np.float64) * step_s
    return ~gaps(generator(seed, "navigation gaps"), t, navigation.dropouts_per_min, navigation.dropout_s)
