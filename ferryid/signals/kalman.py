"""Constant-acceleration Kalman smoother: a velocity with white jerk, seen through white noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.types import Flags, Floats

WINDOW_PER_TIME = 8.0 * np.sqrt(2.0) / 3.0
"""Length of the moving average with the same noise gain, over the smoother's time constant.

Far from its ends the smoother's response is ``1 / (1 + (w T)^4)``, ``T^4 = R dt / q``. White noise keeps
``3 / (8 sqrt(2) T)`` of its density, and ``1 / window`` in a moving average.
"""
_LONGEST_S = 20.0
_GRID = 16
_LEAST_ROWS = 2
_FIT_ROWS = 200_000


@dataclass(frozen=True)
class Levels:
    """Noise levels of one axis.

    Attributes
    ----------
    noise
        Standard deviation of the measurement noise, in the unit of the signal.
    jerk
        Spectral density of the jerk, in (unit/s²)² per hertz.
    time_s
        Time constant T of the smoother [s]; 0 where it leaves the signal as it is.
    """

    noise: float
    jerk: float
    time_s: float

    @property
    def window_s(self) -> float:
        """Length of the moving average that lets as much white noise pass [s]."""
        return float(WINDOW_PER_TIME * self.time_s)


def fit_levels(nu: Floats, stretches: Sequence[slice], rate_hz: float, window_s: float) -> tuple[Levels, ...]:
    """Find the noise levels of each axis by maximum likelihood.

    In its steady state the filter's likelihood, with the common scale of both noises at its best value, depends on the
    variance of the one-step prediction error alone. That is minimised over the time constant.

    Parameters
    ----------
    nu
        Unsmoothed velocities, shape (n, 3).
    stretches
        Unbroken stretches of measured rows.
    rate_hz
        Rows per second.
    window_s
        Least equivalent window [s].

    Returns
    -------
    tuple of Levels
        Surge, sway, yaw.
    """
    dt = 1.0 / rate_hz
    runs = _some(stretches)
    longest_s = max(run.stop - run.start for run in stretches) * dt
    least = max(window_s / WINDOW_PER_TIME, 0.2 * dt)
    most = max(min(_LONGEST_S, longest_s / 10) / WINDOW_PER_TIME, least)
    levels = []
    for axis in range(3):
        columns = [nu[run, axis] for run in runs]
        # Twice a grid: the variance can have more than one valley.
        times = np.geomspace(least, most, _GRID)
        for _ in range(2):
            variances = [_prediction_variance(columns, time_s / dt) for time_s in times]
            best = int(np.argmin(variances))
            time_s, variance = float(times[best]), variances[best]
            times = np.geomspace(times[max(best - 1, 0)], times[min(best + 1, _GRID - 1)], _GRID)
        noise_variance = variance / steady_state(time_s / dt)[1]
        levels.append(Levels(float(np.sqrt(noise_variance)), float(noise_variance * dt / time_s**4), time_s))
    return tuple(levels)


def smooth_runs(values: Floats, axes: Sequence[int], levels: Sequence[Levels], rate_hz: float) -> tuple[Floats, Floats]:
    """Smooth columns over each unbroken run of theirs.

    Parameters
    ----------
    values
        Shape (n, c), the first three columns are the velocities.
    axes
        Axis whose levels a column is smoothed with, c of them.
    levels
        Of surge, sway, yaw.
    rate_hz
        Rows per second.

    Returns
    -------
    smoothed
        Shape (n, c); NaN where nothing was measured, and in runs of one row.
    slope
        Estimated acceleration of the first three columns, shape (n, 3).
    """
    smoothed = np.full_like(values, np.nan)
    slope = np.full((len(values), 3), np.nan)
    for i, axis in enumerate(axes):
        column = values[:, i]
        for run in _runs(np.isfinite(column)):
            state = smooth_run(column[run], levels[axis].time_s * rate_hz)
            smoothed[run, i] = state[0]
            if i < 3:
                slope[run, i] = state[1] * rate_hz
    return smoothed, slope


def smooth_run(values: Floats, time_rows: float) -> Floats:
    """Return the smoothed signal and its slope per row, shape (2, n).

    The Rauch-Tung-Striebel recursion with an unknown initial state has the same answer as these normal equations of
    ``sum (z - x)² + T^4 sum w' Q^-1 w``, which are banded and solved at once; T in rows.

    Parameters
    ----------
    values
        Without NaN, shape (n,), at least two.
    time_rows
        Time constant of the smoother in rows.
    """
    from scipy.linalg import solveh_banded

    n = values.size
    weight = time_rows**4
    # Unknowns x_0, a_0, x_1, a_1 ... with a the slope per row; w = s_k+1 - F s_k, F = [[1, 1], [0, 1]],
    # Q^-1 = [[12, -6], [-6, 4]].
    band = np.zeros((4, 2 * n))
    xx, xa, aa = band[3, 0::2], band[2, 1::2], band[3, 1::2]
    xx[:] = 1.0
    xx[:-1] += 12.0 * weight
    xx[1:] += 12.0 * weight
    aa[:-1] += 4.0 * weight
    aa[1:] += 4.0 * weight
    xa[:-1] += 6.0 * weight
    xa[1:] -= 6.0 * weight
    # Between rows k and k + 1, -F' Q^-1 = [[-12, 6], [-6, 2]].
    band[1, 2::2] = -12.0 * weight
    band[0, 3::2] = 6.0 * weight
    band[2, 2::2] = -6.0 * weight
    band[1, 3::2] = 2.0 * weight
    right = np.zeros(2 * n)
    right[0::2] = values
    state: Floats = solveh_banded(band, right, check_finite=False).reshape(n, 2).T
    return state


def _prediction_variance(columns: Sequence[Floats], time_rows: float) -> float:
    """Return the mean square of the steady-state filter's one-step prediction errors."""
    from ferryid.recursive_filter import recursive_filter  # brings numba

    polynomial, _ = steady_state(time_rows)
    total, count = 0.0, 0
    for column in columns:
        # Starting at zero is wrong by the first value only, and soon forgotten.
        error = recursive_filter(np.array([1.0, -2.0, 1.0]), polynomial, column - column[0])
        settled = error[min(column.size // 2, int(5 * time_rows) + 2) :]
        total += float(settled @ settled)
        count += settled.size
    return total / count


def steady_state(time_rows: float) -> tuple[Floats, float]:
    """Return the steady-state filter: the second difference of the measurement is this polynomial of its prediction error.

    The second difference is a moving average of second order, with autocovariances ``6 + 2 e/3, -4 + e/6, 1`` for
    ``e = T^-4``, over the variance of the measurement noise. The polynomial is its factor with roots inside the unit
    circle.

    Returns
    -------
    polynomial
        Coefficients, first one 1, shape (3,).
    variance
        Variance of the prediction error over that of the measurement noise.
    """
    e = time_rows**-4
    # With w = z + 1/z, autocovariances give w² + (e/6 - 4) w + 4 + 2 e/3 = 0; w - 2 is formed without cancellation.
    root = np.sqrt(complex(e * e / 144 - e))
    beyond = np.array([-e / 12 + root, -e / 12 - root])
    half = np.sqrt(beyond * (beyond + 4.0))
    inner = 1.0 + beyond / 2 - half / 2
    outer = 1.0 + beyond / 2 + half / 2
    roots = np.where(np.abs(inner) < np.abs(outer), inner, outer)
    polynomial = np.array([1.0, -float(np.sum(roots).real), float(np.prod(roots).real)])
    return polynomial, 1.0 / float(polynomial[2])


def _some(stretches: Sequence[slice]) -> list[slice]:
    """Return stretches of 30 rows and more, the longest where none is, and no more rows than needed."""
    long = [run for run in stretches if run.stop - run.start >= 30]
    chosen: list[slice] = []
    rows = 0
    for run in long or [max(stretches, key=lambda run: run.stop - run.start)]:
        if rows >= _FIT_ROWS:
            break
        chosen.append(slice(run.start, min(run.stop, run.start + _FIT_ROWS - rows)))
        rows += chosen[-1].stop - chosen[-1].start
    return chosen


def _runs(known: Flags) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= _LEAST_ROWS]
